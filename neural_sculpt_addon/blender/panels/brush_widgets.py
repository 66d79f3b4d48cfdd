# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the brush as panels, dialogs and the tool's header show them."""

from bpy.types import Context, Object, UILayout

from ...stroke.stroke import Kind
from ...stroke.symmetry import AXES
from ..presets import curve_store
from ..scene.brush.brush_properties import NEURAL_SCULPT_PG_brush
from ..scene.brush.current_brush import radial_settings


def draw_lengths(layout: UILayout, brush: NEURAL_SCULPT_PG_brush) -> None:
    """Radius, and intensity or strength; beside each, whether the pen's pressure changes it."""
    second = "scene_intensity" if brush.kind == Kind.DRAW.name else "strength"
    for name, pressure in (("scene_radius", "radius"), (second, "intensity")):
        row = layout.row(align=True)
        row.prop(brush, name)
        row.prop(brush, f"pressure_{pressure}", text="", icon="STYLUS_PRESSURE")


def draw_mirror(layout: UILayout, ob: Object) -> None:
    """The mesh's own symmetry, which strokes follow."""
    row = layout.row(heading="Mirror", align=True)
    for axis in AXES:
        row.prop(ob.data, f"use_mirror_{axis.lower()}", text=axis, toggle=True)


def draw_radial(layout: UILayout, context: Context, ob: Object) -> None:
    """Blender's own radial symmetry, which strokes follow."""
    if (settings := radial_settings(context, ob)) is not None:
        split = layout.split(factor=0.4)
        name, counts = split.row(), split.row(align=True)
        name.alignment, counts.use_property_split = "RIGHT", False
        name.label(text="Radial")
        for index in range(len(AXES)):
            counts.prop(settings, "radial_symmetry", index=index, text="")


def draw_curve(layout: UILayout, word: str) -> None:
    """A curve widget, if its curve exists: drawing a panel must not make one."""
    if (owner := curve_store.owner(word)) is not None:
        layout.template_curve_mapping(owner, curve_store.PROPERTY)
