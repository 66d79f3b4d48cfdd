# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt along lines that were drawn with Blender's own tools."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from bpy.props import EnumProperty, FloatProperty
from bpy.types import Context, Object, Operator
from mathutils import Vector

from ....common.errors import SculptError
from ....stroke.stroke import MOST_POINTS, Stroke
from ...locale.translations import OURS
from ...scene.brush.brush_properties import brush_of
from ...scene.brush.current_brush import brush_stroke, pressure_factors
from ...scene.lines import Line, annotation_lines, selected_lines
from ...scene.properties import world_scale
from ...session.absorption import live
from ..job_operator import (
    REGISTER,
    Outcome,
    active_field,
    editable_poll,
    launch_strokes,
    reports_errors,
)

SELECTED, ANNOTATIONS = "SELECTED", "ANNOTATIONS"


class NEURAL_SCULPT_OT_strokes_from_lines(Operator):
    """Sculpt strokes along grease pencil, annotations, curves or hair near the active field. \
Their thickness acts as the pen's pressure"""

    bl_idname = "neural_sculpt.strokes_from_lines"
    bl_label = "Strokes from Lines"
    bl_options = REGISTER

    source: EnumProperty(
        name="Source",
        description="Where the lines are",
        items=[
            (
                SELECTED,
                "Selected Objects",
                "Grease pencil, curves and hair curves; only their selected lines where some are",
            ),
            (ANNOTATIONS, "Annotations", "Those of the scene"),
        ],
        translation_context=OURS,
    )
    distance: FloatProperty(
        name="Distance",
        description="How far from the surface a line may be; what is farther away is left out",
        default=0.5,
        min=0.0,
        subtype="DISTANCE",
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field whose proxy can be replaced."""
        return editable_poll(cls, context)

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Project the lines on the field and have the worker sculpt them, as one step."""
        ob = active_field(context)
        if not ob.visible_get():  # Blender has not evaluated it
            raise SculptError("{} is hidden. Show it to sculpt along lines.", ob.name)
        annotated = self.source == ANNOTATIONS
        lines = annotation_lines(context) if annotated else selected_lines(context)
        if not lines and annotated:
            raise SculptError(
                "There are no annotations on this frame. Draw some on the field first."
            )
        if not lines:
            raise SculptError(
                "No grease pencil, curve or hair is selected. Select some beside the field."
            )
        spacing = brush_of(context).spacing * brush_of(context).radius * world_scale(ob)
        live.refuse_edits(ob)
        strokes = tuple(
            _stroke(context, ob, part)
            for line in lines
            for part in _projected(context, ob, _thinned(line, spacing), self.distance)
        )
        if not strokes:
            raise SculptError("The lines are too far from the field. Raise the distance.")
        return launch_strokes(self, ob, strokes)

    def draw(self, context: Context) -> None:
        """Draw both settings."""
        self.layout.use_property_split = True
        self.layout.prop(self, "source")
        self.layout.prop(self, "distance")


def _projected(context: Context, ob: Object, line: Line, distance: float) -> Iterator[Line]:
    """The parts of a line that lie near the proxy, on it and in model space."""
    to_model = ob.matrix_world.inverted_safe()
    shown = ob.evaluated_get(context.evaluated_depsgraph_get())
    points = np.full((len(line.points), 3), np.nan)
    for index, point in enumerate(line.points.tolist()):
        found, place, *_ = shown.closest_point_on_mesh(to_model @ Vector(point))
        if found and (ob.matrix_world @ place - Vector(point)).length <= distance:
            points[index] = place
    near = np.isfinite(points[:, 0])
    for part in np.split(np.arange(len(points)), np.flatnonzero(np.diff(near)) + 1):
        if near[part[0]]:
            whole = len(part) == len(points)
            part_of_line = replace(line, points=points, closed=line.closed and whole)
            yield part_of_line.at(part)


def _stroke(context: Context, ob: Object, line: Line) -> Stroke:
    """The stroke of a line on the surface, drawn with the brush."""
    pressures = line.thickness.tolist()
    return replace(
        brush_stroke(context, ob, line.points),
        closed=line.closed,
        radius_factors=pressure_factors(context, "radius", pressures),
        intensity_factors=pressure_factors(context, "intensity", pressures),
        name=line.name,
    )


def _thinned(line: Line, spacing: float) -> Line:
    """The line through its ends and one point after each `spacing`."""
    kept = [0]
    for index in range(1, len(line.points)):
        if np.linalg.norm(line.points[index] - line.points[kept[-1]]) >= spacing:
            kept.append(index)
    if kept[-1] != len(line.points) - 1:
        kept.append(len(line.points) - 1)
    return line.at(kept) if len(kept) <= MOST_POINTS else _thinned(line, 2 * spacing)
