# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages of the worker: whether one can be taken now, and what it does to its job.

A result waits while a brush is down, in modes whose undo steps would not hold it, after undo as
long as it would cut off what can be redone, and until its attributes and previews are prepared,
some milliseconds in each poll. It is dropped if a brush was used since the job began: the job is
done again after the brush's stroke.
"""

import logging
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from ...common.errors import SculptError
from ...common.text import Text
from ...worker import answers
from ...worker.client import JobKind, Message, MessageKind
from ...worker.protocol import ProtocolError
from ..scene import next_proxy, sculpt_steps
from ..scene.properties import field_of, find
from .job import Job, JobStatus
from .job_queue import JobQueue
from .worker_process import Worker

log = logging.getLogger(__name__)

LONG = 0.004
"""Seconds. When reading a message, or its check, took longer, Blender hears the artist before the
message is taken, which takes up to 12 ms: to read a mesh of 100,000 triangles takes 1 to 3. It
always does ahead of a mesh that no object has yet, for none of its work is done in pieces: to add
an object of 300,000 triangles takes 15."""


class WorkerNews(JobQueue):
    """Hears the worker's messages, and does to the jobs what they say."""

    def __init__(self) -> None:
        """No worker is started yet."""
        super().__init__()
        self.worker = Worker()
        self._checked: Message | None = None  # the last one that was found to be sound

    def _must_wait(self, message: Message) -> bool:
        """Whether a message cannot be taken yet: its result, or the preview on it, is still to be
        prepared, or the artist has to leave a mode."""
        if not self.caller.acts or not self.jobs or message.job != self.jobs[0].number:
            return False
        job, begun = self.jobs[0], time.perf_counter()
        is_new_mesh = message is not self._checked and job.target is None and message.arrays
        try:
            self._check(job, message)
        except ProtocolError:
            return False  # it is met again when the message is heard
        if is_new_mesh or time.perf_counter() - begun > LONG or self._prepare(job, message):
            return True
        if message.kind is not MessageKind.RESULT:
            return False
        if self.arrivals.may_come(job):
            return True
        return not self.arrivals.hold(job) and (
            self.in_other_mode(job) or self.waits_for_redo(job) or self._foresee(job, message)
        )

    def _check(self, job: Job, message: Message) -> None:
        """ProtocolError unless the message can be one of the job; each is looked through once."""
        if message is not self._checked:
            answers.check(job.kind, message)
            self._checked = message

    def _foresee(self, job: Job, message: Message) -> bool:
        """Work at the proxy that the result brings; whether there is more to do. For a brush's
        stroke that would be in vain: the present one is another when it reaches the scene."""
        if job.foresee is not None:
            return job.foresee(message)
        ob = None if job.target is None else find(job.target)
        if ob is None or "vertices" not in message.arrays or job.kind is JobKind.ABSORB_STROKE:
            return False
        return next_proxy.prepare(ob, message, field_of(ob).smooth)

    def _prepare(self, job: Job, message: Message) -> bool:
        others = (other for other in self.pending(job.target) if other is not job)
        waiting = [stroke for other in others for stroke in other.strokes]
        if not waiting or job.target is None or "vertices" not in message.arrays:
            return False
        return self.watcher.prepare(job.target, message, waiting)

    def hear(self, message: Message) -> None:
        """Take a message, of the first job or the one behind all. Messages of jobs that have ended
        are ignored."""
        if self.behind is not None and message.job == self.behind.number:
            self._hear_behind(self.behind, message)
        if not self.jobs or message.job != self.jobs[0].number:
            return
        job = self.jobs[0]
        try:
            self._check(job, message)
        except ProtocolError as error:
            self._lose(job, Text("The worker answered nonsense: {}", error))
            return
        finally:
            self._checked = None
        if message.kind is MessageKind.PROGRESS:
            job.fraction = message.fields["fraction"]
            job.message = message.fields["message"]
        elif message.kind is MessageKind.PREVIEW:
            if job.preview and not self.attempt(job, partial(job.preview, message)):
                self._silence(job)
        elif message.kind is MessageKind.CANCELLED:
            self.end(job, JobStatus.CANCELLED, "Cancelled.")
        elif message.kind is MessageKind.ERROR:
            self._hear_error(job, message.fields)
        else:
            self._hear_result(job, message)

    def _hear_result(self, job: Job, message: Message) -> None:
        """Apply a result, or drop it when a brush was used meanwhile, whose stroke comes first."""
        self.worker.keep(message)
        if self.arrivals.hold(job):
            self.queue_again(job)
            job.base, step = "", sculpt_steps.active()
            for other in self.pending(job.target):
                if not other.follows:  # they come after the brush's stroke, too
                    other.step = step
            return
        with self.history_grows():
            if self.attempt(job, partial(job.apply, message)):
                self.end(job, JobStatus.DONE, "")
                self.arrivals.follow(job)
            else:
                self._silence(job)

    def _hear_error(self, job: Job, fields: dict[str, Any]) -> None:
        text = fields["message"]
        if fields.get("missing") and not job.resent:
            log.info("%s is sent again, for the worker lacks bytes", job.label)
            self.worker.forget()
            job.resent = True
            self.queue_again(job)
        elif fields.get("died"):
            self._lose(job, text)
        elif fields["detail"]:  # a defect, or no memory
            self.fail(job, text)
        else:  # what was asked for cannot be
            self.end(job, JobStatus.FAILED, text)

    def _hear_behind(self, job: Job, message: Message) -> None:
        """Hear a message of the job behind the others, which nobody waits for."""
        if message.kind is MessageKind.RESULT:
            self.behind = None
            self._try_behind(job, partial(self._apply_behind, job, message))
        elif message.kind in {MessageKind.ERROR, MessageKind.CANCELLED}:
            log.info("%s: %s", job.label, message.fields.get("message", message.kind))
            self.behind = None
            if job.told_why is not None and message.kind is MessageKind.ERROR:
                job.told_why(message.fields["message"])

    def _apply_behind(self, job: Job, message: Message) -> None:
        answers.check(job.kind, message)
        job.apply(message)

    def _try_behind(self, job: Job, step: Callable[[], None]) -> None:
        """Take a step of the job behind the others; when that cannot be, tell why and forget it."""
        try:
            step()
        except SculptError as error:
            log.warning("%s: %s", job.label, error)
            self.behind = None
            if job.told_why is not None:
                job.told_why(error.text)

    def _lose(self, job: Job, why: str) -> None:
        """The worker died with the job: let a new one try, once."""
        self.worker.end()  # one that answers nonsense may live
        job.deaths += 1
        if job.deaths > 1:
            self.fail(job, why)
            return
        self.queue_again(job)
        log.warning("%s is sent again: %s", job.label, why)
        self.watcher.warned(Text("{} is sent to a new worker. {}", job.title, why))

    def _silence(self, job: Job) -> None:
        """Let the worker stop a job; what it still sends of it is ignored."""
        if job.number >= 0:
            self.worker.cancel(job.number)
