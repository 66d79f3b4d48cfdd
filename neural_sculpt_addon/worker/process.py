# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of the worker: the child process, and the folder of its requests and answers.

NumPy and the standard library only. Requests and answers are files (see mailbox), so that nothing
here waits for the worker. Its stdin gets the folder's name as a line of JSON, for a name can hold
a line break, and then a byte for each request; the end of stdin ends it. What it prints is its log.
"""

import contextlib
import json
import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..common.child import exit_in_words, start_logged
from ..common.errors import SculptError
from .leftovers import make_folder, sweep
from .mailbox import Inbox, Outbox
from .protocol import Message, ProtocolError
from .pulse import Pulse

REQUESTS, ANSWERS = "requests", "answers"
"""Folders in that of the worker."""

_GRACE = 2.0  # seconds that a worker has to leave before it is killed
_LOG_LINES = 12
_LOG_BYTES = 8192


@dataclass(frozen=True)
class Exit:
    """The end of a worker: why in a few words, and the last lines of its log."""

    reason: str
    log_tail: str


class WorkerProcess:
    """A running worker."""

    def __init__(self, command: Sequence[str], log: Path) -> None:
        """Start `command` with what it prints into a fresh `log`. SculptError when that fails."""
        self.log = log
        folder = None
        try:
            sweep()
            folder = make_folder()
            for name in (REQUESTS, ANSWERS):
                (folder / name).mkdir()
            log.parent.mkdir(parents=True, exist_ok=True)
            with log.open("wb") as output:
                self.child = start_logged(command, output)
        except OSError as error:
            if folder is not None:
                shutil.rmtree(folder, ignore_errors=True)
            raise SculptError(
                "The worker cannot be started ({}); check its Python in the preferences.", error
            ) from error
        self.folder = folder
        """Its own, through which it is spoken to; gone when it has ended."""
        self.requests = Outbox(folder / REQUESTS)
        self.answers = Inbox(folder / ANSWERS)
        self._pulse = Pulse(folder / ANSWERS)
        self.ring(json.dumps(os.fspath(folder)).encode() + b"\n")

    @property
    def pid(self) -> int:
        """The system's number of the process."""
        return self.child.pid

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self.child.poll() is None

    def send(self, message: Message) -> None:
        """Send one message; a dead worker is no error here.

        ProtocolError when it cannot be one, SculptError when the disk has no room for it.
        """
        try:
            self.requests.put(message)
        except OSError as error:
            if not self.running:
                return
            raise SculptError(
                "The worker cannot be reached ({}); is there room on the disk of {}?",
                error,
                tempfile.gettempdir(),
            ) from error
        self.ring(b".")

    def take(self, seconds: float = math.inf) -> Message | Exit | None:
        """What the worker says next, None when it is silent; its Exit after all it said.

        None, too, when that takes longer than so many seconds: the next call goes on with it.
        """
        running = self.running  # asked first: what it said last is there then
        try:
            message = self.answers.take(seconds)
        except ProtocolError as error:
            self.child.kill()
            return self._end(str(error))
        if message is not None:
            self._pulse.silent = 0.0  # what it says is a sign of life, too
        silent = message is None and not self.answers.amid
        return self._end() if silent and not running else message

    def silent(self) -> float:
        """Seconds without a sign of life."""
        self._pulse.look()
        return self._pulse.silent

    def stop(self) -> None:
        """End the process, kindly and then not; it is gone afterwards."""
        self._end()

    def kill(self) -> None:
        """End the process at once, for it hears nothing."""
        self.child.kill()
        self._end()

    def _end(self, reason: str = "") -> Exit:
        assert self.child.stdin is not None
        self.child.stdin.close()
        try:
            code = self.child.wait(_GRACE)
        except subprocess.TimeoutExpired:
            self.child.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):  # a driver holds it
                self.child.wait(_GRACE)
            code = self.child.returncode or 0
        shutil.rmtree(self.folder, ignore_errors=True)
        tail = self._log_tail()
        return Exit(reason or exit_in_words(code, tail), tail)

    def ring(self, what: bytes) -> None:
        """So few bytes that they fit a pipe that nobody reads for a while."""
        assert self.child.stdin is not None
        with contextlib.suppress(OSError):  # it is dead, which `take` finds out
            self.child.stdin.write(what)

    def _log_tail(self) -> str:
        try:
            with self.log.open("rb") as file:
                file.seek(max(0, self.log.stat().st_size - _LOG_BYTES))
                lines = file.read().decode(errors="replace").splitlines()
        except OSError:
            return ""
        return "\n".join([line for line in lines if line.strip()][-_LOG_LINES:])
