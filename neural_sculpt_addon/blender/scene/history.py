# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's undo, redo, load and save, as far as the worker and the previews must know of them.

The object's properties are the truth and Blender restores them together with the proxy mesh. What
remains is to show the reports that came after the undo step of their stroke, to cancel the jobs
whose base is no longer there, and to keep previews out of undo steps and files.
"""

import bpy
from bpy.app.handlers import persistent

from ..session import live, reports
from ..session.worker_session import session
from ..viewport import preview
from . import native_steps
from .commit import in_edit_mode, push_undo


@persistent
def undo_stroke(*_: object) -> None:
    """Before undo: a stroke that has no result is what the artist did last, and no undo step yet.

    It is cancelled; the undo itself is given a step to take back that changes nothing. In Edit Mode
    the artist has done something else since.
    """
    if native_steps.is_ours():
        return
    preview.hide()
    if not in_edit_mode() and (job := session.newest_stroke()) is not None:
        session.cancel_job(job, f"{job.label} was undone.")
        push_undo(job.label)


@persistent
def hide(*_: object) -> None:
    """Before redo and saving, and after loading what Blender saved by itself."""
    if not native_steps.is_ours():
        preview.hide()


@persistent
def show(*_: object) -> None:
    """After saving."""
    preview.show()


@persistent
def follow(*_: object) -> None:
    """After undo and redo."""
    if native_steps.is_ours():
        return
    live.leave()
    session.follow_history()
    reports.follow()
    preview.show()
    if (ob := bpy.context.active_object) is not None and not session.jobs:
        reports.measure_again(ob)


@persistent
def leave(*_: object) -> None:
    """Before another file is loaded."""
    live.forget()
    session.leave_file()


_HANDLERS = (
    ("undo_pre", undo_stroke),
    ("redo_pre", hide),
    ("undo_post", follow),
    ("redo_post", follow),
    ("save_pre", hide),
    ("save_post", show),
    ("load_pre", leave),
    ("load_post", hide),
)


def register() -> None:
    """Listen to Blender's history."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
