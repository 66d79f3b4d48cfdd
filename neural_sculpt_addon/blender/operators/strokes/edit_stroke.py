# SPDX-License-Identifier: GPL-3.0-or-later
"""Change the settings of a stroke that was drawn before; the strokes are replayed with it.

While the dialog is open the surface shows what the stroke would be. Radius and intensity are given
in model space; the dialog shows them in scene units.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import BoolProperty, EnumProperty, IntVectorProperty
from bpy.types import Context, Event, Operator

from ....common.errors import SculptError
from ....stroke.alpha import NATURAL_SPACING, Alpha
from ....stroke.modulation import Modulation
from ....stroke.profile import Profile
from ....stroke.stroke import Direction, Ends, Kind, Stroke
from ....stroke.symmetry import AXES, MOST_TURNS, ONCE
from ...layouts import draw_text
from ...locale.translations import translated
from ...panels.brush_widgets import draw_curve
from ...presets import alpha_choices, curve_store
from ...presets.shape_choices import CURVE, Shape, fixed_items
from ...scene import stroke_list
from ...scene.brush.brush_properties import (
    brush_of,
    direction_property,
    ends_property,
    intensity_property,
    radius_property,
    scene_intensity_property,
    scene_radius_property,
    strength_of_kind_property,
)
from ...scene.brush.current_brush import modulation, profile
from ...scene.mesh.protect import protected
from ...scene.properties import is_field
from ...viewport import changed_stroke
from ..job_operator import REGISTER, Outcome, active_field, fail, reports_errors
from .history import chosen_uid, launch_change, listed_poll, uid_property

KEEP, NOW = "KEEP", "NOW"
SAME_ANGLE = 1e-5  # radians: what a property of Blender's may be off


def _choices(shape: Shape, description: str) -> Any:
    keep = KEEP, "As It Is", f"The {shape.WORD} that the stroke was drawn with"
    return EnumProperty(
        name=shape.WORD.title(), description=description, items=[keep, *fixed_items(shape)]
    )


class NEURAL_SCULPT_OT_edit_stroke(Operator):
    """Change the settings of the stroke, wherever it stands in the list"""

    bl_idname = "neural_sculpt.edit_stroke"
    bl_label = "Edit Stroke"
    bl_options = REGISTER

    uid: uid_property()
    radius: radius_property()
    intensity: intensity_property()
    scene_radius: scene_radius_property()
    scene_intensity: scene_intensity_property()
    strength: strength_of_kind_property(-1.0)
    profile: _choices(Profile, "Cross-section of the stroke")
    modulation: _choices(Modulation, "Strength along the stroke")
    alpha: EnumProperty(
        name="Alpha",
        description="A grey image as relief of the stroke",
        items=[
            (KEEP, "As It Is", "The alpha that the stroke was drawn with, if any"),
            *alpha_choices.fixed_items(),
        ],
    )
    alpha_angle: alpha_choices.angle_property()
    alpha_spacing: alpha_choices.spacing_property()
    ends: ends_property()
    direction: direction_property()
    closed: BoolProperty(name="Closed", description="The end of the stroke joins its start")
    pressure: BoolProperty(
        name="Pen Pressure",
        description="Keep what the pen's pressure made of the stroke",
        default=True,
    )
    mask: EnumProperty(
        name="Mask",
        description="What masks and hidden faces keep the stroke away from",
        items=[
            (KEEP, "As It Was", "What was masked or hidden when the stroke was drawn"),
            (NOW, "As It Is Now", "What is masked or hidden on the proxy now"),
        ],
        options={"SKIP_SAVE"},
    )
    mirror: EnumProperty(
        name="Mirror",
        description="Axes across whose planes the stroke is repeated",
        items=[(axis, axis, f"Across the plane {axis.lower()} = 0") for axis in AXES],
        options={"ENUM_FLAG"},
    )
    radial: IntVectorProperty(
        name="Radial",
        description="How often the stroke is repeated about each axis",
        default=ONCE,
        min=1,
        max=MOST_TURNS,
        subtype="XYZ",
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field with strokes."""
        return listed_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Show the stroke as it is and let the artist change it."""
        self.uid = chosen_uid(self, context)
        try:
            stroke = self._stroke(context)
        except SculptError as error:
            return fail(self, error)
        self.radius = stroke.brush.radius
        if stroke.kind is Kind.DRAW:
            self.intensity = stroke.brush.intensity
        else:
            self.strength = stroke.brush.intensity
        self.profile = stroke.brush.profile.name.upper() or KEEP
        self.modulation = stroke.brush.modulation.name.upper() or KEEP
        self._show_alpha(stroke.brush.alpha)
        self.ends, self.direction = stroke.ends.name, stroke.direction.name
        self.mirror, self.radial = set(stroke.mirror), stroke.radial
        self.closed, self.pressure = stroke.closed, True
        self.check(context)
        title = f"{iface_(self.bl_label)}: {stroke.name:.100}"
        return context.window_manager.invoke_props_dialog(
            self, width=320, title=title, translate=False
        )

    def check(self, context: Context) -> bool:
        """Show the stroke with what the dialog has now; whether the dialog is to be drawn again."""
        try:
            if is_field(context.active_object):
                ob = active_field(context)
                entry = stroke_list.listed_entry(ob, chosen_uid(self, context))
                changed_stroke.show(ob, entry, self._changed(entry.stroke, context))
        except SculptError:  # as the settings are there is none; OK says why
            changed_stroke.hide()
        return True

    def cancel(self, context: Context) -> None:
        """Leave no trace in the window."""
        changed_stroke.hide()

    def draw(self, context: Context) -> None:
        """The settings, with the curve of the brush where that is chosen."""
        layout = self.layout
        layout.use_property_split = True
        try:
            stroke = self._stroke(context)
        except SculptError as error:  # it has left the list while the dialog was open
            draw_text(layout, context, translated(error.text), "ERROR")  # pyright: ignore[reportArgumentType]
            return
        layout.prop(self, "scene_radius")
        draws = stroke.kind is Kind.DRAW
        layout.prop(self, "scene_intensity" if draws else "strength")
        for word in (curve_store.PROFILE, curve_store.MODULATION):
            layout.prop(self, word)
            if getattr(self, word) == CURVE:
                draw_curve(self.layout, word)  # pyright: ignore[reportArgumentType]
        if draws:
            layout.prop(self, "alpha")
            if self.alpha not in (KEEP, alpha_choices.NONE) or stroke.brush.alpha is not None:
                layout.prop(self, "alpha_angle")
                layout.prop(self, "alpha_spacing")
        layout.prop(self, "ends")
        layout.prop(self, "direction")
        layout.row().prop(self, "mirror")
        layout.prop(self, "radial")
        layout.prop(self, "closed")
        layout.prop(self, "pressure")
        layout.prop(self, "mask")

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Replay the strokes with the given settings; all else of the stroke stays as it is."""
        changed_stroke.hide()
        ob, uid = active_field(context), chosen_uid(self, context)
        stroke = self._changed(self._stroke(context), context)
        if self.mask == NOW:
            stroke = protected(ob, replace(stroke, mask=None))
        return launch_change(self, ob, stroke_list.changed, uid=uid, stroke=stroke)

    def _stroke(self, context: Context) -> Stroke:
        return stroke_list.stroke_of(active_field(context), chosen_uid(self, context))

    def _changed(self, stroke: Stroke, context: Context) -> Stroke:
        given = self.properties.is_property_set
        brush = stroke.brush
        second = "intensity" if stroke.kind is Kind.DRAW else "strength"
        for name, length in (("radius", "radius"), (second, "intensity")):
            value = getattr(self, name)
            if given(name) and value != np.float32(getattr(brush, length)):
                brush = replace(brush, **{length: value})
        if self.profile != KEEP:
            brush = replace(brush, profile=profile(self.profile))
        if self.modulation != KEEP:
            brush = replace(brush, modulation=modulation(self.modulation))
        if stroke.kind is Kind.DRAW:
            brush = replace(brush, alpha=self._changed_alpha(brush.alpha, context))
        return replace(
            stroke,
            brush=brush,
            ends=Ends[self.ends] if given("ends") else stroke.ends,
            direction=Direction[self.direction] if given("direction") else stroke.direction,
            mirror=frozenset(self.mirror) if given("mirror") else stroke.mirror,
            radial=tuple(self.radial) if given("radial") else stroke.radial,
            closed=self.closed if given("closed") else stroke.closed,
            radius_factors=stroke.radius_factors if self.pressure else None,
            intensity_factors=stroke.intensity_factors if self.pressure else None,
        )

    def _show_alpha(self, alpha: Alpha | None) -> None:
        """Show the stroke's alpha in the dialog; without one, the settings of a new alpha."""
        self.alpha = alpha_choices.NONE if alpha is None else alpha.name.upper() or KEEP
        self.alpha_angle = 0.0 if alpha is None else math.radians(alpha.angle)
        self.alpha_spacing = NATURAL_SPACING if alpha is None else alpha.spacing

    def _changed_alpha(self, alpha: Alpha | None, context: Context) -> Alpha | None:
        """The alpha with the given settings. An alpha that was chosen anew takes angle and spacing
        of the old one."""
        given = self.properties.is_property_set
        if self.alpha != KEEP and (alpha is None or self.alpha != alpha.name.upper()):
            old = alpha
            pixels = brush_of(context).alpha_pixels
            alpha = alpha_choices.chosen_alpha(self.alpha, pixels)
            if old is not None and alpha is not None:
                alpha = replace(old, name=alpha.name, pixels=alpha.pixels)
        if alpha is None:
            return None
        if given("alpha_angle") and (
            abs(self.alpha_angle - math.radians(alpha.angle)) > SAME_ANGLE
        ):
            alpha = replace(alpha, angle=round(math.degrees(self.alpha_angle), 3))
        if given("alpha_spacing") and self.alpha_spacing != np.float32(alpha.spacing):
            alpha = replace(alpha, spacing=round(self.alpha_spacing, 6))
        return alpha
