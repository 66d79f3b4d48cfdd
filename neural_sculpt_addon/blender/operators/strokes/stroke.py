# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt a stroke given as properties, as scripts do; `draw` is for the artist's hand.

All points are in model space, the object's local space. What is sculpted is either `stroke_json`,
the text of a stroke file with one or more strokes, or `points` with the scene's brush, which
`radius` and `intensity` override where they are given.
"""

from dataclasses import replace

import numpy as np
from bpy.props import CollectionProperty, FloatProperty, StringProperty
from bpy.types import Context, Operator

from ....common.errors import SculptError
from ....stroke.file import parse_strokes
from ....stroke.stroke import Stroke
from ...locale.translations import OURS
from ...scene.brush.brush_properties import NEURAL_SCULPT_PG_point
from ...scene.brush.current_brush import brush_stroke
from ...session.absorption import live
from ..job_operator import (
    REGISTER,
    Outcome,
    active_field,
    editable_poll,
    launch_strokes,
    reports_errors,
)


class NEURAL_SCULPT_OT_stroke(Operator):
    """Sculpt strokes that are given as points or as the text of a stroke file"""

    bl_idname = "neural_sculpt.stroke"
    bl_label = "Neural Stroke"
    bl_options = REGISTER

    points: CollectionProperty(type=NEURAL_SCULPT_PG_point, options={"HIDDEN", "SKIP_SAVE"})
    stroke_json: StringProperty(
        name="Strokes",
        description="Text of a stroke file, instead of points",
        options={"HIDDEN", "SKIP_SAVE"},
    )
    radius: FloatProperty(
        name="Radius",
        description="Instead of the brush's, in model space",
        min=0.001,
        max=1.0,
        options={"SKIP_SAVE"},
    )
    intensity: FloatProperty(
        name="Intensity",
        description="Instead of the brush's, in model space",
        min=-1.0,
        max=1.0,
        options={"SKIP_SAVE"},
        translation_context=OURS,
    )
    name: StringProperty(name="Name", description="Of the stroke", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field whose proxy can be replaced."""
        return editable_poll(cls, context)

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Have the worker edit the field; the proxy follows when it is done."""
        ob = active_field(context)
        live.refuse_edits(ob)
        return launch_strokes(self, ob, self._strokes(context))

    def _strokes(self, context: Context) -> tuple[Stroke, ...]:
        if self.stroke_json:
            strokes = parse_strokes(self.stroke_json)
            if not strokes:
                raise SculptError("The stroke file holds no strokes.")
            return strokes
        if not self.points:
            raise SculptError("There is nothing to sculpt. Give points or a stroke file.")
        points = [point.location for point in self.points]
        stroke = brush_stroke(context, active_field(context), points)
        for length in ("radius", "intensity"):
            if self.properties.is_property_set(length):
                brush = replace(stroke.brush, **{length: getattr(self, length)})
                stroke = replace(stroke, brush=brush)
        radius_factors = np.array([point.radius_factor for point in self.points])  # (K,)
        intensity_factors = np.array([point.intensity_factor for point in self.points])  # (K,)
        return (
            replace(
                stroke,
                radius_factors=radius_factors if (radius_factors != 1).any() else None,
                intensity_factors=intensity_factors if (intensity_factors != 1).any() else None,
                name=self.name or stroke.name,
            ),
        )
