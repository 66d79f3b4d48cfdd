# SPDX-License-Identifier: GPL-3.0-or-later
"""Session: Blender's one worker, started when it is needed, polled and fed with the jobs that wait.

Jobs run one at a time in the order of their coming. A job makes its request only when its turn
comes, so a stroke drawn while the last one is still computed works on the last one's result.

When the worker dies, or answers nonsense, the job that it had is sent to a new one. When that one
dies, too, the job fails and the next one has its turn. One that hangs is ended as if it had died:
when the artist restarts it or cancels its job, and at once in the background, where nobody can.
"""

import logging
import time
from collections import deque
from functools import partial

from bpy.app.translations import pgettext_n as n_

from ...common.errors import SculptError
from ...common.text import Text
from ...worker.client import Client, JobKind, Message, MessageKind, WorkerGoneError
from ..scene import sculpt_steps
from ..scene.properties import field_of, find
from ..scene.sculpt_steps import Step
from . import worker_choice
from .job import Job, JobStatus
from .worker_news import LONG, WorkerNews

log = logging.getLogger(__name__)

ADDING = {JobKind.FIT, JobKind.LOAD}
"""Jobs that make a new field. Undo takes back what was done since they were asked for."""


class Session(WorkerNews):
    """Starts the worker when it is first needed, and feeds it jobs."""

    def __init__(self) -> None:
        """No worker is started yet."""
        super().__init__()
        self._news: deque[Message] = deque()  # of the worker, not yet heard

    @property
    def client(self) -> Client | None:
        """The worker's client; None before the first job."""
        return self.worker.client

    def run(self, job: Job) -> None:
        """Queue a job, for whose end a script waits: SculptError then, when it fails."""
        self.submit(job)
        self.caller.await_end(job, self.poll_once)

    def submit(self, job: Job) -> None:
        """Queue a job. SculptError when there is no worker to run it."""
        self.let_come()
        self._queue(job)

    def _queue(self, job: Job) -> None:
        self.ensure_worker()
        self.last_error = ""
        self.drop_behind()
        job.step = sculpt_steps.active()
        self.jobs.append(job)
        self._advance()
        self.tell_waiting()  # while the worker begins
        self.watcher.work_came()

    def submit_again(self, job: Job) -> None:
        """Queue a job whose change redo has brought back. SculptError when there is no worker to
        run it."""
        job.base = ""
        self.queue_again(job)
        job.rests = not job.follows
        self._queue(job)

    def submit_behind(self, job: Job, start: bool = False) -> None:
        """Have a job done when nothing else waits. It takes the place of the one that has waited
        for that so far.

        Where nobody looks it is forgotten, for nobody would hear of it.

        start: the worker, too, where there is none: SculptError when it cannot be. Otherwise the
               job is forgotten then
        """
        if not self.caller.looks:
            return
        if start:
            self.ensure_worker()
        self.drop_behind()
        self.behind = job
        self.watcher.work_came()

    def drop_behind(self) -> None:
        """Forget the job that waits behind the others, which the worker may be at."""
        if self.behind is not None:
            self._silence(self.behind)
            self.behind = None
            self.watcher.changed()

    def cancel(self, target: int | None = None, why: str = "Cancelled.") -> None:
        """Cancel all jobs, or all on one target; what the worker still sends of them is ignored."""
        for job in [job for job in self.jobs if target is None or job.target == target]:
            self.cancel_job(job, why)

    def cancel_job(self, job: Job, why: str = "Cancelled.") -> None:
        """Cancel one job that is pending; a worker that hangs on it is replaced."""
        running = job.status is JobStatus.RUNNING
        self._silence(job)
        self.end(job, JobStatus.CANCELLED, why)
        if running and self.hangs:
            self.worker.give_up()
            self.watcher.work_came()

    def forget_bases(self, target: int, step: Step | None = None) -> None:
        """Let the jobs on an object begin again, for its state is another one now. Only a brush
        stroke that the worker has already goes on.

        step: of a stroke that came into the scene ahead of jobs that were asked for before it
        """
        before = sculpt_steps.steps()[0] if step is not None else []
        for job in self.pending(target):
            if job.follows and job.status is JobStatus.RUNNING:
                continue
            if job.status is JobStatus.RUNNING:
                self._silence(job)
                self.queue_again(job)
            job.base = ""
            if step in before and job.step in before[: before.index(step)]:
                job.step = step

    def settle(self, job: Job) -> None:
        """Let a running job end with what it has."""
        if job.status is JobStatus.RUNNING:
            self.worker.settle(job.number)

    @property
    def hangs(self) -> bool:
        """Whether the worker gives no sign of life."""
        return self.worker.hangs

    def follow_history(self) -> None:
        """After undo and redo: cancel the jobs whose object or base is gone, and begin those again
        whose object is back. Strokes and new fields wait while something can be redone."""
        for job in self.jobs:
            job.rests, job.waits = bool(job.strokes) or job.kind in ADDING, False
        for target, first in self.firsts().items():
            ob = find(target)
            if ob is None or (first.base and field_of(ob).revision != first.base):
                for job in self.pending(target):
                    if ob is None and job.keep is not None:
                        self._gone.append(job)
                    self.cancel_job(job, f"{first.label:.100} was cancelled: its field was undone.")
        back = [job for job in self._gone if find(job.target or 0) is not None]
        self._gone = [job for job in self._gone if job not in back]
        for job in back:
            try:
                self.submit_again(job)
            except SculptError as error:
                self.watcher.warned(error.text)
        if self.jobs:
            self.watcher.work_came()

    def leave_file(self) -> None:
        """Cancel and forget all, for another file was loaded."""
        self.cancel(why="Cancelled, for another file was opened.")
        self.undone.forget()
        self._gone.clear()
        self.drop_behind()

    def poll_once(self) -> bool:
        """Take what the worker has sent; whether it is worth showing. The progress of a quick job
        is not.

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
        begun = time.perf_counter()
        fresh = self.worker.poll()
        if self.hangs and not self.caller.acts:
            self.worker.give_up()
        self._news.extend(fresh)
        read = any(message.arrays for message in fresh)
        read = read and time.perf_counter() - begun > LONG  # the window has waited long enough
        while self._news and not read and not self._must_wait(self._news[0]):
            message = self._news.popleft()
            self.hear(message)
            heard |= message.kind is not MessageKind.PROGRESS or self.slow_job() is not None
            if message.arrays:
                break  # likewise
        if not read and self.arrivals.take():
            heard = True
        if self.hangs and self.jobs:
            self.jobs[0].message = n_("The worker gives no sign of life")
        self._advance()
        return heard

    def _recover(self) -> None:
        """After a defect: end the first job, and the worker, either of which may be its cause."""
        self.worker.stop()
        self._news.clear()
        self.behind = None
        if self.jobs:
            job = self.jobs[0]
            try:
                self.fail(job, Text("{} failed; the system console says why.", job.title))
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
        self.ensure_worker()
        self.watcher.work_came()

    def stop(self) -> None:
        """Cancel everything and end the worker process."""
        for job in [*self.jobs]:
            self.end(job, JobStatus.CANCELLED, "The worker was stopped.")
        self.behind = None
        self.worker.stop()
        self._news.clear()
        self.watcher.stopped()

    def ensure_worker(self) -> None:
        command = worker_choice.command()
        if self.client is not None:
            busy = any(job.status is not JobStatus.QUEUED for job in self.jobs)
            if self.client.alive and (busy or self.client.command == tuple(command)):
                return
            self.worker.end()  # gives every open job its end
            for message in [*self._news, *self.worker.poll()]:
                self.hear(message)
            self._news.clear()
        self.worker.start(command)

    def _advance(self) -> None:
        """Let the first job begin, or end that could not before."""
        if self.jobs and self.jobs[0].failure:
            self.fail(self.jobs[0], self.jobs[0].failure)
        self.tell_bases()
        while self.jobs and self.jobs[0].status is JobStatus.QUEUED:
            if self.arrivals.hold(self.jobs[0]) and not self._let_by():
                self.waits_for_redo(self.jobs[0])
                break
            self.attempt(self.jobs[0], partial(self._start, self.jobs[0]))
            self.tell_bases()  # when that could not begin, the next one is the first
        behind = self.behind
        if not self.jobs and behind is not None and behind.status is JobStatus.QUEUED:
            if self.worker.alive:
                self._try_behind(behind, partial(self._begin, behind))
            else:  # it is gone with all that it knew
                self.behind = None

    def _let_by(self) -> bool:
        """Move a brush stroke ahead of the job that waits for it; whether there is one."""
        stroke = next((job for job in self.jobs if job.kind is JobKind.ABSORB_STROKE), None)
        if stroke is not None:
            self.jobs.remove(stroke)
            self.jobs.appendleft(stroke)
            self.tell_bases()
        return stroke is not None

    def _start(self, job: Job) -> None:
        self.ensure_worker()
        try:
            self._begin(job)
        except WorkerGoneError as error:  # just now
            self._lose(job, error.text)

    def _begin(self, job: Job) -> None:
        """Make the job's request and let the worker have it; previews only where they are seen."""
        request = job.request()
        if job.preview is not None:
            request.fields["preview"] = self.caller.looks
        job.kind = request.kind or job.kind
        job.number = self.worker.send(job.kind, request)
        job.status, job.begun, job.waits = JobStatus.RUNNING, time.monotonic(), False


session = Session()
"""The only one."""
