# SPDX-License-Identifier: GPL-3.0-or-later
"""The jobs that wait for the worker, and how each of them ends.

A job that edits an object remembers the object's session_uid and the revision it must find there,
never a Blender reference: when the object is gone or an undo brought another revision, the job is
dropped. If a job fails, but not because of its strokes, these stay in the history, muted. Results
wait in modes whose undo steps would not hold them, such as Edit Mode, and in Dyntopo, whose strokes
undo does not take back beyond a step of ours.

One job may wait *behind* all others. Any job that is asked for cancels it; it shows no progress,
and nobody is told when it fails.

A `Watcher` hears what happens and shows it; the queue knows nothing of windows.
"""

import logging
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy
from bpy.app.translations import pgettext_n as n_

from ...common.errors import SculptError
from ...common.text import Text
from ...stroke.stroke import Stroke
from ..scene import next_proxy, sculpt_steps
from ..scene.mesh import proxy_mesh
from ..scene.properties import field_of, find
from ..scene.sculpt_steps import Step
from ..scene.undo_step import in_partial_mode, in_window
from .caller import Artist, Caller, Script
from .job import Job, JobStatus
from .session_hooks import Arrivals, Watcher
from .undone import Undone

log = logging.getLogger(__name__)

SLOW = 0.5  # seconds after which the status bar tells how far a job is


class JobQueue:
    """Jobs in the order of their coming; the first is the one that the worker has."""

    def __init__(self) -> None:
        """Nothing waits."""
        self.jobs: deque[Job] = deque()
        self.behind: Job | None = None
        """The job that waits for all others to end."""
        self.watcher = Watcher()
        self.arrivals = Arrivals()
        self.undone = Undone()
        self._gone: list[Job] = []  # strokes whose object is gone, until undo brings it back
        self.last_error = ""
        self.caller: Caller = Script() if bpy.app.background else Artist()

    @property
    def rests(self) -> bool:
        """Whether nothing is left to be done: no job and no result waits, except for a result that
        would cut off what can be redone."""
        return (not self.jobs or self.jobs[0].waits) and not self.arrivals.wait()

    def pending(self, target: int | None) -> list[Job]:
        """The jobs on an object that have no result yet."""
        return [job for job in self.jobs if job.target == target and job.pending]

    def newest_change(self) -> Job | None:
        """The job of the last change of a field. None if it has a result, or if Blender's history
        has a step after it."""
        pending = (job for job in reversed(self.jobs) if job.pending)
        changes = (job for job in pending if job.target is not None and not job.follows)
        job = next(changes, None)
        return job if job is not None and job.step == sculpt_steps.active() else None

    def slow_job(self) -> Job | None:
        """The running job, when the artist has waited for it so long that it must show."""
        first = self.jobs[0] if self.jobs else None
        if first is None or first.status is not JobStatus.RUNNING:
            return None
        return first if time.monotonic() - first.begun > SLOW else None

    @contextmanager
    def history_grows(self) -> Iterator[None]:
        """Within this block results make steps of Blender's history. Jobs that wait count as asked
        for after these steps, for what they make comes behind them."""
        before, is_next = sculpt_steps.active(), self.undone.is_next()
        yield
        after = sculpt_steps.active()
        if after == before:
            return
        if is_next:
            self.undone.push_again()
        for job in self.jobs:
            job.step = after

    def move_on(self, before: Step | None, after: Step | None) -> None:
        """Let jobs that were asked for at one step of Blender's history count as asked for at
        another."""
        for job in self.jobs:
            if job.step == before:
                job.step = after

    def firsts(self) -> dict[int, Job]:
        """The first pending job on each object."""
        return {job.target: job for job in reversed(self.jobs) if job.target and job.pending}

    def tell_bases(self) -> None:
        """Tell the first job of each object what it builds on."""
        for target, job in self.firsts().items():
            ob = find(target)
            if not job.base and ob is not None and not self.arrivals.hold(job):
                job.base = field_of(ob).revision

    def tell_waiting(self) -> None:
        """Tell the watcher which strokes have no result yet; none where nobody looks."""
        waiting: dict[int, list[Stroke]] = {}
        for job in self.jobs if self.caller.looks else ():
            if job.target is not None and job.pending and job.strokes:
                waiting.setdefault(job.target, []).extend(job.strokes)
        self.watcher.strokes_wait(waiting)

    def in_other_mode(self, job: Job) -> bool:
        """Whether the artist is in a mode whose undo steps hold no result, or do not bear a step of
        ours among them, on whatever object; the job says so."""
        with in_window():
            objects = bpy.context.active_object, find(job.target or 0)
        if in_partial_mode():
            job.message = n_("Waits until this mode is left")
        elif any(ob is not None and proxy_mesh.in_dyntopo(ob) for ob in objects):
            job.message = n_("Waits until Dyntopo is off")
        else:
            return False
        return True

    def attempt(self, job: Job, step: Callable[[], None]) -> bool:
        """Take a step of a job. If the step fails, so does the job. Whether it succeeded."""
        try:
            self._check_target(job)
            step()
        except SculptError as error:
            self.fail(job, error.text)
            return False
        except Exception:  # a defect: the jobs to come must not suffer for it
            log.exception("%s failed", job.label)
            self.fail(job, Text("{} failed; the system console says why.", job.title))
            return False
        return True

    def _check_target(self, job: Job) -> None:
        if job.target is None:
            return
        ob = find(job.target)
        if ob is None:
            raise SculptError("{} was dropped: the object is gone.", job.title)
        if field_of(ob).revision != job.base:
            raise SculptError("{} was dropped: {} changed in the meantime.", job.title, ob.name)

    def keeps_redo(self, job: Job) -> bool:
        """Whether the result of a job must wait, for the undo step that it becomes would cut off
        what can be redone."""
        if not job.rests or self.undone.has_borders():
            return False
        return bool(sculpt_steps.steps()[1])

    def waits_for_redo(self, job: Job) -> bool:
        """Note whether the result of a job waits for that reason, and return it."""
        job.waits = self.keeps_redo(job)
        if job.waits:
            job.message = n_("Waits, so that redo is kept")
        return job.waits

    def let_come(self) -> None:
        """The artist goes on to work: waiting results may now cut off what can be redone."""
        self.undone.cut_off()
        for job in self.jobs:
            job.rests = job.waits = False

    def queue_again(self, job: Job) -> None:
        """Let a job begin once more."""
        next_proxy.forget()
        job.waits = False
        job.status, job.number, job.fraction, job.message = JobStatus.QUEUED, -1, 0.0, ""
        self.watcher.changed()

    def fail(self, job: Job, why: str) -> None:
        """End a job for a reason that is not the fault of its strokes: these stay in the history,
        muted. If the object is gone, they are sculpted when undo has brought it back.

        In a mode whose undo steps would not hold the strokes, the job ends when that mode is left,
        and while a brush is used when it is put down.
        """
        if job.keep is not None and find(job.target or 0) is not None:
            if self.caller.acts and (self.in_other_mode(job) or self.arrivals.may_come(job)):
                job.status, job.number, job.failure = JobStatus.RUNNING, -1, why
                return
            try:
                job.keep()
                why = Text("{} {} is in the history, muted.", why, job.title)
            except SculptError as error:  # the object cannot be changed at all
                log.warning("%s cannot be kept: %s", job.label, error)
        elif job.keep is not None and self.caller.acts:
            self._gone.append(job)
        self.end(job, JobStatus.FAILED, why)

    def end(self, job: Job, status: JobStatus, message: str) -> None:
        """Take a job out of the queue, and tell so."""
        self.jobs.remove(job)
        job.status, job.message = status, message
        next_proxy.forget()
        self.watcher.ended(job)
        self.tell_waiting()
        if status is JobStatus.FAILED:
            self.last_error = message
            log.warning("%s: %s", job.label, message)
            self.watcher.warned(message)
