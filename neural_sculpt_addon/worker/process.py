# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of the worker: the child process, its pipes and the two threads that serve them.

NumPy and the standard library only. Whatever blocks (a full pipe, an empty one, the end of the
process) blocks a thread of this module and never its user, who only puts into one queue and takes
from another.
"""

import logging
import queue
import subprocess
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import cast

from ..stroke.errors import SculptError
from . import protocol
from .ending import exit_in_words
from .interpreter import clean_environ, no_window
from .protocol import Message, ProtocolError

_GRACE = 2.0  # seconds that a worker has to leave before it is killed
_LOG_LINES = 12
_LOG_BYTES = 8192

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Exit:
    """The end of a worker: why in a few words, and the last lines of its log."""

    reason: str
    log_tail: str


class WorkerProcess:
    """A running worker.

    incoming: what the worker says, in order; the last item is one Exit.
    """

    def __init__(self, command: Sequence[str], log: Path) -> None:
        """Start `command` with stderr into a fresh `log`. SculptError when that fails."""
        self.incoming: queue.SimpleQueue[Message | Exit] = queue.SimpleQueue()
        self._outgoing: queue.SimpleQueue[list[bytes] | None] = queue.SimpleQueue()
        self._log = log
        try:
            log.parent.mkdir(parents=True, exist_ok=True)
            with log.open("wb") as stderr:
                self._process = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=stderr,
                    env=clean_environ(),
                    creationflags=no_window(),
                )
        except OSError as error:
            raise SculptError(
                f"The worker cannot be started ({error}); check its Python in the preferences."
            ) from error
        self._threads = [
            threading.Thread(target=target, name=f"neural sculpt {target.__name__}", daemon=True)
            for target in (self._read, self._write)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def pid(self) -> int:
        """The system's number of the process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self._process.poll() is None

    def send(self, message: Message) -> None:
        """Queue one frame. ProtocolError when it cannot be one; a dead worker is no error here."""
        self._outgoing.put(protocol.encode(message))

    def stop(self) -> None:
        """End the process, kindly and then not; it is gone afterwards."""
        self.send(Message(protocol.ControlKind.STOP))
        self._outgoing.put(None)
        try:
            self._process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._process.wait()
        for thread in self._threads:
            thread.join(_GRACE)

    def _write(self) -> None:
        assert self._process.stdin is not None
        try:
            with self._process.stdin as stream:
                while (pieces := self._outgoing.get()) is not None:
                    stream.writelines(pieces)
                    stream.flush()
        except OSError:  # nobody reads any more; the reader finds out why
            logger.debug("the pipe to the worker is broken")

    def _read(self) -> None:
        reason = ""
        with cast(BufferedReader, self._process.stdout) as stream:
            try:
                while (message := protocol.read(stream)) is not None:
                    self.incoming.put(message)
            except ProtocolError as error:
                reason = str(error)
                self._process.kill()
        try:
            code = self._process.wait(_GRACE)
        except subprocess.TimeoutExpired:  # it closed its end and lives on: of no use
            self._process.kill()
            code = self._process.wait()
        self._outgoing.put(None)
        tail = self._log_tail()
        self.incoming.put(Exit(reason or exit_in_words(code, tail), tail))

    def _log_tail(self) -> str:
        try:
            with self._log.open("rb") as file:
                file.seek(max(0, self._log.stat().st_size - _LOG_BYTES))
                lines = file.read().decode(errors="replace").splitlines()
        except OSError:
            return ""
        return "\n".join([line for line in lines if line.strip()][-_LOG_LINES:])
