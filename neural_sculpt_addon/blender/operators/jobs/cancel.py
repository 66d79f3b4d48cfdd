# SPDX-License-Identifier: GPL-3.0-or-later
"""Cancel what the worker does and what waits for it."""

from bpy.types import Context, Operator

from ...session.worker_session import session
from ..job_operator import FINISHED, INTERNAL, Outcome, refuse


class NEURAL_SCULPT_OT_cancel(Operator):
    """Cancel the running job and all that wait for it; the fields stay as they are"""

    bl_idname = "neural_sculpt.cancel"
    bl_label = "Cancel"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """There is something to cancel."""
        if session.jobs:
            return True
        return refuse(cls, "The worker is idle")

    def execute(self, context: Context) -> Outcome:
        """Cancel all jobs."""
        session.cancel()
        return FINISHED
