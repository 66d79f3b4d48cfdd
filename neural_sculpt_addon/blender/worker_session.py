# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's one worker and the jobs that wait for it.

Jobs run one at a time in the order of their coming. A job makes its request only when its turn
comes, so a stroke drawn while the last one is still computed works on the last one's result. A job
that edits an object remembers the object's session_uid and the revision it must find there, never
a Blender reference: when the object is gone or an undo brought another revision, the result is
dropped.

In a window a timer calls `poll_once`; timers never run in the background, where operators wait.
"""

import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import bpy
import numpy as np
from bpy.types import Object

from ..stroke.errors import SculptError
from ..worker import environment
from ..worker.client import Client, JobKind, Message, MessageKind, WorkerState
from ..worker.protocol import FINAL
from . import preferences, redraw
from .properties import field_of

log = logging.getLogger(__name__)

TICK = 0.02  # seconds between two polls in a window

Request = tuple[dict[str, Any], dict[str, np.ndarray]]
"""Fields and arrays of a job, as the worker's protocol names them."""


class JobStatus(StrEnum):
    """Where a job is between its submission and its end."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(eq=False)
class Job:
    """One request to the worker and what to do with its result.

    label:   what the artist reads beside the progress bar
    request: makes fields and arrays when the job's turn comes
    apply:   takes the result on the main thread; raises SculptError when it cannot
    target:  session_uid of the object that the job edits, None when it edits none
    base:    revision that the target must have; set when the job is first of those on its target
    """

    kind: JobKind
    label: str
    request: Callable[[], Request]
    apply: Callable[[Message], None]
    target: int | None = None
    base: str = ""
    status: JobStatus = JobStatus.QUEUED
    fraction: float = 0.0
    message: str = ""
    number: int = field(default=-1, repr=False)

    @property
    def pending(self) -> bool:
        """Whether the job has not ended yet."""
        return self.status in (JobStatus.QUEUED, JobStatus.RUNNING)


def find(target: int) -> Object | None:
    """The object with this session_uid, which survives undo; None when it is gone."""
    return next((ob for ob in bpy.data.objects if ob.session_uid == target), None)


def found(target: int) -> Object:
    """The object of a job whose turn it is; the session has made sure that it is there."""
    ob = find(target)
    assert ob is not None
    return ob


class Session:
    """Owns the client, starts the worker when it is first needed, and feeds it jobs."""

    def __init__(self) -> None:
        """No worker is started yet."""
        self.jobs: deque[Job] = deque()
        self.client: Client | None = None
        self.last_error = ""
        self.waits = bpy.app.background
        """Whether operators wait for their jobs."""
        self._in_flight: int | None = None  # what the worker has not ended yet, cancelled or not

    def submit(self, job: Job) -> None:
        """Queue a job. SculptError when there is no worker to run it."""
        self._ensure_worker()
        self.last_error = ""
        self.jobs.append(job)
        self._advance()
        self._watch()

    def wait(self, job: Job) -> None:
        """Poll until the job has ended; SculptError when it did not succeed."""
        while job.pending:
            self.poll_once()
            time.sleep(0.005)
        if job.status is not JobStatus.DONE:
            raise SculptError(job.message)

    def cancel(self, target: int | None = None, why: str = "Cancelled.") -> None:
        """Cancel all jobs, or all on one target; what the worker still sends of them is ignored."""
        for job in [job for job in self.jobs if target is None or job.target == target]:
            if job.status is JobStatus.RUNNING and self.client is not None:
                self.client.cancel(job.number)
            self._end(job, JobStatus.CANCELLED, why)

    def follow_history(self) -> None:
        """Cancel the jobs whose object or base revision an undo or redo took away."""
        for target in {job.target for job in self.jobs if job.target is not None}:
            first = next(job for job in self.jobs if job.target == target)
            ob = find(target)
            if ob is None or field_of(ob).revision != first.base:
                self.cancel(target, f"{first.label} was cancelled: its field was undone.")

    def poll_once(self) -> None:
        """Take what the worker sent. Never blocks, but for the time a result takes to apply."""
        self._read_news()
        self._advance()

    def restart(self) -> None:
        """Stop the worker, whatever it does, and start a new one. Queued jobs are cancelled."""
        self.stop()
        self._ensure_worker()
        self._watch()

    def stop(self) -> None:
        """Cancel everything and end the worker process."""
        for job in [*self.jobs]:
            self._end(job, JobStatus.CANCELLED, "The worker was stopped.")
        if self.client is not None:
            self.client.stop()
            self.client = self._in_flight = None
        if bpy.app.timers.is_registered(self._tick):
            bpy.app.timers.unregister(self._tick)

    def describe_worker(self) -> str:
        """The worker's state for the panel."""
        if self.client is None:
            return "Not started"
        if self.client.state is WorkerState.READY and self.client.hello:
            return f"Ready on {self.client.hello['device'].upper()}"
        return self.client.state.value.capitalize()

    def _ensure_worker(self) -> None:
        if self.client is not None:
            if self.client.alive:
                return
            self.client.stop()  # gives every open job its end
            self._read_news()
        command = environment.worker_command(preferences.worker_python())
        client = Client(command, preferences.user_folder() / "worker.log")
        client.start()
        self.client = client

    def _read_news(self) -> None:
        for message in self.client.poll_once() if self.client is not None else ():
            if message.job == self._in_flight and message.kind in FINAL:
                self._in_flight = None
            if self.jobs and message.job == self.jobs[0].number:
                self._take(self.jobs[0], message)

    def _advance(self) -> None:
        """Let the first job begin, and tell the first of each target what it builds on."""
        seen = set()
        for job in [*self.jobs]:
            if job.target is None or job.target in seen:
                continue
            seen.add(job.target)
            ob = find(job.target)
            if not job.base and ob is not None:
                job.base = field_of(ob).revision
        while self.jobs and self._in_flight is None:
            self._start(self.jobs[0])

    def _start(self, job: Job) -> None:
        try:
            self._check_target(job)
            self._ensure_worker()
            assert self.client is not None
            fields, arrays = job.request()
            job.number = self._in_flight = self.client.submit(job.kind, fields, arrays)
            job.status = JobStatus.RUNNING
        except SculptError as error:
            self._end(job, JobStatus.FAILED, str(error))

    def _take(self, job: Job, message: Message) -> None:
        if message.kind is MessageKind.PROGRESS:
            job.fraction = message.fields["fraction"]
            job.message = message.fields["message"]
        elif message.kind is MessageKind.CANCELLED:
            self._end(job, JobStatus.CANCELLED, "Cancelled.")
        elif message.kind is MessageKind.ERROR:
            self._end(job, JobStatus.FAILED, message.fields["message"])
        elif message.kind is MessageKind.RESULT:
            status, text = JobStatus.FAILED, f"{job.label} failed; the system console says why."
            try:
                self._check_target(job)
                job.apply(message)
                status, text = JobStatus.DONE, ""
            except SculptError as error:
                text = str(error)
            finally:
                self._end(job, status, text)

    def _check_target(self, job: Job) -> None:
        if job.target is None:
            return
        ob = find(job.target)
        if ob is None:
            raise SculptError(f"{job.label} was dropped: the object is gone.")
        if field_of(ob).revision != job.base:
            raise SculptError(f"{job.label} was dropped: {ob.name} changed in the meantime.")

    def _end(self, job: Job, status: JobStatus, message: str) -> None:
        self.jobs.remove(job)
        job.status, job.message = status, message
        if status is JobStatus.FAILED:
            self.last_error = message
            log.warning("%s: %s", job.label, message)

    def _watch(self) -> None:
        if not bpy.app.background and not bpy.app.timers.is_registered(self._tick):
            bpy.app.timers.register(self._tick, persistent=True)

    def _tick(self) -> float | None:
        self.poll_once()
        redraw.tag_panels()
        starting = self.client is not None and self.client.state is WorkerState.STARTING
        return TICK if self.jobs or starting else None


session = Session()
"""The only one."""
