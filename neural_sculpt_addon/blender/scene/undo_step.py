# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo steps of ours: what goes ahead of a change, what is pushed after it, in which context."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from . import kept_steps, sculpt_steps
from .mesh.preview import preview

PARTIAL = "EDIT", "PAINT_TEXTURE", "PARTICLE"
"""How the names of modes begin whose undo steps hold nothing but what is edited: a mesh or another
object, images, hair."""


def begin_change() -> None:
    """Prepare for a change that `push_undo` will make an undo step of, so that Ctrl Z takes it back
    as a whole."""
    kept_steps.settle()
    begin_border()


def begin_border() -> bool:
    """Push a border in Sculpt Mode, where the next change needs one; whether it did."""
    with in_window():
        sculpting = bpy.context.mode == "SCULPT"
    if not sculpting or not sculpt_steps.needs_border():
        return False
    push_undo(sculpt_steps.BORDER)
    kept_steps.note_pushed()
    return True


def push_undo(label: str) -> None:
    """Let Blender remember everything as it is, without what is only previewed."""
    preview.hide()
    with in_window(), _without_paint_curve():
        bpy.ops.ed.undo_push(message=label)


@contextmanager
def _without_paint_curve() -> Iterator[None]:
    """No brush strokes along a paint curve while this block runs. Where the active one does,
    Blender takes each step for one of that curve, which holds nothing else."""
    tools = bpy.context.tool_settings
    paints = tools.sculpt, tools.vertex_paint, tools.weight_paint, tools.image_paint
    brushes = [paint.brush for paint in paints if paint is not None and paint.brush is not None]
    along = [brush for brush in brushes if brush.stroke_method == "CURVE"]
    for brush in along:
        brush.stroke_method = "SPACE"
    try:
        yield
    finally:
        for brush in along:
            brush.stroke_method = "CURVE"


def in_partial_mode() -> bool:
    """Whether any object is in a mode whose undo steps hold nothing but what is edited."""
    with in_window():
        return bpy.context.mode.startswith(PARTIAL)


def in_window(scene: int = 0) -> Any:
    """A context with a window: that of a timer has none just after a file was loaded.

    scene: session_uid of the scene that the window is to show, if any does
    """
    windows = bpy.context.window_manager.windows
    shown = (window for window in windows if window.scene.session_uid == scene)
    return bpy.context.temp_override(window=next(shown, windows[0]))
