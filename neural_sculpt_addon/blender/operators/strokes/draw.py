# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw a stroke on the active field: the modal side of drawing.

What the mouse and the keys mean is decided in `drawing`; what is drawn is sculpted as the stroke
operator would.
"""

from dataclasses import replace

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.props import BoolProperty
from bpy.types import Context, Event, Object, Operator

from ....common.errors import SculptError
from ....common.text import Text
from ....interaction.drawing import Drawing, Habits, Nowhere, Phase
from ....interaction.recorder import Mouse
from ....stroke.stroke import Kind, Stroke
from ...locale.translations import translated
from ...panels import status_bar
from ...scene import commit, stroke_list, undo_step
from ...scene.brush import lengths
from ...scene.brush.brush_properties import brush_of
from ...scene.brush.current_brush import drawn_stroke, redrawn_stroke, strengths
from ...scene.mesh import proxy_mesh
from ...scene.mesh.preview import preview
from ...scene.mesh.protect import protected
from ...scene.properties import find, is_field
from ...session import reports
from ...session.absorption import live
from ...session.stroke_jobs import prepare_job
from ...session.worker_session import session
from ...viewport import changed_stroke, overlay
from ...viewport.view import object_under, over_interface, view_under
from ..job_operator import (
    CANCELLED,
    INTERNAL,
    Outcome,
    active_field,
    fail,
    field_poll,
    launch_strokes,
    refuse,
)
from .history import launch_change, uid_property

RUNNING: Outcome = {"RUNNING_MODAL"}
PASS: Outcome = {"PASS_THROUGH"}

HINTS = {
    None: n_("Draw on the field with the left mouse button     Esc: stop"),
    Phase.DRAWING: n_("Release: sculpt the stroke     Esc: cancel"),
    Phase.EDITING: n_(
        "Click: add a point     Drag: move it     Backspace: remove it"
        "     F, Shift F: radius, intensity     Enter: sculpt     Esc: cancel"
    ),
}
NAVIGATION = ("MIDDLEMOUSE", "WHEEL", "TRACKPAD", "MOUSEROTATE", "MOUSESMARTZOOM", "NDOF", "NUMPAD")
BRUSH_KEYS = ("F", "LEFT_BRACKET", "RIGHT_BRACKET")
"""Keys of Blender's and of ours that work while control points are edited."""
POINTS_KEY = "P"


class NEURAL_SCULPT_OT_draw(Operator):
    """Draw a stroke on the active neural field, or edit the points of one"""

    bl_idname = "neural_sculpt.draw"
    bl_label = "Draw Neural Stroke"
    bl_options = INTERNAL

    invert: BoolProperty(
        name="Invert", description="Carve where the brush raises", options={"SKIP_SAVE"}
    )
    clicks: BoolProperty(name="Points", description="Click control points", options={"SKIP_SAVE"})
    smooth: BoolProperty(
        name="Smooth", description="Smooth, whatever the brush does", options={"SKIP_SAVE"}
    )
    uid: uid_property()

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field in a 3D viewport. If it cannot be sculpted now, the press of the mouse tells why:
        a refusal here would pass that press on to Blender's brush."""
        if context.area is None or context.area.type != "VIEW_3D":
            return refuse(cls, "Strokes are drawn in a 3D viewport")
        return field_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Begin at the press of the mouse; called by a button, wait for that press."""
        self._target = active_field(context).session_uid
        self._turned = False  # to another field than the active one
        self._drawing: Drawing | None = None
        self._listed: stroke_list.Entry | None = None
        self._unchanged: Stroke | None = None  # that one through the points that can be edited
        preview.give_up()  # what a defect may have left
        try:
            ob = active_field(context)
            if self.uid:
                self._begin_again(context, ob)
            elif _is_press_of_tool(context, event):
                if missed := self._begin(context, event, ob):
                    return missed
            else:
                proxy_mesh.refuse_locked(ob)
            self._show(context)
        except SculptError as error:
            self.cancel(context)
            return fail(self, error)
        context.window_manager.modal_handler_add(self)
        return RUNNING

    def modal(self, context: Context, event: Event) -> Outcome:
        """Hand the event to the drawing, and sculpt when that is done."""
        ob = find(self._target)
        if ob is None or (event.value == "PRESS" and event.type in {"ESC", "RIGHTMOUSE"}):
            self.cancel(context)
            return CANCELLED
        if event.type.startswith("TIMER"):
            return PASS
        try:
            if self._drawing is None:
                return self._wait(context, event, ob)
            return self._draw_on(self._drawing, context, event, ob)
        except SculptError as error:
            self.cancel(context)
            return fail(self, error)

    def cancel(self, context: Context) -> None:
        """Leave no trace in the window. The press of the mouse came before the measure of the last
        stroke."""
        self._end(context)
        preview.give_up()
        reports.measure_at_rest()

    def _end(self, context: Context) -> None:
        """Leave no trace in the window; the stroke itself stays on the mesh."""
        lengths.edit(None)
        changed_stroke.hide()
        overlay.hide_stroke()
        status_bar.show_hint(None)
        if context.area is not None:  # it is gone with the window
            context.area.tag_redraw()

    def _wait(self, context: Context, event: Event, ob: Object) -> Outcome:
        """Wait for the press on the surface."""
        if event.type != "LEFTMOUSE":
            return PASS
        if event.value != "PRESS":
            return RUNNING if event.value == "CLICK_DRAG" else PASS
        if missed := self._begin(context, event, ob):
            if missed == PASS:
                return PASS
            self.cancel(context)
            return missed
        self._show(context)
        return RUNNING

    def _begin(self, context: Context, event: Event, ob: Object) -> "Outcome | None":
        """Begin at the point of the surface under the mouse; None when it has begun, else the
        outcome.

        A press beside the surface is left to Blender, but in Sculpt Mode, where its brush would
        take it. SculptError when a stroke would lose what other brushes did to the proxy.
        """
        mouse = event.mouse_x, event.mouse_y
        ob = _turn_to(context, mouse, ob)
        self._turned = ob.session_uid != self._target
        self._target = ob.session_uid
        view = view_under(context.area, mouse, ob)
        if view is None or over_interface(context.area, mouse):
            return PASS
        if (hit := view.cast(mouse)) is None:
            return PASS if context.mode == "OBJECT" else CANCELLED
        proxy_mesh.refuse_locked(ob)
        live.refuse_edits(ob)
        settings = brush_of(context)
        habits = Habits(
            spacing=settings.spacing * settings.radius,
            rope=view.pixels(hit, settings.stabilizer * settings.radius),
            clicks=self.clicks or settings.input == "POINTS",
            adjust=settings.adjust,
        )
        if not session.jobs:  # otherwise the field will be another one
            session.submit(prepare_job(ob))
        self._drawing = Drawing(habits, hit, mouse, event.pressure)
        self._drawing.dragging &= event.type.endswith("MOUSE")  # a key holds no point
        return None

    def _begin_again(self, context: Context, ob: Object) -> None:
        """Edit the points of a stroke in the history. SculptError when that cannot be."""
        proxy_mesh.refuse_locked(ob)
        live.refuse_edits(ob)
        self._listed = stroke_list.listed_entry(ob, self.uid)
        stroke = self._listed.stroke
        lengths.edit(stroke)
        spacing = brush_of(context).spacing * stroke.brush.radius
        points = [(x, y, z) for x, y, z in stroke.points.tolist()]
        self._drawing = Drawing.again(Habits(spacing), points, strengths(stroke))
        self._unchanged = self._stroke(self._drawing, context, ob)

    def _draw_on(self, drawing: Drawing, context: Context, event: Event, ob: Object) -> Outcome:
        """Let the drawing go on, and see whether it is over."""
        taken = self._pass_on(drawing, context, event, ob)
        if drawing.phase is Phase.CANCELLED:
            self.cancel(context)
            return CANCELLED
        if drawing.phase is Phase.DONE:
            return self._sculpt(drawing, context, ob)
        self._show(context)
        return RUNNING if taken else PASS

    def _pass_on(self, drawing: Drawing, context: Context, event: Event, ob: Object) -> bool:
        """Tell the drawing what happened; whether nobody else needs to know."""
        mouse = event.mouse_x, event.mouse_y
        editing = drawing.phase is Phase.EDITING
        if editing and not drawing.dragging and _is_for_blender(context, event):
            return False
        view = view_under(context.area, mouse, ob) or Nowhere()
        if event.value == "PRESS" and event.type in {"RET", "NUMPAD_ENTER"}:
            drawing.confirm()
        elif event.value == "PRESS" and _is_removal(event):
            drawing.remove()
        elif event.type in {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE"}:
            drawing.move(view, mouse, event.pressure)
            return not editing or drawing.dragging
        elif event.type == "LEFTMOUSE" and event.value in {"PRESS", "DOUBLE_CLICK"}:
            drawing.press(view, mouse, event.pressure)
        elif event.type == "LEFTMOUSE" and event.value == "RELEASE":
            drawing.release(view, mouse)
        return True

    def _sculpt(self, drawing: Drawing, context: Context, ob: Object) -> Outcome:
        stroke = self._stroke(drawing, context, ob)
        if self._listed is None and not self._only_selects(drawing):
            self._end(context)
            preview.let_go()
            outcome = launch_strokes(self, ob, (stroke,))  # on the mesh it waits for its result
            preview.settle()
            if stroke.left_out:
                count = len(stroke.images) + stroke.left_out
                told = Text(
                    "{} of {} copies, turned about an axis, would leave the box [-1, 1]^3 of the"
                    " field and were left out.",
                    stroke.left_out,
                    count,
                )
                self.report({"WARNING"}, translated(told))
            return outcome
        self.cancel(context)
        if self._listed is None:
            return CANCELLED
        stroke = protected(ob, replace(stroke, mask=None))  # as the artist sees it now
        return launch_change(self, ob, stroke_list.changed, uid=self.uid, stroke=stroke)

    def _only_selects(self, drawing: Drawing) -> bool:
        """Whether the mouse was only clicked, on another field, so far: a click selects that
        field."""
        return self._turned and not drawing.habits.clicks and len(drawing.so_far.points) == 1

    def _stroke(self, drawing: Drawing, context: Context, ob: Object) -> Stroke:
        """The stroke that would be sculpted if the drawing ended now."""
        if self._listed is None:
            kind = Kind.SMOOTH if self.smooth else None
            return drawn_stroke(context, ob, drawing.so_far, self.invert, kind)
        stroke = redrawn_stroke(self._listed.stroke, drawing.line.points)
        return replace(stroke, brush=lengths.edited() or stroke.brush)

    def _show(self, context: Context) -> None:
        """Say what can be done, and show what would be sculpted."""
        drawing, ob = self._drawing, find(self._target)
        status_bar.show_hint(iface_(HINTS[drawing and drawing.phase]))
        if drawing is not None and ob is not None:
            stroke = self._stroke(drawing, context, ob)
            editing, shown = drawing.phase is Phase.EDITING, self._listed is not None
            if not shown and not self._only_selects(drawing):
                shown = preview.draw(ob, stroke)
            overlay.show_stroke(ob, stroke, editing, drawing.chosen, sculpted=shown)
            if self._listed is not None and stroke != self._unchanged:
                changed_stroke.show(ob, self._listed, stroke)
            if context.area is not None:  # the mouse is beside all areas
                context.area.tag_redraw()


def _turn_to(context: Context, mouse: Mouse, ob: Object) -> Object:
    """The field to draw on: in Object Mode another one than `ob` under the mouse becomes active,
    unless an instance of it alone is seen."""
    if context.mode != "OBJECT" or over_interface(context.area, mouse):
        return ob
    other = object_under(context, mouse)
    if other is None or other == ob or not is_field(other) or not other.visible_get():
        return ob
    commit.select(other)
    undo_step.push_undo("Select")
    return other


def _is_press_of_tool(context: Context, event: Event) -> bool:
    """Whether the operator was called by a press in the view, and not by a button or the search."""
    in_view = context.region is not None and context.region.type == "WINDOW"
    of_tool = event.type.endswith("MOUSE") or event.type == POINTS_KEY
    return in_view and event.value == "PRESS" and of_tool


def _is_for_blender(context: Context, event: Event) -> bool:
    """Navigation, the interface, and the keys that change the brush."""
    if event.type in {"RET", "NUMPAD_ENTER"}:
        return False
    return (
        event.type.startswith(NAVIGATION)
        or event.type in BRUSH_KEYS
        or (event.alt and event.type == "LEFTMOUSE")
        or over_interface(context.area, (event.mouse_x, event.mouse_y))
    )


def _is_removal(event: Event) -> bool:
    return event.type in {"BACK_SPACE", "DEL"} or (
        event.type == "Z" and (event.ctrl or event.oskey) and not event.shift
    )
