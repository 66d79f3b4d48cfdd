# SPDX-License-Identifier: GPL-3.0-or-later
"""Change the brush's radius or intensity: with the mouse on the surface, or by a factor. While the
points of a stroke of the history are edited, it is that stroke's.

While the mouse changes it, the brush stays where it is on the surface and its rim follows the
mouse. Lengths are in model space.
"""

from typing import TYPE_CHECKING

import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import EnumProperty, FloatProperty
from bpy.types import Context, Event, Operator
from bpy_extras import view3d_utils

from ....interaction.recorder import Mouse, Point
from ...locale.translations import OURS
from ...panels import status_bar
from ...scene.brush import lengths
from ...scene.properties import world_scale
from ...viewport import overlay
from ...viewport.view import View, as_point, lay, view_under
from ..job_operator import CANCELLED, FINISHED, Outcome, active_field, field_poll

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import OperatorTypeFlagItems

MOUSE_IS_OURS: "set[OperatorTypeFlagItems]" = {"INTERNAL", "GRAB_CURSOR", "BLOCKING"}


class NEURAL_SCULPT_OT_resize(Operator):
    """Change the radius or the intensity of the brush with the mouse"""

    bl_idname = "neural_sculpt.resize"
    bl_label = "Resize Neural Brush"
    bl_options = MOUSE_IS_OURS

    length: EnumProperty(
        name="Length",
        description="Of the brush, which to change",
        items=[
            ("RADIUS", "Radius", "Half width of the stroke"),
            ("INTENSITY", "Intensity", "Height of the stroke"),
        ],
        translation_context=OURS,
    )
    factor: FloatProperty(
        name="Factor", description="Instead of the mouse", default=1.0, options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field is there to be sculpted."""
        return field_poll(cls, context)

    def execute(self, context: Context) -> Outcome:
        """Change the length by the factor."""
        self._set(context, self._get(context) * self.factor)
        return FINISHED

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Hold the brush where the mouse is, and follow the mouse."""
        if self.properties.is_property_set("factor"):
            return self.execute(context)
        ob = active_field(context)
        mouse = event.mouse_x, event.mouse_y
        view = view_under(context.area, mouse, ob)
        if view is None:
            return CANCELLED
        if (hit := view.hit(mouse)) is None:
            hit = _nearest(view, mouse)
        self._pixels = max(view.pixels(hit[0], 1.0), 1e-6)  # of a unit of model space
        self._first = self._get(context)
        self._mouse_x = event.mouse_x
        overlay.hold_brush(overlay.Anchor(ob.session_uid, *hit))
        context.window_manager.modal_handler_add(self)
        self._show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> Outcome:
        """Follow the mouse until a button or key ends it."""
        if event.type == "MOUSEMOVE":
            moved = (event.mouse_x - self._mouse_x) / self._pixels
            self._set(context, self._first + moved)
            self._show(context)
            return {"PASS_THROUGH"}  # a stroke whose points are edited shows it at once
        elif event.value == "PRESS" and event.type in {"LEFTMOUSE", "RET", "NUMPAD_ENTER"}:
            self.cancel(context)
            return FINISHED
        elif event.value == "PRESS" and event.type in {"RIGHTMOUSE", "ESC"}:
            self._set(context, self._first)
            self.cancel(context)
            return CANCELLED
        return {"RUNNING_MODAL"}

    def cancel(self, context: Context) -> None:
        """Let the brush follow the mouse again."""
        overlay.hold_brush(None)
        status_bar.show_hint(None)
        if context.area is not None:  # it is gone with the window
            context.area.header_text_set(None)
            context.area.tag_redraw()

    def _get(self, context: Context) -> float:
        return lengths.get(context, self.length.lower())

    def _set(self, context: Context, value: float) -> None:
        lengths.put(context, self.length.lower(), value)

    def _show(self, context: Context) -> None:
        meant, value = lengths.meant(context, self.length.lower()), self._get(context)
        if meant == lengths.STRENGTH:  # a share
            word = iface_("Strength", OURS)
        else:
            word, value = iface_(self.length.title()), value * world_scale(active_field(context))
        context.area.header_text_set(f"{word} {value:.4f}")
        status_bar.show_hint(iface_("Click or Enter: keep     Esc: as before"))
        context.area.tag_redraw()


def _nearest(view: View, mouse: Mouse) -> tuple[Point, Point]:
    """Point and normal of the surface where it is nearest to the mouse, which is beside it."""
    matrix = view.ob.matrix_world
    at = mouse[0] - view.region.x, mouse[1] - view.region.y
    depth = matrix.translation
    world = view3d_utils.region_2d_to_location_3d(view.region, view.camera, at, depth)
    places, normals = lay(view.ob, np.array(matrix.inverted_safe() @ world))
    return as_point(places[0].tolist()), as_point(normals[0].tolist())
