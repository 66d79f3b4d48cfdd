# SPDX-License-Identifier: GPL-3.0-or-later
"""How the next stroke is drawn."""

from bpy.types import Context

from ..scene.brush.brush_properties import brush_of
from ..scene.properties import is_field
from .brush_widgets import draw_mirror, draw_radial
from .sidebar import Sidebar


class NEURAL_SCULPT_PT_stroke(Sidebar):
    """How the next stroke is drawn."""

    bl_idname = "NEURAL_SCULPT_PT_stroke"
    bl_label = "Stroke"

    def draw(self, context: Context) -> None:
        """Draw the settings."""
        layout, brush = self.layout, brush_of(context)
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(brush, "input", expand=True)
        column = layout.column()
        if brush.input == "FREEHAND":
            column.prop(brush, "adjust")
            column.prop(brush, "stabilizer")
            column.prop(brush, "spacing")
        layout.prop(brush, "ends", expand=True)
        layout.prop(brush, "direction", expand=True)
        ob = context.active_object
        if is_field(ob):
            draw_mirror(layout, ob)  # pyright: ignore[reportArgumentType]
            draw_radial(layout, context, ob)  # pyright: ignore[reportArgumentType]
        column = layout.column(align=True)
        lines = "neural_sculpt.strokes_from_lines"
        selected = column.operator(lines, text="From Selected Objects", icon="OUTLINER_OB_CURVE")
        selected.source = "SELECTED"
        annotated = column.operator(lines, text="From Annotations", icon="GREASEPENCIL")
        annotated.source = "ANNOTATIONS"
        column.operator("neural_sculpt.strokes_from_file", text="From File…", icon="FILE")
