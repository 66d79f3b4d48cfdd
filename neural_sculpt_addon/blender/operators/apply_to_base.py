# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the field as it is the one that later replays start from."""

from bpy.types import Context, Operator

from ...stroke.errors import SculptError
from ..commit import apply_to_base
from ..worker_session import session
from .history import listed_poll
from .launch import FINISHED, REGISTER, Outcome, active_field, fail, refuse


class NEURAL_SCULPT_OT_apply_to_base(Operator):
    """Take all strokes that are not muted into the base of the field and off the list"""

    bl_idname = "neural_sculpt.apply_to_base"
    bl_label = "Apply to Base"
    bl_options = REGISTER

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field with strokes that nothing is about to change."""
        if not listed_poll(cls, context):
            return False
        if any(job.target == active_field(context).session_uid for job in session.jobs):
            return refuse(cls, "The worker still changes this field")
        return True

    def execute(self, context: Context) -> Outcome:
        """Replace the base."""
        try:
            apply_to_base(active_field(context), self.bl_label)
        except SculptError as error:
            return fail(self, error)
        return FINISHED
