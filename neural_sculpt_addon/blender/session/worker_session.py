# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's one worker and the jobs that wait for it.

Jobs run one at a time in the order of their coming. A job makes its request only when its turn
comes, so a stroke drawn while the last one is still computed works on the last one's result. A job
that edits an object remembers the object's session_uid and the revision it must find there, never
a Blender reference: when the object is gone or an undo brought another revision, the result is
dropped. In Edit Mode, whose undo steps hold nothing else, and in Dyntopo results wait.

When the worker dies, or answers nonsense, the job that it had is sent to a new one. When that one
dies, too, the job fails and the next one has its turn. A stroke that fails for no reason of its own
stays in the history, muted. One that hangs is ended as if it had died: when the artist restarts it
or cancels its job, and at once in the background, where nobody can.

One job may wait *behind* all others, which cancel it when they come: it shows no progress, and
nobody is told when it fails.

A `Watcher` hears what happens and shows it; the session knows nothing of windows.
"""

import logging
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import bpy
from bpy.app.translations import pgettext_n as n_

from ...stroke.errors import SculptError
from ...stroke.stroke import Stroke
from ...worker import answers
from ...worker.client import Client, JobKind, Message, MessageKind, WorkerGoneError
from ...worker.install import environment
from ...worker.protocol import ProtocolError
from .. import preferences
from ..scene import carried, proxy_mesh, sculpt_steps
from ..scene.commit import foresee, in_edit_mode
from ..scene.properties import field_of
from .job import Job, JobStatus, find
from .session_watcher import Watcher
from .worker_process import Worker

log = logging.getLogger(__name__)

SLOW = 0.5  # seconds after which the status bar tells how far a job is


class Session:
    """Starts the worker when it is first needed, and feeds it jobs."""

    def __init__(self) -> None:
        """No worker is started yet."""
        self.jobs: deque[Job] = deque()
        self.behind: Job | None = None
        """The job that waits for all others to end."""
        self.worker = Worker()
        self.watcher = Watcher()
        self.last_error = ""
        self.waits = bpy.app.background
        """Whether operators wait for their jobs."""
        self._news: deque[Message] = deque()  # of the worker, not yet heard
        self._checked: Message | None = None  # the last one that was found to be sound

    @property
    def client(self) -> Client | None:
        """The worker's client; None before the first job."""
        return self.worker.client

    def run(self, job: Job) -> None:
        """Queue a job, and where operators wait, wait for its end. SculptError when it fails."""
        self.submit(job)
        if self.waits:
            self.wait(job)

    def submit(self, job: Job) -> None:
        """Queue a job. SculptError when there is no worker to run it."""
        self._ensure_worker()
        self.last_error = ""
        self.drop_behind()
        job.step = sculpt_steps.active()
        self.jobs.append(job)
        self._advance()
        self._tell_waiting()  # while the worker begins
        self.watcher.work_came()

    def submit_again(self, job: Job) -> None:
        """Queue a job that was cancelled. SculptError when there is no worker to run it."""
        job.base = ""
        self._queue_again(job)
        self.submit(job)

    def submit_behind(self, job: Job) -> None:
        """Have a job done when nothing else waits, instead of the one that was to be."""
        self.drop_behind()
        self.behind = job
        self.watcher.work_came()

    def drop_behind(self) -> None:
        """Forget the job that waits behind the others, which the worker may be at."""
        if self.behind is not None:
            self._silence(self.behind)
            self.behind = None
            self.watcher.changed()

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
            self.cancel_job(job, why)

    def cancel_job(self, job: Job, why: str = "Cancelled.") -> None:
        """Cancel one job that is pending; a worker that hangs on it is replaced."""
        running = job.status is JobStatus.RUNNING
        self._silence(job)
        self._end(job, JobStatus.CANCELLED, why)
        if running and self.hangs:
            self.worker.give_up()
            self.watcher.work_came()

    def settle(self, job: Job) -> None:
        """Let a running job end with what it has."""
        if job.status is JobStatus.RUNNING:
            self.worker.settle(job.number)

    def pending(self, target: int | None) -> list[Job]:
        """The jobs on an object that have no result yet."""
        return [job for job in self.jobs if job.target == target and job.pending]

    def newest_change(self) -> Job | None:
        """The job of the last change of a field, while it has no result, and nothing that is in
        Blender's history was done after it was asked for."""
        pending = (job for job in reversed(self.jobs) if job.pending)
        changes = (job for job in pending if job.target is not None and not job.follows)
        job = next(changes, None)
        return job if job is not None and job.step == sculpt_steps.active() else None

    @property
    def hangs(self) -> bool:
        """Whether the worker gives no sign of life."""
        return self.worker.hangs

    def slow_job(self) -> Job | None:
        """The running job, when the artist has waited for it so long that it must show."""
        first = self.jobs[0] if self.jobs else None
        if first is None or first.status is not JobStatus.RUNNING:
            return None
        return first if time.monotonic() - first.begun > SLOW else None

    def follow_history(self) -> None:
        """After undo and redo: cancel the jobs whose object or base is gone."""
        for target, first in self._firsts().items():
            ob = find(target)
            if ob is None or field_of(ob).revision != first.base:
                for job in self.pending(target):
                    self.cancel_job(job, f"{first.label} was cancelled: its field was undone.")

    def leave_file(self) -> None:
        """Before another file is loaded."""
        self.cancel(why="Cancelled, for another file was opened.")
        self.drop_behind()

    def poll_once(self) -> bool:
        """Take what the worker sent: whether there was news.

        Never blocks, but for the time that it takes to read a result, or to show it. Raises
        nothing: Blender would drop the timer, and all jobs wait forever.
        """
        try:
            return self._poll()
        except Exception:
            log.exception("the worker's news could not be taken")
            self._recover()
            return True

    def _poll(self) -> bool:
        heard = False
        self.watcher.polled()
        fresh = self.worker.poll()
        if self.waits and self.hangs:
            self.worker.give_up()
        self._news.extend(fresh)
        read = any(message.arrays for message in fresh)  # the window has waited long enough
        while self._news and not read and not self._must_wait(self._news[0]):
            message = self._news.popleft()
            self._hear(message)
            heard = True
            if message.arrays:
                break  # likewise
        if self.hangs and self.jobs:
            self.jobs[0].message = n_("The worker gives no sign of life")
        self._advance()
        return heard

    def _recover(self) -> None:
        """After a defect: end the job that it was met in, and the worker that may be at fault."""
        self.worker.stop()
        self._news.clear()
        self.behind = None
        if self.jobs:
            job = self.jobs[0]
            try:
                self._fail(job, f"{job.title} failed; the system console says why.")
            except Exception:
                log.exception("%s cannot be ended", job.label)
                job.status = JobStatus.FAILED
                self.jobs = deque(other for other in self.jobs if other is not job)

    def restart(self) -> None:
        """Stop the worker, whatever it does, and start a new one.

        Queued jobs are cancelled; those of a worker that hangs are sent to the new one.
        """
        if self.hangs:
            self.worker.give_up()
        else:
            self.stop()
        self._ensure_worker()
        self.watcher.work_came()

    def stop(self) -> None:
        """Cancel everything and end the worker process."""
        self.behind = None
        for job in [*self.jobs]:
            self._end(job, JobStatus.CANCELLED, "The worker was stopped.")
        self.worker.stop()
        self._news.clear()
        self.watcher.stopped()

    def _ensure_worker(self) -> None:
        command = environment.worker_command(preferences.worker_python(), preferences.device())
        if self.client is not None:
            busy = any(job.status is not JobStatus.QUEUED for job in self.jobs)
            if self.client.alive and (busy or self.client.command == tuple(command)):
                return
            self.worker.end()  # gives every open job its end
            for message in [*self._news, *self.worker.poll()]:
                self._hear(message)
            self._news.clear()
        self.worker.start(command)

    def _firsts(self) -> dict[int, Job]:
        """The first pending job on each object."""
        return {job.target: job for job in reversed(self.jobs) if job.target and job.pending}

    def _tell_bases(self) -> None:
        """Tell the first job of each object what it builds on."""
        for target, job in self._firsts().items():
            ob = find(target)
            if not job.base and ob is not None:
                job.base = field_of(ob).revision

    def _advance(self) -> None:
        """Let the first job begin, or end that could not before."""
        if self.jobs and self.jobs[0].failure:
            self._fail(self.jobs[0], self.jobs[0].failure)
        self._tell_bases()
        while self.jobs and self.jobs[0].status is JobStatus.QUEUED:
            self._try(self.jobs[0], partial(self._start, self.jobs[0]))
            self._tell_bases()  # when that could not begin, the next one is the first
        behind = self.behind
        if not self.jobs and behind is not None and behind.status is JobStatus.QUEUED:
            if self.worker.alive:
                self._try_behind(behind, partial(self._begin, behind))
            else:  # it is gone with all that it knew
                self.behind = None

    def _start(self, job: Job) -> None:
        self._ensure_worker()
        try:
            self._begin(job)
        except WorkerGoneError as error:  # just now
            self._lose(job, str(error))

    def _begin(self, job: Job) -> None:
        """Make the job's request and let the worker have it."""
        request = job.request()
        job.kind = request.kind or job.kind
        job.number = self.worker.send(job.kind, request)
        job.status, job.begun = JobStatus.RUNNING, time.monotonic()

    def _must_wait(self, message: Message) -> bool:
        """Whether a result cannot be shown yet: it is to be prepared, or the strokes that come
        after it, or the artist has to leave a mode."""
        if self.waits or not self.jobs or message.job != self.jobs[0].number:
            return False
        job = self.jobs[0]
        try:
            self._check(job, message)
        except ProtocolError:
            return False  # it is met again when the message is heard
        if self._prepare(job, message):
            return True
        if message.kind is not MessageKind.RESULT:
            return False
        return self._in_other_mode(job) or self._foresee(job, message)

    def _check(self, job: Job, message: Message) -> None:
        """ProtocolError unless the message can be one of the job; each is looked through once."""
        if message is not self._checked:
            answers.check(job.kind, message)
            self._checked = message

    def _foresee(self, job: Job, message: Message) -> bool:
        """Whether there still is to be found what the next proxy takes over from that of now. Of
        what a brush did the proxy is another one when that reaches the scene."""
        ob = None if job.target is None else find(job.target)
        if ob is None or "vertices" not in message.arrays or job.kind is JobKind.BRUSHED:
            return False
        return foresee(ob, message)

    def _prepare(self, job: Job, message: Message) -> bool:
        others = (other for other in self.pending(job.target) if other is not job)
        waiting = [stroke for other in others for stroke in other.strokes]
        if not waiting or job.target is None or "vertices" not in message.arrays:
            return False
        return self.watcher.prepare(job.target, message, waiting)

    def _in_other_mode(self, job: Job) -> bool:
        """Whether the artist is in a mode whose undo steps do not hold a result."""
        ob = None if job.target is None else find(job.target)
        if in_edit_mode():
            job.message = n_("Waits until Edit Mode is left")
        elif ob is not None and proxy_mesh.in_dyntopo(ob):
            job.message = n_("Waits until Dyntopo is off")
        else:
            return False
        return True

    def _hear(self, message: Message) -> None:
        """Something of the first job; of others there is only what was sent before they ended."""
        if self.behind is not None and message.job == self.behind.number:
            self._hear_behind(self.behind, message)
        if not self.jobs or message.job != self.jobs[0].number:
            return
        job = self.jobs[0]
        try:
            self._check(job, message)
        except ProtocolError as error:
            self._lose(job, f"The worker answered nonsense: {error}")
            return
        finally:
            self._checked = None
        if message.kind is MessageKind.PROGRESS:
            job.fraction = message.fields["fraction"]
            job.message = message.fields["message"]
        elif message.kind is MessageKind.PREVIEW:
            if job.preview and not self._try(job, partial(job.preview, message)):
                self._silence(job)
        elif message.kind is MessageKind.CANCELLED:
            self._end(job, JobStatus.CANCELLED, "Cancelled.")
        elif message.kind is MessageKind.ERROR:
            self._hear_error(job, message.fields)
        else:
            self.worker.keep(message)
            with self.history_grows():
                if self._try(job, partial(job.apply, message)):
                    self._end(job, JobStatus.DONE, "")
                else:
                    self._silence(job)

    @contextmanager
    def history_grows(self) -> Iterator[None]:
        """While results reach Blender's history: the jobs that wait were asked for after them."""
        before = sculpt_steps.active()
        yield
        after = sculpt_steps.active()
        for job in self.jobs:
            if job.step == before:
                job.step = after

    def _hear_error(self, job: Job, fields: dict[str, Any]) -> None:
        text = fields["message"]
        if fields.get("missing") and not job.resent:
            log.info("%s is sent again, for the worker lacks bytes", job.label)
            self.worker.forget()
            job.resent = True
            self._queue_again(job)
        elif fields.get("died"):
            self._lose(job, text)
        elif fields["detail"]:  # a defect, or no memory
            self._fail(job, text)
        else:  # what was asked for cannot be
            self._end(job, JobStatus.FAILED, text)

    def _hear_behind(self, job: Job, message: Message) -> None:
        """Of the job behind the others, which nobody waits for."""
        if message.kind is MessageKind.RESULT:
            self.behind = None
            self._try_behind(job, partial(self._apply_behind, job, message))
        elif message.kind in {MessageKind.ERROR, MessageKind.CANCELLED}:
            log.info("%s: %s", job.label, message.fields.get("message", message.kind))
            self.behind = None

    def _apply_behind(self, job: Job, message: Message) -> None:
        answers.check(job.kind, message)
        job.apply(message)

    def _try_behind(self, job: Job, step: Callable[[], None]) -> None:
        """Take a step of the job behind the others; when that cannot be, forget it."""
        try:
            step()
        except SculptError as error:
            log.warning("%s: %s", job.label, error)
            self.behind = None

    def _try(self, job: Job, step: Callable[[], None]) -> bool:
        """Take a step of a job; when that cannot be, end the job."""
        try:
            self._check_target(job)
            step()
        except SculptError as error:
            self._fail(job, str(error))
            return False
        except Exception:  # a defect: the jobs to come must not suffer for it
            log.exception("%s failed", job.label)
            self._fail(job, f"{job.title} failed; the system console says why.")
            return False
        return True

    def _lose(self, job: Job, why: str) -> None:
        """The worker died with the job: let a new one try, once."""
        self.worker.end()  # one that answers nonsense may live
        job.deaths += 1
        if job.deaths > 1:
            self._fail(job, why)
            return
        self._queue_again(job)
        log.warning("%s is sent again: %s", job.label, why)
        self.watcher.warned(f"{job.title} is sent to a new worker. {why}")

    def _queue_again(self, job: Job) -> None:
        job.status, job.number, job.fraction, job.message = JobStatus.QUEUED, -1, 0.0, ""
        self.watcher.changed()

    def _fail(self, job: Job, why: str) -> None:
        """End a job; its strokes, which are not at fault, stay in the history, as soon as a mode
        is left whose undo steps would not hold them."""
        if job.keep is not None and find(job.target or 0) is not None:
            if not self.waits and self._in_other_mode(job):
                job.status, job.number, job.failure = JobStatus.RUNNING, -1, why
                return
            try:
                job.keep()
                why = f"{why} {job.title} is in the history, muted."
            except SculptError as error:  # the object cannot be changed at all
                log.warning("%s cannot be kept: %s", job.label, error)
        self._end(job, JobStatus.FAILED, why)

    def _tell_waiting(self) -> None:
        """Tell which strokes have no result yet; none where operators wait."""
        waiting: dict[int, list[Stroke]] = {}
        for job in self.jobs if not self.waits else ():
            if job.target is not None and job.pending and job.strokes:
                waiting.setdefault(job.target, []).extend(job.strokes)
        self.watcher.strokes_wait(waiting)

    def _silence(self, job: Job) -> None:
        """Let the worker stop a job; what it still sends of it is ignored."""
        if job.number >= 0:
            self.worker.cancel(job.number)

    def _check_target(self, job: Job) -> None:
        if job.target is None:
            return
        ob = find(job.target)
        if ob is None:
            raise SculptError(f"{job.title} was dropped: the object is gone.")
        if field_of(ob).revision != job.base:
            raise SculptError(f"{job.title} was dropped: {ob.name} changed in the meantime.")

    def _end(self, job: Job, status: JobStatus, message: str) -> None:
        self.jobs.remove(job)
        job.status, job.message = status, message
        carried.forget()
        self.watcher.ended(job)
        self._tell_waiting()
        if status is JobStatus.FAILED:
            self.last_error = message
            log.warning("%s: %s", job.label, message)
            self.watcher.warned(message)


session = Session()
"""The only one."""
