# SPDX-License-Identifier: GPL-3.0-or-later
"""A fork server: workers come from a process that has loaded everything, each in milliseconds.

`ForkServer.start` takes the place of `common.child.start_logged`. What it starts is the
worker's own `server.main`, as the process that subprocess would have started: with its number, its
pipe, its log, and an exit code of its own. One lives at a time. A worker that finds a file DIE
beside its folders kills itself in the midst of its next result with arrays: the file says after
which share of the bytes. One that finds a file FULL fills a disk before one of its messages: the
file has the number of the message, and the disk.
"""

import gc
import linecache
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import workshop  # noqa: F401 - makes the package importable

from reliability import disk

DIE, FULL = "die", "full"


class Forked:
    """As much of a subprocess.Popen as `worker.process` asks for."""

    def __init__(self, pid: int, stdin: BinaryIO, told: socket.socket) -> None:
        """The fork server tells the exit code through `told`."""
        self.pid, self.stdin, self._told = pid, stdin, told
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """The exit code, negative for a signal; None while it runs."""
        return self._look(0)

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code; TimeoutExpired."""
        if (code := self._look(timeout)) is None:
            raise subprocess.TimeoutExpired("worker", timeout or 0)
        return code

    def kill(self) -> None:
        """SIGKILL."""
        if self.poll() is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def _look(self, timeout: float | None) -> int | None:
        if self.returncode is None and select.select([self._told], [], [], timeout)[0]:
            self.returncode = int(self._told.recv(16))
            self._told.close()
        return self.returncode


class ForkServer:
    """A process that forks workers; it ends with its owner, or when it is closed."""

    def __init__(self, python: str, kind: str = "torch") -> None:
        """kind: `torch`, or `bare` for workers without it, which refuse every job"""
        self._asked, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen([python, "-u", __file__, kind], stdin=theirs.fileno())

    def start(self, _command: Sequence[str], log: BinaryIO) -> Forked:
        """Fork a worker; what it prints goes into `log`."""
        told, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        read, write = os.pipe()
        with theirs, open(read, "rb"):
            socket.send_fds(self._asked, [b"."], [theirs.fileno(), read, log.fileno()])
        return Forked(int(told.recv(16)), open(write, "wb", buffering=0), told)

    def close(self) -> None:
        """End it, after its worker."""
        self._asked.close()
        self._process.wait()


def main() -> None:
    """Fork workers one after another, until nobody is there to ask for one."""
    from neural_sculpt_addon.worker import mailbox, protocol, runtime
    from neural_sculpt_addon.worker.server import server

    runtime.set_up()
    bare = sys.argv[1] == "bare"
    if not bare:
        import torch

        torch.set_num_threads(1)
        server.warm_up()
    for module in (mailbox, protocol, server):  # whose lines a worker's last words quote
        linecache.getlines(str(module.__file__))
    gc.freeze()  # or a worker's first collection copies the pages of all that is loaded
    asked = socket.socket(fileno=0)
    while True:
        word, descriptors, _, _ = socket.recv_fds(asked, 1, 3)
        if not word:
            return
        told = socket.socket(fileno=descriptors[0])
        pid = os.fork()
        if pid == 0:
            _work(descriptors[1], descriptors[2], bare)
        told.send(str(pid).encode())
        for descriptor in descriptors[1:]:
            os.close(descriptor)
        _, status = os.waitpid(pid, 0)
        with told, suppress(OSError):
            told.send(str(os.waitstatus_to_exitcode(status)).encode())


def _work(bell: int, log: int, bare: bool) -> NoReturn:
    """Be a worker."""
    from neural_sculpt_addon.worker import mailbox, protocol
    from neural_sculpt_addon.worker.server import server

    try:
        os.dup2(bell, 0)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.closerange(3, 20)
        put = mailbox.Outbox.put

        def put_after_fault(self: mailbox.Outbox, message: protocol.Message) -> None:
            _die(self, message)
            _fill(self)
            put(self, message)

        mailbox.Outbox.put = put_after_fault
        if bare:
            server.take_over().serve(server.refusing("There is no torch."), {"device": ""})
        server.main("cpu")
    finally:
        os._exit(70)


def _die(outbox: Any, message: Any) -> None:
    """Write a part of a result, and be killed, if that is asked for."""
    from neural_sculpt_addon.worker import protocol

    marker = outbox.folder.parent / DIE
    if message.kind is protocol.MessageKind.RESULT and message.arrays and marker.exists():
        frame = b"".join(protocol.pieces(message))
        (outbox.folder / "part").write_bytes(frame[: int(float(marker.read_text()) * len(frame))])
        os.kill(os.getpid(), signal.SIGKILL)


def _fill(outbox: Any) -> None:
    """Fill a disk, if that is asked for and it is time."""
    marker = outbox.folder.parent / FULL
    if marker.exists():
        number, folder = marker.read_text().split(" ", 1)
        if int(number) == outbox.count:
            disk.fill(Path(folder))


if __name__ == "__main__":
    main()
