# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt a stroke: replay one given as properties, or draw one freehand on the proxy.

All points are in model space, the object's local space. `execute` replays either `stroke_json`,
the text of a stroke file with one or more strokes, or `points` with the scene's brush, which
`radius` and `intensity` override where they are given.
"""

# pyright: reportInvalidTypeForm=false, reportOptionalMemberAccess=false

from dataclasses import replace

import numpy as np
from bpy.props import CollectionProperty, FloatProperty, StringProperty
from bpy.types import Context, Event, Object, Operator, Region, SpaceView3D
from bpy_extras import view3d_utils

from ...stroke.errors import SculptError
from ...stroke.file import parse_strokes
from ...stroke.stroke import Stroke
from ...worker.client import JobKind, Message
from ..brush import current_brush
from ..commit import add_strokes, new_revision
from ..properties import NEURAL_SCULPT_PG_point, brush_of, field_of
from ..recorder import Point, StrokeRecorder
from ..worker_session import Job, Request, find, found, session
from .launch import CANCELLED, REGISTER, Outcome, active_field, editable_poll, fail, launch

SOLVER = "gauss_newton"
SPACING = 0.25
"""Of the control points of a freehand stroke, in radii."""


class NEURAL_SCULPT_OT_stroke(Operator):
    """Draw a stroke on the active neural field"""

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
    )
    name: StringProperty(name="Name", description="Of the stroke", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field whose proxy can be replaced."""
        return editable_poll(cls, context)

    def execute(self, context: Context) -> Outcome:
        """Have the worker edit the field; the proxy follows when it is done."""
        try:
            strokes = self._strokes(context)
        except SculptError as error:
            return fail(self, error)
        return launch(self, edit_job(active_field(context), strokes))

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Replay what is given; otherwise wait for the artist to draw."""
        if self.points or self.stroke_json:
            return self.execute(context)
        if context.area is None or context.area.type != "VIEW_3D":
            return fail(self, "Strokes are drawn in a 3D viewport.")
        ob = active_field(context)
        try:
            session.submit(prepare_job(ob))
        except SculptError as error:
            return fail(self, error)
        self._target = ob.session_uid
        self._recorder: StrokeRecorder | None = None
        context.window.cursor_modal_set("PAINT_CROSS")
        context.workspace.status_text_set("Draw on the field with the left mouse button; Esc: stop")
        context.window_manager.modal_handler_add(self)
        return self.modal(context, event) if event.value == "PRESS" else {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> Outcome:
        """Record while the left mouse button is held; navigation stays free until then."""
        ob = find(self._target)
        if ob is None or event.type in {"ESC", "RIGHTMOUSE"}:
            self.cancel(context)
            return CANCELLED
        drawing = self._recorder is not None
        if event.type == "LEFTMOUSE" and event.value == "PRESS" and not drawing:
            if (hit := _hit(ob, context, event)) is None:
                return {"PASS_THROUGH"}
            self._recorder = StrokeRecorder(SPACING * brush_of(context).radius)
            self._recorder.add(hit, event.pressure)
        elif self._recorder is None:
            return {"PASS_THROUGH"}
        elif event.type in {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE"}:
            if (hit := _hit(ob, context, event)) is not None:
                self._recorder.add(hit, event.pressure)
        elif event.type == "LEFTMOUSE" and event.value == "RELEASE":
            self._recorder.finish(_hit(ob, context, event))
            self._take(self._recorder)
            self.cancel(context)
            return self.execute(context)
        return {"RUNNING_MODAL"}

    def cancel(self, context: Context) -> None:
        """Leave no trace in the window."""
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)

    def _take(self, recorder: StrokeRecorder) -> None:
        for location, pressure in zip(recorder.points, recorder.pressures, strict=True):
            point = self.points.add()
            point.location, point.intensity_factor = location, pressure

    def _strokes(self, context: Context) -> tuple[Stroke, ...]:
        if self.stroke_json:
            strokes = parse_strokes(self.stroke_json)
            if not strokes:
                raise SculptError("The stroke file holds no strokes.")
            return strokes
        brush = current_brush(context)
        for length in ("radius", "intensity"):
            if self.properties.is_property_set(length):
                brush = replace(brush, **{length: getattr(self, length)})
        points = np.array([point.location for point in self.points]).reshape(-1, 3)  # (K, 3)
        radius_factors = np.array([point.radius_factor for point in self.points])  # (K,)
        intensity_factors = np.array([point.intensity_factor for point in self.points])  # (K,)
        return (
            Stroke(
                points,
                brush,
                radius_factors=radius_factors if (radius_factors != 1).any() else None,
                intensity_factors=intensity_factors if (intensity_factors != 1).any() else None,
                name=self.name,
            ),
        )


def prepare_job(ob: Object) -> Job:
    """The job that, while the artist draws, prepares what only the unedited field determines."""
    group = field_of(ob)
    request: Request = (
        {"revision": group.revision},
        {"field": np.frombuffer(group.weights, np.uint8)},
    )
    return Job(JobKind.PREPARE, "Preparing", lambda: request, lambda _: None)


def edit_job(ob: Object, strokes: tuple[Stroke, ...]) -> Job:
    """The job that applies strokes to whatever the object's field is when its turn comes."""
    target, revision = ob.session_uid, new_revision()
    label = strokes[0].name or "Neural Stroke"

    def request() -> Request:
        ob = found(target)
        group = field_of(ob)
        fields = {
            "strokes": [stroke.to_json() for stroke in strokes],
            "solver": SOLVER,
            "resolution": group.resolution,
            "revision": group.revision,
            "result_revision": revision,
        }
        return fields, {"field": np.frombuffer(group.weights, np.uint8)}

    def apply(result: Message) -> None:
        add_strokes(found(target), strokes, result, revision, label)

    return Job(JobKind.EDIT, label, request, apply, target=target)


def _hit(ob: Object, context: Context, event: Event) -> Point | None:
    """The point of the proxy under the mouse, in model space; None when there is none."""
    space = context.area.spaces.active
    assert isinstance(space, SpaceView3D)
    for region in context.area.regions:
        mouse = event.mouse_x - region.x, event.mouse_y - region.y
        if region.type == "WINDOW" and _inside(region, mouse):
            view = space.region_3d
            assert view is not None
            start = view3d_utils.region_2d_to_origin_3d(region, view, mouse)
            direction = view3d_utils.region_2d_to_vector_3d(region, view, mouse)
            to_model = ob.matrix_world.inverted()
            hit, (x, y, z), *_ = ob.ray_cast(to_model @ start, to_model.to_3x3() @ direction)
            return (x, y, z) if hit else None
    return None


def _inside(region: Region, mouse: tuple[int, int]) -> bool:
    return 0 <= mouse[0] < region.width and 0 <= mouse[1] < region.height
