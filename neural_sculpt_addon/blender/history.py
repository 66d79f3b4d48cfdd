# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's undo, redo and load, as far as the worker must know of them.

The object's properties are the truth and Blender restores them together with the proxy mesh. What
remains is to show final results where undo brought their quick ones back, and to cancel the jobs
whose base is no longer there.
"""

import bpy
from bpy.app.handlers import persistent

from .worker_session import session


@persistent
def follow(*_: object) -> None:
    """After undo and redo."""
    session.follow_history()


@persistent
def leave(*_: object) -> None:
    """Before another file is loaded."""
    session.leave_file()


_HANDLERS = (("undo_post", follow), ("redo_post", follow), ("load_pre", leave))


def register() -> None:
    """Listen to Blender's history."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
