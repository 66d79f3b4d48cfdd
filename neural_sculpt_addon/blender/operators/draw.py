# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw a stroke on the active field: the modal side of drawing.

What the mouse and the keys mean is decided in `drawing`; what is drawn is sculpted as the stroke
operator would. A press beside the surface is left to Blender.
"""

# pyright: reportInvalidTypeForm=false, reportOptionalMemberAccess=false

from bpy.props import BoolProperty
from bpy.types import Context, Event, Object, Operator

from ...stroke.errors import SculptError
from .. import overlay
from ..brush import drawn_stroke
from ..drawing import Drawing, Habits, Nowhere, Phase
from ..properties import brush_of
from ..stroke_jobs import edit_job, prepare_job
from ..view import over_interface, view_under
from ..worker_session import find, session
from .launch import CANCELLED, INTERNAL, Outcome, active_field, editable_poll, fail, launch

RUNNING: Outcome = {"RUNNING_MODAL"}
PASS: Outcome = {"PASS_THROUGH"}

HINTS = {
    None: "Draw on the field with the left mouse button     Esc: stop",
    Phase.DRAWING: "Release: sculpt the stroke     Esc: cancel",
    Phase.EDITING: (
        "Click: add a point     Drag: move it     Backspace: remove it"
        "     Enter: sculpt     Esc: cancel"
    ),
}
NAVIGATION = ("MIDDLEMOUSE", "WHEEL", "TRACKPAD", "MOUSEROTATE", "MOUSESMARTZOOM", "NDOF", "NUMPAD")
BRUSH_KEYS = ("F", "LEFT_BRACKET", "RIGHT_BRACKET")
"""Keys of Blender's and of ours that work while control points are edited."""


class NEURAL_SCULPT_OT_draw(Operator):
    """Draw a stroke on the active neural field"""

    bl_idname = "neural_sculpt.draw"
    bl_label = "Draw Neural Stroke"
    bl_options = INTERNAL

    invert: BoolProperty(
        name="Invert", description="Carve where the brush raises", options={"SKIP_SAVE"}
    )
    clicks: BoolProperty(name="Points", description="Click control points", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field whose proxy can be replaced, in a 3D viewport."""
        if context.area is None or context.area.type != "VIEW_3D":
            cls.poll_message_set("Strokes are drawn in a 3D viewport")
            return False
        return editable_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Begin where the tool was pressed; from a button, wait for the press."""
        self._target = active_field(context).session_uid
        self._drawing: Drawing | None = None
        try:
            if _is_press_of_tool(context, event) and not self._begin(context, event):
                return PASS
        except SculptError as error:
            return fail(self, error)
        context.window_manager.modal_handler_add(self)
        self._show(context)
        return RUNNING

    def modal(self, context: Context, event: Event) -> Outcome:
        """Hand the event to the drawing, and sculpt when that is done."""
        drawing, ob = self._drawing, find(self._target)
        pressed = event.value == "PRESS"
        try:
            if ob is None or (pressed and event.type in {"ESC", "RIGHTMOUSE"}):
                self.cancel(context)
                return CANCELLED
            if drawing is None:
                if event.type != "LEFTMOUSE" or not pressed or not self._begin(context, event):
                    return PASS
                taken = True
            else:
                taken = self._pass_on(drawing, context, event, ob)
            if self._drawing.phase is Phase.CANCELLED:
                self.cancel(context)
                return CANCELLED
            if self._drawing.phase is Phase.DONE:
                return self._sculpt(context, ob)
            self._show(context)
        except SculptError as error:
            self.cancel(context)
            return fail(self, error)
        return RUNNING if taken else PASS

    def cancel(self, context: Context) -> None:
        """Leave no trace in the window."""
        overlay.hide_stroke()
        context.workspace.status_text_set(None)
        context.area.tag_redraw()

    def _begin(self, context: Context, event: Event) -> bool:
        """Start at the point under the mouse, if there is one."""
        ob = active_field(context)
        mouse = event.mouse_x, event.mouse_y
        view = view_under(context.area, mouse, ob)
        if view is None or over_interface(context.area, mouse) or (hit := view.cast(mouse)) is None:
            return False
        settings = brush_of(context)
        habits = Habits(
            spacing=settings.spacing * settings.radius,
            rope=view.pixels(hit, settings.stabilizer * settings.radius),
            clicks=self.clicks or settings.input == "POINTS",
            adjust=settings.adjust,
        )
        session.submit(prepare_job(ob))
        self._drawing = Drawing(habits, hit, mouse, event.pressure)
        return True

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
        return not event.type.startswith("TIMER")

    def _sculpt(self, context: Context, ob: Object) -> Outcome:
        stroke = drawn_stroke(context, ob, self._drawing.line, self.invert)
        self.cancel(context)
        return launch(self, edit_job(ob, (stroke,)))

    def _show(self, context: Context) -> None:
        """Say what can be done, and show what would be sculpted."""
        drawing, ob = self._drawing, find(self._target)
        context.workspace.status_text_set(HINTS[drawing and drawing.phase])
        if drawing is not None and ob is not None:
            stroke = drawn_stroke(context, ob, drawing.line, self.invert)
            overlay.show_stroke(ob, stroke, drawing.phase is Phase.EDITING, drawing.chosen)
            context.area.tag_redraw()


def _is_press_of_tool(context: Context, event: Event) -> bool:
    """Whether it all began in the view; otherwise a button or the search did."""
    in_view = context.region is not None and context.region.type == "WINDOW"
    return in_view and event.value == "PRESS" and event.type.endswith("MOUSE")


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
