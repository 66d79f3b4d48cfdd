# SPDX-License-Identifier: GPL-3.0-or-later
"""Show in the viewport where the last stroke turned the untouched surface most."""

# pyright: reportOptionalMemberAccess=false

from bpy.types import Context, Operator

from ..session import reports
from ..viewport import redraw, worst_place
from .launch import FINISHED, INTERNAL, Outcome, active_field, field_poll, refuse


class NEURAL_SCULPT_OT_show_worst(Operator):
    """Mark the place of the untouched surface whose normals the last stroke turned most, and turn \
the view to it; again to hide the mark"""

    bl_idname = "neural_sculpt.show_worst"
    bl_label = "Show Worst Place"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field of which it is known."""
        if not field_poll(cls, context):
            return False
        if reports.worst_place(reports.report_of(active_field(context))) is None:
            return refuse(cls, "The last stroke was not measured, or turned nothing elsewhere")
        return True

    def execute(self, context: Context) -> Outcome:
        """Show it, or hide it."""
        ob = active_field(context)
        place = reports.worst_place(reports.report_of(ob))
        if worst_place.is_shown(ob) or place is None:
            worst_place.hide()
        else:
            worst_place.show(ob, place)
            if context.space_data is not None and context.space_data.type == "VIEW_3D":
                worst_place.face(ob, place, context.space_data.region_3d)
        redraw.tag_views()
        return FINISHED
