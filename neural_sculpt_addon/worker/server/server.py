# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's process: takes jobs, runs them one by one and answers.

The main thread runs the jobs in the order of their arrival. A second thread listens at stdin, whose
first line names the folder of requests and answers (see mailbox) and which then has a byte for each
request: so a cancel is heard in mid-job, and the end of the pipe ends the process at once. Whoever
asked is gone then, and all that matters lives in the .blend. A third gives signs of life (see
pulse).
"""

import contextlib
import ctypes
import faulthandler
import json
import logging
import os
import platform
import shutil
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Mapping
from functools import partial
from io import RawIOBase
from pathlib import Path
from typing import Any

from ...common.errors import Cancelled, SculptError
from ...common.progress import Progress, interruptible
from ...common.text import Text, to_json
from .. import pulse
from ..install.environment import Device
from ..mailbox import Inbox, Outbox
from ..process import ANSWERS, REQUESTS
from ..protocol import PROTOCOL, ControlKind, JobKind, Message, MessageKind, ProtocolError
from .device import choose
from .jobs import Jobs, warm_up
from .payload import Handler, MissingError, Payload, Task

PROGRESS_SECONDS = 0.05
"""Seconds between two progress messages of a job. A report in between is not sent, but hears of a
cancel."""

RETRY = 0.01
"""Seconds until a request is looked for again that something else, a virus scanner, looks at."""

PATIENCE = 5.0
"""Seconds after which a request that was announced is lost: something has emptied the folder."""

_PR_SET_PDEATHSIG = 1  # <linux/prctl.h>

logger = logging.getLogger(__name__)


def main(device_name: str) -> None:
    """Serve the jobs of Neural Sculpt on a Device; never returns."""
    server = take_over()
    import torch

    torch.set_num_threads(1)
    torch.set_num_interop_threads(1)
    warm_up()
    hello = {"torch": str(torch.__version__), "python": platform.python_version()}
    try:
        device = choose(Device(device_name))
    except SculptError as error:
        server.serve(refusing(error.text), {**hello, "device": ""})
    else:
        server.serve(Jobs(device).handlers(), {**hello, "device": device.type})


def refusing(reason: str) -> dict[JobKind, Handler]:
    """Handlers that can only say why there is nothing to work on."""

    def refuse(job: Task, progress: Progress) -> Payload:
        raise SculptError(reason)

    return dict.fromkeys(JobKind, refuse)


def take_over() -> "Server":
    """Make this process a worker: it listens, and it goes when its parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in Blender's terminal is for Blender
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    faulthandler.enable()  # a crash in native code leaves its trace in the log
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(message)s")
    bell = os.fdopen(os.dup(0), "rb", buffering=0)
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    return Server(bell)


class Server:
    """The queue between the thread that listens and the thread that works."""

    def __init__(self, bell: RawIOBase) -> None:
        """Listen at `bell` from now on; its end ends the process."""
        self._bell = bell
        self._folder = Path(json.loads(bell.readline()))
        if not self._folder.is_dir():
            sys.exit(f"There is no folder {self._folder} to take requests from.")
        self._requests = Inbox(self._folder / REQUESTS)
        self._answers = Outbox(self._folder / ANSWERS)
        self._writing = threading.Lock()
        self._changed = threading.Condition()  # guards the next four
        self._waiting: deque[Message] = deque()
        self._running: int | None = None
        self._cancelled = False
        self._enough = set[int]()  # jobs whose results as they are will do
        self._reported = 0.0  # when the running job came to its last report
        threading.Thread(target=self._beat, name="pulse", daemon=True).start()
        threading.Thread(target=self._listen, name="listener", daemon=True).start()

    def serve(self, handlers: Mapping[JobKind, Handler], hello: Mapping[str, Any]) -> None:
        """Say hello and run jobs; never returns."""
        self._send(Message(MessageKind.HELLO, fields={"protocol": PROTOCOL, **hello}))
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting)
                job = self._waiting.popleft()
                self._running, self._cancelled = job.job, False
                self._reported = time.monotonic()
            self._finish(self._run(job, handlers))

    def _run(self, job: Message, handlers: Mapping[JobKind, Handler]) -> Message:
        """Run one job; its final message."""
        started = time.monotonic()
        try:
            handler = handlers[JobKind(job.kind)]
            task = Task(
                job.fields,
                job.arrays,
                preview=partial(self._send_preview, job.job),
                enough=lambda: job.job in self._enough,
            )
            with interruptible(self._look):
                result = handler(task, self._progress(job.job))
        except Cancelled:
            return Message(MessageKind.CANCELLED, job.job)
        except MissingError as error:
            return _error(job.job, error.text, missing=error.ids)
        except SculptError as error:
            return _error(job.job, error.text)
        except MemoryError:
            return _error(
                job.job,
                Text("The worker ran out of memory; try a lower resolution."),
                "MemoryError",
            )
        except Exception as error:  # a defect in one job must not take the worker with it
            logger.exception("%s failed", job.kind)
            return _error(
                job.job,
                Text(
                    "The worker failed ({}: {}). Please report this with the worker's log.",
                    type(error).__name__,
                    f"{error!s:.100}",
                ),
                traceback.format_exc(),
            )
        logger.info("%s took %.2f s", job.kind, time.monotonic() - started)
        return Message(MessageKind.RESULT, job.job, dict(result.fields), dict(result.arrays))

    def _progress(self, job: int) -> Progress:
        """What a handler reports to, and hears of a cancel from."""
        last = -PROGRESS_SECONDS

        def report(fraction: float, message: str) -> None:
            nonlocal last
            self._look()
            now = self._reported
            if now - last >= PROGRESS_SECONDS:
                last = now
                fields = {
                    "fraction": min(max(float(fraction), 0.0), 1.0),
                    "message": to_json(message),
                }
                self._send(Message(MessageKind.PROGRESS, job, fields))

        return report

    def _look(self) -> None:
        """Note a sign of the running job. Cancelled when it is no longer wanted."""
        if self._cancelled:
            raise Cancelled
        self._reported = time.monotonic()

    def _send_preview(self, job: int, shown: Payload) -> None:
        self._send(Message(MessageKind.PREVIEW, job, dict(shown.fields), dict(shown.arrays)))

    def _finish(self, answer: Message) -> None:
        """End the running job: from here on a cancel comes too late."""
        with self._changed:
            self._running = None
            self._enough.discard(answer.job)
        try:
            self._send(answer)
        except ProtocolError as error:  # a result that cannot be sent: NaN in a report, too large
            logger.exception("the result of job %d cannot be sent", answer.job)
            self._send(_error(answer.job, error.text))

    def _send(self, message: Message) -> None:
        try:
            with self._writing:
                self._answers.put(message)
        except OSError:  # the disk is full, or the folder is gone and nobody listens any more
            logger.exception("the worker cannot answer")
            os._exit(1)

    def _beat(self) -> None:
        """Give signs of life, unless a job is stuck."""
        with contextlib.suppress(OSError):  # the folder is gone, and this process is about to be
            while True:
                if self._running is None or time.monotonic() - self._reported < pulse.STUCK:
                    pulse.beat(self._folder / ANSWERS)
                time.sleep(pulse.INTERVAL)

    def _listen(self) -> None:
        try:
            while self._bell.read(1):
                self._take(self._next())
            self._leave()
        except Exception:  # a request is lost, or this code is wrong: no way on
            logger.exception("the worker cannot read its requests")
        finally:
            os._exit(1)

    def _leave(self) -> None:
        """End the process and remove its folder, when nobody reads its answers any more."""
        with self._writing:  # to the end: nothing is put into a folder that is gone
            for name in (REQUESTS, ANSWERS):
                shutil.rmtree(self._folder / name, ignore_errors=True)
            with contextlib.suppress(OSError):
                self._folder.rmdir()
            os._exit(0)

    def _next(self) -> Message:
        """The request that was announced. ProtocolError when it is lost."""
        end = time.monotonic() + PATIENCE
        while (message := self._requests.take()) is None:
            if time.monotonic() > end:
                raise ProtocolError(f"A request in {self._folder} is lost.")
            time.sleep(RETRY)
        return message

    def _take(self, message: Message) -> None:
        """Queue a job, or end one: without a result, or with the one that it has."""
        if message.kind is ControlKind.CANCEL:
            self._cancel(message.job)
            return
        if message.kind is ControlKind.ENOUGH:
            with self._changed:
                if self._is_open(message.job):
                    self._enough.add(message.job)
            return
        if not isinstance(message.kind, JobKind):
            raise ProtocolError(f"The worker was sent a {message.kind}.")
        with self._changed:
            if self._is_open(message.job):
                raise ProtocolError(f"There is already a job {message.job}.")
            self._waiting.append(message)
            self._changed.notify()

    def _is_open(self, number: int) -> bool:
        """Whether a job runs or waits."""
        return number == self._running or any(job.job == number for job in self._waiting)

    def _cancel(self, number: int) -> None:
        with self._changed:
            if number == self._running:
                self._cancelled = True  # its handler hears of it at its next progress
            waiting = next((job for job in self._waiting if job.job == number), None)
            if waiting is None:
                return  # running, or it has ended already
            self._waiting.remove(waiting)
            self._enough.discard(number)
        self._send(Message(MessageKind.CANCELLED, number))


def _error(job: int, message: str, detail: str = "", **fields: Any) -> Message:
    told = {"message": to_json(message), "detail": detail}
    return Message(MessageKind.ERROR, job, {**told, **fields})
