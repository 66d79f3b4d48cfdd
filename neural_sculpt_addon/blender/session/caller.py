# SPDX-License-Identifier: GPL-3.0-or-later
"""Caller of the session: who asks for its jobs, an artist at a window or a script.

An artist goes on working while a job is done, sees it on its way, and can do what a result has to
wait for, such as leave Edit Mode. A script, such as one that Blender runs without a window, stops
until its job has ended: its results wait for nothing, and nothing is shown to it.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

from ...common.errors import SculptError
from .job import Job, JobStatus

TICK = 0.005
"""Seconds between two polls of a script that waits: the worker gets the processor meanwhile."""


class Caller(ABC):
    """What the session asks of whoever calls it."""

    looks: ClassVar[bool]
    """Whether somebody sees previews, and what is computed when nothing else waits."""
    acts: ClassVar[bool]
    """Whether somebody can leave a mode, redo or restart the worker: what needs that may wait."""

    @abstractmethod
    def await_end(self, job: Job, poll: Callable[[], object]) -> None:
        """Stop until the job has ended, or go on. SculptError when it has ended without success."""


class Artist(Caller):
    """Somebody at a window: the job ends while they work."""

    looks = True
    acts = True

    def await_end(self, job: Job, poll: Callable[[], object]) -> None:
        """Go on."""


class Script(Caller):
    """A script, which needs what the job makes."""

    looks = False
    acts = False

    def await_end(self, job: Job, poll: Callable[[], object]) -> None:
        """Poll the session until the job has ended. SculptError when it did not succeed."""
        while job.pending:
            poll()
            time.sleep(TICK)
        if job.status is not JobStatus.DONE:
            raise SculptError(job.message)
