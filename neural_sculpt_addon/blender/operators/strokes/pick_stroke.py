# SPDX-License-Identifier: GPL-3.0-or-later
"""Choose a stroke of the history by pointing at the surface."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, Event, Operator

from ....interaction import trace
from ... import redraw
from ...locale.translations import translated
from ...scene import stroke_list
from ...scene.properties import field_of
from ...viewport.view import view_under
from ..job_operator import CANCELLED, FINISHED, INTERNAL, Outcome, active_field, field_poll


class NEURAL_SCULPT_OT_pick_stroke(Operator):
    """Choose in the history the stroke under the mouse"""

    bl_idname = "neural_sculpt.pick_stroke"
    bl_label = "Pick Stroke"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field."""
        return field_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """The last one that covers the place and is not muted."""
        ob, mouse = active_field(context), (event.mouse_x, event.mouse_y)
        view = view_under(context.area, mouse, ob)
        hit = None if view is None else view.cast(mouse)
        heard = [entry for entry in stroke_list.readable(ob) if entry.data and not entry.muted]
        number = None if hit is None else trace.under(hit, [entry.stroke for entry in heard])
        if number is None:
            missed = translated("No stroke of the history lies under the mouse.")
            self.report({"WARNING"}, missed)  # in the status bar: an error would cover the view
            return CANCELLED
        uids = [item.uid for item in field_of(ob).strokes]
        field_of(ob).active_stroke = uids.index(heard[number].uid)
        self.report({"INFO"}, iface_("Chosen: {}").format(heard[number].name))
        redraw.tag_views()
        redraw.tag_panels()
        return FINISHED
