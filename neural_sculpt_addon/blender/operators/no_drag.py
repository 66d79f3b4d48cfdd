# SPDX-License-Identifier: GPL-3.0-or-later
"""A drag of the tool that begins beside all fields. It does nothing, where Blender's own tool would
move objects."""

from bpy.types import Context, Event, Operator

from ..scene.properties import is_field
from .job_operator import CANCELLED, INTERNAL, Outcome, fail


class NEURAL_SCULPT_OT_no_drag(Operator):
    """Leave the object where it is"""

    bl_idname = "neural_sculpt.no_drag"
    bl_label = "No Drag"
    bl_options = INTERNAL

    def invoke(self, context: Context, event: Event) -> Outcome:
        """The stroke missed the surface, or there is none."""
        if is_field(context.active_object):
            return CANCELLED
        return fail(self, "Select a neural field first.")
