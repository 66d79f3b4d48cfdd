# SPDX-License-Identifier: GPL-3.0-or-later
"""Stop the worker process, which frees what it holds; the next job starts it again."""

from bpy.types import Context, Operator

from ...session.worker_session import session
from ..job_operator import FINISHED, INTERNAL, Outcome, refuse


class NEURAL_SCULPT_OT_stop_worker(Operator):
    """Stop the worker and cancel its jobs. That frees its memory and the graphics card; the next \
stroke starts it again"""

    bl_idname = "neural_sculpt.stop_worker"
    bl_label = "Stop Worker"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """There is one."""
        if session.client is not None:
            return True
        return refuse(cls, "The worker is not running")

    def execute(self, context: Context) -> Outcome:
        """Stop."""
        session.stop()
        return FINISHED
