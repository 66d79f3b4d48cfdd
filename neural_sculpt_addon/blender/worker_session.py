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

Bytes of fields go to a worker process once; a worker that lacks some says so and gets all again.
One job may wait *behind* all others, which cancel it when they come: it shows no progress, and
nobody is told when it fails.

In a window a timer calls `poll_once`; timers never run in the background, where operators wait.
"""

import logging
import time
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_n as n_

from ..stroke.errors import SculptError
from ..stroke.stroke import Stroke
from ..worker import answers, environment
from ..worker.client import (
    Client,
    Message,
    MessageKind,
    WorkerGoneError,
    WorkerState,
)
from ..worker.protocol import ProtocolError
from . import hints, preferences, preview, proxy_mesh, redraw, sculpt_steps
from .commit import in_edit_mode
from .folders import log_file
from .job import Job, JobStatus, Request, find
from .operators import notice
from .properties import field_of

log = logging.getLogger(__name__)

TICK = 0.005  # seconds between two polls in a window, whose own loop is no faster
SLOW = 0.5  # seconds after which the status bar tells how far a job is


class Session:
    """Owns the client, starts the worker when it is first needed, and feeds it jobs."""

    def __init__(self) -> None:
        """No worker is started yet."""
        self.jobs: deque[Job] = deque()
        self.behind: Job | None = None
        """The job that waits for all others to end."""
        self.client: Client | None = None
        self.last_error = ""
        self.waits = bpy.app.background
        """Whether operators wait for their jobs."""
        self._timer = self._tick  # one object, as Blender knows a timer by it
        self._told = False  # of a slow job, in the status bar
        self._held: set[str] = set()  # ids of bytes that the worker has
        self._news: deque[Message] = deque()  # of the worker, not yet heard

    def submit(self, job: Job) -> None:
        """Queue a job. SculptError when there is no worker to run it."""
        self._ensure_worker()
        self.last_error = ""
        self.drop_behind()
        job.step = sculpt_steps.active()
        self.jobs.append(job)
        self._advance()
        self._preview()  # while the worker begins
        self._watch()

    def submit_again(self, job: Job) -> None:
        """Queue a job that was cancelled. SculptError when there is no worker to run it."""
        job.base = ""
        self._queue_again(job)
        self.submit(job)

    def submit_behind(self, job: Job) -> None:
        """Have a job done when nothing else waits, instead of the one that was to be."""
        self.drop_behind()
        self.behind = job
        self._watch()

    def drop_behind(self) -> None:
        """Forget the job that waits behind the others, which the worker may be at."""
        if self.behind is not None:
            self._silence(self.behind)
            self.behind = None
            redraw.tag_panels()

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
        if running and self.hangs and self.client is not None:
            self.client.give_up()
            self._watch()

    def settle(self, job: Job) -> None:
        """Let a running job end with what it has."""
        if job.status is JobStatus.RUNNING and self.client is not None:
            self.client.settle(job.number)

    def pending(self, target: int | None) -> list[Job]:
        """The jobs on an object that have no result yet."""
        return [job for job in self.jobs if job.target == target and job.pending]

    def newest_change(self) -> Job | None:
        """The job of the last change of a field, while it has no result, and nothing that is in
        Blender's history was done after it was asked for."""
        changes = (job for job in reversed(self.jobs) if job.pending and job.target is not None)
        job = next(changes, None)
        return job if job is not None and job.step == sculpt_steps.active() else None

    @property
    def hangs(self) -> bool:
        """Whether the worker gives no sign of life."""
        return self.client is not None and self.client.state is WorkerState.HANGING

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
        preview.refresh()
        fresh = [] if self.client is None else self.client.poll_once()
        if self.waits and self.hangs and self.client is not None:
            self.client.give_up()
        self._news.extend(fresh)
        read = any(message.arrays for message in fresh)  # the window has waited long enough
        while self._news and not read and not self._foresee(self._news[0]):
            if self._must_wait(self._news[0]):
                break
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
        if self.client is not None:
            self.client.stop()
            self.client = None
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
        if self.hangs and self.client is not None:
            self.client.give_up()
        else:
            self.stop()
        self._ensure_worker()
        self._watch()

    def stop(self) -> None:
        """Cancel everything and end the worker process."""
        self.behind = None
        for job in [*self.jobs]:
            self._end(job, JobStatus.CANCELLED, "The worker was stopped.")
        if self.client is not None:
            self.client.stop()
            self.client = None
        self._news.clear()
        if bpy.app.timers.is_registered(self._timer):
            bpy.app.timers.unregister(self._timer)

    def _ensure_worker(self) -> None:
        command = environment.worker_command(preferences.worker_python(), preferences.device())
        if self.client is not None:
            busy = any(job.status is not JobStatus.QUEUED for job in self.jobs)
            if self.client.alive and (busy or self.client.command == tuple(command)):
                return
            self.client.stop()  # gives every open job its end
            for message in [*self._news, *self.client.poll_once()]:
                self._hear(message)
            self._news.clear()
        client = Client(command, log_file())
        client.start()
        self.client = client
        self._held.clear()

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
        """Let the first job begin."""
        self._tell_bases()
        while self.jobs and self.jobs[0].status is JobStatus.QUEUED:
            self._try(self.jobs[0], partial(self._start, self.jobs[0]))
            self._tell_bases()  # when that could not begin, the next one is the first
        behind = self.behind
        if not self.jobs and behind is not None and behind.status is JobStatus.QUEUED:
            if self.client is not None and self.client.alive:
                self._send(behind, behind.request())
            else:  # it is gone with all that it knew
                self.behind = None

    def _start(self, job: Job) -> None:
        self._ensure_worker()
        assert self.client is not None
        request = job.request()
        job.kind = request.kind or job.kind
        try:
            self._send(job, request)
        except WorkerGoneError as error:  # just now
            self._lose(job, str(error))

    def _send(self, job: Job, request: Request) -> None:
        """Let the worker have a job, and those bytes that it does not have."""
        assert self.client is not None
        arrays = dict(request.arrays)
        for name, read in request.held.items():
            if name not in self._held:
                arrays[name] = np.frombuffer(read(), np.uint8)
        job.number = self.client.submit(job.kind, request.fields, arrays)
        job.status, job.begun = JobStatus.RUNNING, time.monotonic()
        self._held.update(request.held)

    def _foresee(self, message: Message) -> bool:
        """Displace a stroke that still waits on the proxy which a result brings: whether there was
        one to do, and the result can be shown no sooner than by the next poll."""
        if self.waits or not self.jobs or message.job != self.jobs[0].number:
            return False
        job, arrays = self.jobs[0], message.arrays
        others = (other for other in self.pending(job.target) if other is not job)
        waiting = [stroke for other in others for stroke in other.strokes]
        if not waiting or job.target is None or "vertices" not in arrays:
            return False
        return preview.foresee(job.target, arrays["vertices"], arrays["triangles"], waiting)

    def _must_wait(self, message: Message) -> bool:
        """Whether a result cannot be shown before the artist has left a mode."""
        if self.waits or not self.jobs or message.job != self.jobs[0].number:
            return False
        job = self.jobs[0]
        if message.kind is not MessageKind.RESULT:
            return False
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
            answers.check(job.kind, message)
        except ProtocolError as error:
            self._lose(job, f"The worker answered nonsense: {error}")
            return
        if message.kind is MessageKind.PROGRESS:
            job.fraction = message.fields["fraction"]
            job.message = message.fields["message"]
        elif message.kind is MessageKind.PREVIEW:
            if job.preview is not None:
                job.preview(message)
        elif message.kind is MessageKind.CANCELLED:
            self._end(job, JobStatus.CANCELLED, "Cancelled.")
        elif message.kind is MessageKind.ERROR:
            self._hear_error(job, message.fields)
        else:
            self._hear_result(job, message)

    def _hear_result(self, job: Job, message: Message) -> None:
        self._held.update(_ids(message))
        step = sculpt_steps.active()
        if self._try(job, partial(job.apply, message)):
            self._end(job, JobStatus.DONE, "")
        else:
            self._silence(job)
        for other in self.jobs:  # were asked for after this one
            if other.step == step:
                other.step = sculpt_steps.active()

    def _hear_error(self, job: Job, fields: dict[str, Any]) -> None:
        text = fields["message"]
        if fields.get("missing") and not job.resent:
            log.info("%s is sent again, for the worker lacks bytes", job.label)
            self._held.clear()
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
            answers.check(job.kind, message)
            job.apply(message)
        elif message.kind in {MessageKind.ERROR, MessageKind.CANCELLED}:
            log.info("%s: %s", job.label, message.fields.get("message", message.kind))
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
        if self.client is not None:
            self.client.stop()  # one that answers nonsense may live
        job.deaths += 1
        if job.deaths > 1:
            self._fail(job, why)
            return
        self._queue_again(job)
        log.warning("%s is sent again: %s", job.label, why)
        notice.tell(f"{job.title} is sent to a new worker. {why}")

    def _queue_again(self, job: Job) -> None:
        job.status, job.number, job.fraction, job.message = JobStatus.QUEUED, -1, 0.0, ""
        redraw.tag_panels()

    def _fail(self, job: Job, why: str) -> None:
        """End a job; its strokes, which are not at fault, stay in the history."""
        if job.keep is not None and find(job.target or 0) is not None:
            try:
                job.keep()
                why = f"{why} {job.title} is in the history, muted."
            except SculptError as error:  # the object cannot be changed at all
                log.warning("%s cannot be kept: %s", job.label, error)
        self._end(job, JobStatus.FAILED, why)

    def _preview(self) -> None:
        """Show the strokes that have no result yet on their proxies."""
        waiting: dict[int, list[Stroke]] = {}
        for job in self.jobs if not self.waits else ():
            if job.target is not None and job.pending and job.strokes:
                waiting.setdefault(job.target, []).extend(job.strokes)
        preview.want(waiting)

    def _silence(self, job: Job) -> None:
        """Let the worker stop a job; what it still sends of it is ignored."""
        if job.number >= 0 and self.client is not None:
            self.client.cancel(job.number)

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
        redraw.tag_panels()
        if job.preview is not None:
            redraw.tag_views()  # it is gone
        self._preview()
        if status is JobStatus.FAILED:
            self.last_error = message
            log.warning("%s: %s", job.label, message)
            notice.tell(message)

    def _watch(self) -> None:
        if not bpy.app.background and not bpy.app.timers.is_registered(self._timer):
            bpy.app.timers.register(self._timer, persistent=True)

    def _tick(self) -> float | None:
        before = self.client and self.client.state
        heard = self.poll_once()
        now = self.client and self.client.state
        if heard or now is not before:
            redraw.tag_panels()
        told, self._told = self._told, self.slow_job() is not None
        if told is not self._told or (self._told and (heard or now is not before)):
            hints.refresh()
        busy = self.jobs or self.behind or now is WorkerState.STARTING
        return TICK if busy else None


def _ids(result: Message) -> Iterator[str]:
    """Names of the bytes that a worker made, and so has."""
    fields = result.fields
    yield from (fields[name] for name in ("id", "base", "layer") if name in fields)
    yield from (layer["id"] for layer in fields.get("layers", ()))


session = Session()
"""The only one."""
