# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's side of the worker: submit jobs, poll for what became of them.

NumPy and the standard library only; all methods belong to one thread and none but `wait` and `stop`
ever blocks. A job that was submitted ends with exactly one result, error or cancelled message,
whatever happens to the worker: when it dies the client answers in its place. Ahead of that come any
progress and previews. The error that ends a job because its worker died has the field `died`: the
job was not at fault, or not known to be.
"""

import math
import time
from collections import deque
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from ..common.errors import Cancelled, SculptError
from ..common.progress import Progress, silent
from ..common.text import Text, from_json
from . import answers, pulse
from .process import Exit, WorkerProcess
from .protocol import FINAL, PROTOCOL, ControlKind, JobKind, Message, MessageKind

__all__ = ["Client", "JobKind", "Message", "MessageKind", "WorkerGoneError", "WorkerState"]

_TICK = 0.005  # seconds between two looks while waiting
READING = 0.004  # seconds that one poll reads a message for, and the array that it is at


class WorkerState(StrEnum):
    """What the client knows of its worker, as of the last poll."""

    STOPPED = "stopped"
    STARTING = "starting"  # the process runs, torch is being imported; jobs may be submitted
    READY = "ready"
    HANGING = "hanging"  # it runs and gives no sign of life; `give_up` ends it, or it goes on
    DEAD = "dead"  # it ended by itself; `problem` says why, `start` begins anew


class WorkerGoneError(SculptError):
    """There is no worker to take a job; it may have ended just now."""


class Client:
    """Owns one worker process at a time."""

    def __init__(self, command: Sequence[str], log: Path) -> None:
        """`command` starts a worker (see environment.worker_command); `log` gets its stderr."""
        self.command = tuple(command)
        self.log = log
        self.state = WorkerState.STOPPED
        self.hello: dict[str, Any] | None = None
        """What the worker said of itself: protocol, torch, device, python; None before it did."""
        self.problem = ""
        """Why the worker died, for the artist; empty while it did not."""
        self.process: WorkerProcess | None = None
        """The worker; None when there is none."""
        self._inbox: deque[Message] = deque()
        self._open: set[int] = set()
        self._last_job = 0

    @property
    def alive(self) -> bool:
        """Whether there is a worker to submit jobs to."""
        return self.process is not None and self.process.running

    @property
    def pid(self) -> int | None:
        """The system's number of the worker process."""
        return None if self.process is None else self.process.pid

    @property
    def folder(self) -> Path | None:
        """The folder of requests and answers of the worker process, see `process`."""
        return None if self.process is None else self.process.folder

    def start(self) -> None:
        """Start the worker, again if it died; one that runs is left alone. Returns at once.

        On Linux the worker dies with the thread that calls this, so call it from one that stays.
        SculptError when the process cannot be started.
        """
        if self.alive:
            return
        self._take_all()  # what one that died since the last poll said before
        self.process = WorkerProcess(self.command, self.log)
        self.state = WorkerState.STARTING
        self.problem = ""

    def stop(self) -> None:
        """End the worker, in mid-job if need be; open jobs end as cancelled. About 2 s at most."""
        self._take_all()
        if self.process is not None:
            self.process.stop()
            self.process = None
        for job in sorted(self._open):
            self._inbox.append(Message(MessageKind.CANCELLED, job))
        self._open.clear()
        self.state = WorkerState.STOPPED
        self.hello = None

    def give_up(self) -> None:
        """End a worker that hangs: its open jobs end as those of one that died."""
        if self.process is not None:
            self._take_all()
            self.process.kill()
            self._bury("it gave no sign of life", "")

    def submit(
        self,
        kind: JobKind,
        fields: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray] | None = None,
    ) -> int:
        """Queue a job and return its number. The arrays are copied.

        WorkerGoneError without a worker, SculptError without room for the job; ProtocolError when
        fields or arrays cannot be sent.
        """
        if self.process is None or not self.alive:
            raise WorkerGoneError("The worker is not running; start it again.")
        job = self._last_job + 1
        self.process.send(Message(kind, job, dict(fields), dict(arrays or {})))
        self._last_job = job
        self._open.add(job)
        return job

    def cancel(self, job: int) -> None:
        """Ask for the end of a job; cancelled follows, or its result if that was faster."""
        if job in self._open and self.process is not None:
            self.process.send(Message(ControlKind.CANCEL, job))

    def settle(self, job: int) -> None:
        """Ask a job for the result that it has by now, or its first one where it waits; jobs that
        have none before their end go on."""
        if job in self._open and self.process is not None:
            self.process.send(Message(ControlKind.ENOUGH, job))

    def poll_once(self) -> list[Message]:
        """All news of jobs since the last call, oldest first; never blocks.

        A large result is read by several calls.
        """
        self._take_all(READING)
        self._feel()
        news = list(self._inbox)
        self._inbox.clear()
        return news

    def wait(
        self, job: int, on_progress: Progress = silent, timeout: float | None = None
    ) -> Message:
        """Block until `job` has ended and return its final message.

        A Cancelled raised by `on_progress` cancels the job; previews are passed over. News of other
        jobs is kept for `poll_once`. TimeoutError after `timeout` seconds, ValueError for a job
        that is not open.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._take_all()
            for message in [message for message in self._inbox if message.job == job]:
                self._inbox.remove(message)
                if message.kind in FINAL:
                    return message
                if message.kind is MessageKind.PREVIEW:
                    continue
                try:
                    on_progress(message.fields["fraction"], message.fields["message"])
                except Cancelled:
                    self.cancel(job)
            if job not in self._open:
                raise ValueError(f"Job {job} is not open.")
            if deadline is not None and time.monotonic() > deadline:
                raise TimeoutError(f"Job {job} has not ended within {timeout} s.")
            if not self._take():
                time.sleep(_TICK)

    def _feel(self) -> None:
        """Find out whether the worker hangs."""
        if self.process is None:
            return
        limit = pulse.SILENT if self.hello else pulse.SILENT_STARTING
        if self.process.silent() > limit:
            self.state = WorkerState.HANGING
        else:
            self.state = WorkerState.READY if self.hello else WorkerState.STARTING

    def _take_all(self, seconds: float = math.inf) -> None:
        while self._take(seconds):
            pass

    def _take(self, seconds: float = math.inf) -> bool:
        """Move one item of news to the inbox; whether there was one that could be read in so many
        seconds."""
        item = None if self.process is None else self.process.take(seconds)
        if item is None:
            return False
        if isinstance(item, Exit):
            self._bury(item.reason, item.log_tail)
        elif problem := answers.why_malformed(item):
            assert self.process is not None
            self.process.stop()
            self._bury(problem, "")
        elif item.kind is MessageKind.HELLO:
            self._greet(item)
        elif item.job in self._open and isinstance(item.kind, MessageKind):
            if "message" in item.fields:
                item.fields["message"] = from_json(item.fields["message"])
            if item.kind in FINAL:
                self._open.discard(item.job)
            self._inbox.append(item)
        return True

    def _greet(self, hello: Message) -> None:
        if hello.fields.get("protocol") == PROTOCOL:
            self.hello = hello.fields
            self.state = WorkerState.READY
        elif self.process is not None:
            self.process.stop()
            self._bury("it belongs to another version of Neural Sculpt", "")

    def _bury(self, reason: str, log_tail: str) -> None:
        """The worker ended by itself: say so, and end its jobs in its place."""
        self.process = None
        self.state = WorkerState.DEAD
        self.hello = None
        self.problem = Text(
            "The worker stopped unexpectedly ({}). Nothing in Blender is lost; see {}.",
            reason,
            self.log,
        )
        fields = {"message": self.problem, "detail": log_tail, "died": True}
        for job in sorted(self._open):
            self._inbox.append(Message(MessageKind.ERROR, job, dict(fields)))
        self._open.clear()
