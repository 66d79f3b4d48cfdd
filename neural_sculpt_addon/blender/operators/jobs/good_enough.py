# SPDX-License-Identifier: GPL-3.0-or-later
"""End a running fit with the field that it has learned so far."""

from bpy.types import Context, Operator

from ....worker.client import JobKind
from ...session.job import Job, JobStatus
from ...session.worker_session import session
from ..job_operator import FINISHED, INTERNAL, Outcome, refuse


class NEURAL_SCULPT_OT_good_enough(Operator):
    """Stop learning and take the field as it is now"""

    bl_idname = "neural_sculpt.good_enough"
    bl_label = "Good Enough"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A mesh is becoming a field."""
        if running_fit() is not None:
            return True
        return refuse(cls, "No mesh is becoming a field")

    def execute(self, context: Context) -> Outcome:
        """Tell the worker."""
        if (job := running_fit()) is not None:
            session.settle(job)
        return FINISHED


def running_fit() -> Job | None:
    """The fit that the worker is at."""
    running = (job for job in session.jobs if job.status is JobStatus.RUNNING)
    return next((job for job in running if job.kind is JobKind.FIT), None)
