# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool Neural Stroke in the toolbars of Object Mode and Sculpt Mode, and its keys.

Blender keeps a tool's keys in the add-on's key configuration, where the artist can change them:
Preferences, Keymap, 3D View, "3D View Tool: Object, Neural Stroke".
"""

import bpy
from bpy.types import Context, UILayout, WorkSpaceTool

from .panels.brush_widgets import draw_lengths, draw_mirror
from .scene.brush.brush_properties import brush_of
from .scene.chosen import TOOL
from .scene.properties import is_field

DRAW = "neural_sculpt.draw"
NO_DRAG = "neural_sculpt.no_drag"
PICK = "neural_sculpt.pick_stroke"
RESIZE = "neural_sculpt.resize"


def _press(key: str, **modifiers: bool) -> dict[str, object]:
    return {"type": key, "value": "PRESS", **modifiers}


KEYS = (
    (DRAW, _press("LEFTMOUSE"), None),
    (DRAW, _press("LEFTMOUSE", ctrl=True), {"properties": [("invert", True)]}),
    (DRAW, _press("LEFTMOUSE", shift=True), {"properties": [("smooth", True)]}),
    (
        DRAW,
        _press("LEFTMOUSE", ctrl=True, shift=True),
        {"properties": [("invert", True), ("smooth", True)]},
    ),
    (DRAW, _press("P"), {"properties": [("clicks", True)]}),
    (DRAW, _press("P", shift=True), {"properties": [("invert", True), ("clicks", True)]}),
    (PICK, _press("J"), None),
    (NO_DRAG, {"type": "LEFTMOUSE", "value": "CLICK_DRAG", "any": True}, None),
    (RESIZE, _press("F"), {"properties": [("length", "RADIUS")]}),
    (RESIZE, _press("F", shift=True), {"properties": [("length", "INTENSITY")]}),
    (
        RESIZE,
        {**_press("LEFT_BRACKET"), "repeat": True},
        {"properties": [("length", "RADIUS"), ("factor", 0.8)]},
    ),
    (
        RESIZE,
        {**_press("RIGHT_BRACKET"), "repeat": True},
        {"properties": [("length", "RADIUS"), ("factor", 1.25)]},
    ),
    (  # Blender's own, which stands behind the keys of tools
        "gpencil.annotate",
        {**_press("LEFTMOUSE"), "key_modifier": "D"},
        {"properties": [("mode", "DRAW"), ("wait_for_input", False)]},
    ),
)
"""The last one is asked first: Blender turns the keys of an add-on around. The annotation must be
asked before what any press of the mouse does."""


class _NeuralStroke(WorkSpaceTool):
    bl_space_type = "VIEW_3D"
    bl_idname = TOOL
    bl_label = "Neural Stroke"
    bl_description = (
        "Draw strokes on a neural field. Ctrl inverts, Shift smooths, P sets control points, J"
        " chooses the stroke under the mouse; F and Shift F change radius and intensity"
    )
    bl_icon = "ops.curve.draw"
    bl_cursor = "CROSSHAIR"
    bl_keymap = KEYS

    @staticmethod
    def draw_settings(context: Context, layout: UILayout, tool: object) -> None:
        """Draw the brush in the header, and in the sidebar's Tool tab."""
        brush = brush_of(context)
        layout.prop(brush, "kind", text="")
        draw_lengths(layout, brush)
        layout.prop(brush, "profile", text="")
        layout.prop(brush, "modulation", text="")
        layout.prop(brush, "input", text="")
        ob = context.active_object
        if is_field(ob) and context.mode == "OBJECT":  # Sculpt Mode's header has them already
            draw_mirror(layout, ob)


class ObjectTool(_NeuralStroke):
    """The tool in Object Mode."""

    bl_context_mode = "OBJECT"


class SculptTool(_NeuralStroke):
    """The tool in Sculpt Mode."""

    bl_context_mode = "SCULPT"


BRUSH_TOOLS = {"builtin.brush"} if bpy.app.version >= (4, 3, 0) else None
"""Tools of Sculpt Mode after which ours is in sight; earlier Blenders have one for each brush."""


def register() -> None:
    """Put the tool into both toolbars."""
    bpy.utils.register_tool(ObjectTool, separator=True)
    bpy.utils.register_tool(SculptTool, after=BRUSH_TOOLS, separator=True)


def unregister() -> None:
    """Take it out of them, with its keys."""
    bpy.utils.unregister_tool(SculptTool)
    bpy.utils.unregister_tool(ObjectTool)
