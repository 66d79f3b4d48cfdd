# SPDX-License-Identifier: GPL-3.0-or-later
"""Stop the worker process and start a new one."""

from bpy.types import Context, Operator

from ...session.worker_session import session
from ..job_operator import FINISHED, INTERNAL, Outcome, reports_errors


class NEURAL_SCULPT_OT_restart_worker(Operator):
    """Stop the worker, cancel its jobs and start it again; the fields stay as they are"""

    bl_idname = "neural_sculpt.restart_worker"
    bl_label = "Restart Worker"
    bl_options = INTERNAL

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Restart."""
        session.restart()
        return FINISHED
