# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush of the next stroke: how wide, how strong and of which shape it is."""

from bpy.types import Context, UILayout

from ...stroke.stroke import Kind
from ..presets import alpha_choices, curve_store
from ..presets.shape_choices import CURVE
from ..scene.brush.brush_properties import NEURAL_SCULPT_PG_brush, brush_of
from .brush_widgets import draw_curve, draw_lengths
from .sidebar import CLOSED_AT_FIRST, Sidebar


class NEURAL_SCULPT_PT_brush(Sidebar):
    """The brush of the next stroke."""

    bl_idname = "NEURAL_SCULPT_PT_brush"
    bl_label = "Brush"

    def draw(self, context: Context) -> None:
        """Draw the sizes and both shapes."""
        layout, brush = self.layout, brush_of(context)
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(brush, "kind")
        draw_lengths(layout, brush)  # pyright: ignore[reportArgumentType]
        draw_shape(layout, brush, curve_store.PROFILE)  # pyright: ignore[reportArgumentType]
        draw_shape(layout, brush, curve_store.MODULATION)  # pyright: ignore[reportArgumentType]
        if brush.kind == Kind.DRAW.name:
            draw_alpha(layout, brush)  # pyright: ignore[reportArgumentType]
        layout.operator("neural_sculpt.draw", text="Draw Stroke", icon="GREASEPENCIL")


class NEURAL_SCULPT_PT_pressure(Sidebar):
    """What the pen's pressure does."""

    bl_idname = "NEURAL_SCULPT_PT_pressure"
    bl_parent_id = "NEURAL_SCULPT_PT_brush"
    bl_label = "Pen Pressure"
    bl_options = CLOSED_AT_FIRST

    def draw(self, context: Context) -> None:
        """Draw the curves."""
        brush = brush_of(context)
        for word in (curve_store.PRESSURE_RADIUS, curve_store.PRESSURE_INTENSITY):
            self.layout.prop(brush, word)
            if getattr(brush, word):
                draw_curve(self.layout, word)  # pyright: ignore[reportArgumentType]


def draw_shape(layout: UILayout, brush: NEURAL_SCULPT_PG_brush, word: str) -> None:
    """The choice of profile or modulation, and its curve."""
    row = layout.row(align=True)
    row.template_icon_view(brush, word, show_labels=True, scale=2.0, scale_popup=4.0)
    column = row.column(align=True)
    column.label(text=word.title())
    buttons = column.row(align=True)
    buttons.prop(brush, word, text="")
    buttons.menu(f"NEURAL_SCULPT_MT_{word}_presets", text="", icon="DOWNARROW_HLT")
    if getattr(brush, word) == CURVE:
        draw_curve(layout, word)


def draw_alpha(layout: UILayout, brush: NEURAL_SCULPT_PG_brush) -> None:
    """The choice of the alpha, and how it lies in the stroke."""
    row = layout.row(align=True)
    row.template_icon_view(brush, "alpha", show_labels=True, scale=2.0, scale_popup=4.0)
    column = row.column(align=True)
    column.label(text="Alpha")
    buttons = column.row(align=True)
    buttons.prop(brush, "alpha", text="")
    buttons.menu("NEURAL_SCULPT_MT_alpha_images", text="", icon="DOWNARROW_HLT")
    if brush.alpha == alpha_choices.NONE:
        return
    if brush.alpha == alpha_choices.IMAGE and not brush.alpha_pixels:
        layout.operator("neural_sculpt.alpha_image", text="Open Image", icon="FILE_FOLDER")
        return
    layout.prop(brush, "alpha_angle")
    layout.prop(brush, "alpha_spacing")
