# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo steps of ours: what goes ahead of a change, what is pushed after it, in which context."""

from typing import Any

import bpy

from . import kept_steps, sculpt_steps
from .mesh.preview import preview


def begin_change() -> None:
    """Ahead of a change that `push_undo` makes an undo step of: Ctrl Z must take it back whole."""
    kept_steps.settle()
    with in_window():
        sculpting = bpy.context.mode == "SCULPT"
    if sculpting and sculpt_steps.needs_border():
        push_undo(sculpt_steps.BORDER)


def push_undo(label: str) -> None:
    """Let Blender remember everything as it is, without what is only previewed."""
    preview.hide()
    with in_window():
        bpy.ops.ed.undo_push(message=label)


def in_edit_mode() -> bool:
    """Whether the artist is in Edit Mode of anything, whose undo steps hold nothing else."""
    with in_window():
        return bpy.context.mode.startswith("EDIT")


def in_window() -> Any:
    """A context with a window, which a timer lacks just after a file was loaded."""
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0])
