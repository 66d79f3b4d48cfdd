# SPDX-License-Identifier: GPL-3.0-or-later
"""Show in the viewport where the last stroke turned the untouched surface most, or where a fit is
farthest from its mesh."""

from bpy.types import Context, Operator

from ... import redraw
from ...session import reports
from ...viewport import worst_place
from ..job_operator import FINISHED, INTERNAL, Outcome, active_field, field_poll, refuse


class NEURAL_SCULPT_OT_show_worst(Operator):
    """Mark where the last stroke turned the normals of the untouched surface most, or where the \
field is farthest from its mesh, and turn the view to it; again to hide the marks"""

    bl_idname = "neural_sculpt.show_worst"
    bl_label = "Show Worst Place"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field of which it is known."""
        if not field_poll(cls, context):
            return False
        if not reports.worst_places(reports.report_of(active_field(context))):
            return refuse(cls, "The last stroke was not measured, or nothing is off")
        return True

    def execute(self, context: Context) -> Outcome:
        """Show it, or hide it."""
        ob = active_field(context)
        places = reports.worst_places(reports.report_of(ob))
        if worst_place.is_shown(ob):
            worst_place.hide()
        else:
            worst_place.show(ob, places)
            if context.space_data is not None and context.space_data.type == "VIEW_3D":
                worst_place.face(ob, places[0], context.space_data.region_3d)
        redraw.tag_views()
        return FINISHED
