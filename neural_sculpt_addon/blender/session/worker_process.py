# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's one worker process, and which bytes of fields it has.

Bytes go to a process once, by their id; a worker that lacks some says so and gets all again.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np

from ...common.errors import SculptError
from ...worker.client import Client, JobKind, Message, WorkerState
from ..folders import log_file
from .job import Request


class Worker:
    """No process, or one."""

    def __init__(self) -> None:
        """No worker is started yet."""
        self.client: Client | None = None
        self._held: set[str] = set()  # ids of bytes that it has

    @property
    def alive(self) -> bool:
        """Whether there is a process to have jobs done."""
        return self.client is not None and self.client.alive

    @property
    def state(self) -> WorkerState:
        """The worker's state as of the last poll."""
        return WorkerState.STOPPED if self.client is None else self.client.state

    @property
    def hangs(self) -> bool:
        """Whether it gives no sign of life."""
        return self.state is WorkerState.HANGING

    def start(self, command: Sequence[str]) -> None:
        """Start another process, which has no bytes. SculptError when it cannot be started."""
        client = Client(command, log_file())
        client.start()
        self.client = client
        self._held.clear()

    def end(self) -> None:
        """End the process; a last poll tells the ends of its jobs."""
        if self.client is not None:
            self.client.stop()

    def stop(self) -> None:
        """End the process; nobody hears of its jobs any more."""
        self.end()
        self.client = None

    def give_up(self) -> None:
        """End a process that hangs: its jobs end as those of one that died."""
        if self.client is not None:
            self.client.give_up()

    def send(self, kind: JobKind, request: Request) -> int:
        """Let it have a job, and those bytes that it does not have; the job's number.

        WorkerGoneError when it has ended just now.
        """
        assert self.client is not None
        arrays = dict(request.arrays)
        for name, read in request.held.items():
            if name not in self._held:
                arrays[name] = np.frombuffer(read(), np.uint8)
        number = self.client.submit(kind, request.fields, arrays)
        self._held.update(request.held)
        return number

    def poll(self) -> list[Message]:
        """The messages that the worker has sent since the last call."""
        return [] if self.client is None else self.client.poll_once()

    def cancel(self, number: int) -> None:
        """Let it stop a job. Where the disk has no room to tell it, it goes on in vain."""
        if self.client is not None:
            with suppress(SculptError):
                self.client.cancel(number)

    def settle(self, number: int) -> None:
        """Let it end a job with what it has."""
        if self.client is not None:
            self.client.settle(number)

    def keep(self, result: Message) -> None:
        """Note the bytes that it made."""
        self._held.update(_ids(result))

    def forget(self) -> None:
        """Send all bytes again, for the worker has lost some."""
        self._held.clear()


def _ids(result: Message) -> Iterator[str]:
    fields = result.fields
    yield from (fields[name] for name in ("id", "base", "layer") if name in fields)
    yield from (layer["id"] for layer in fields.get("layers", ()))
