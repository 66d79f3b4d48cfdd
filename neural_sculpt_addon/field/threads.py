# SPDX-License-Identifier: GPL-3.0-or-later
"""How work is shared by the processor's cores.

A pool of threads with one torch thread each does what comes in parts that fit the cache. A team is
torch's own threads, which wait for each other after every operation: quick for small operations in
a row, but when another program keeps a core busy all wait for the one that lost it, so a team that
notices this grows smaller.
"""

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np
import torch

from ..stroke.progress import Check, go_on

MOST = 8
NAME = "neural-sculpt-field"  # of the pool's threads
PIECE = 1024  # points at most; some 15 ms of work, after which a cancel is heard
SEARCHED = 128  # points whose nearest are searched: where much is as near, each takes up to 0.2 ms
SMALL = 64  # points that are not worth a second thread

WATCHED = 0.02  # seconds of work that tell whether a team had to wait
KEPT = 0.7  # part of the time of all cores of a team that it has when no other wants them
REST = 50  # such spells until a team that grew smaller is whole again

T = TypeVar("T")


class Team:
    """torch's threads for operations of the thread that enters it: half of the processor's, which
    leaves room for Blender, but two where there are as many.
    """

    def __enter__(self) -> "Team":
        self._before = torch.get_num_threads()
        self._rest = 0
        cores = os.cpu_count() or 1
        self._whole = min(cores, max(2, min(MOST, cores // 2)))
        self._be(self._whole)
        return self

    def __exit__(self, *_: object) -> None:
        torch.set_num_threads(self._before)

    def adapt(self) -> None:
        """Grow smaller when there was waiting since the last time. Call it every few ms."""
        wall, spent = time.perf_counter() - self._wall, time.process_time() - self._spent
        if wall < WATCHED:
            return
        self._rest -= 1
        if spent < KEPT * self._size * wall:
            self._rest = REST
            self._be(max(1, self._size // 2))
        else:
            self._be(self._whole if self._rest <= 0 else self._size)

    def _be(self, size: int) -> None:
        torch.set_num_threads(size)
        self._size, self._wall, self._spent = size, time.perf_counter(), time.process_time()


@cache
def threads() -> int:
    """How many threads the pool has."""
    return min(MOST, os.cpu_count() or 1)


@cache
def pool() -> ThreadPoolExecutor:
    """The one pool. Its tasks must not wait for tasks of their own."""
    return ThreadPoolExecutor(threads(), NAME, initializer=torch.set_num_threads, initargs=(1,))


def in_pool() -> bool:
    """Whether a task of the pool asks, which must do its parts by itself."""
    return threading.current_thread().name.startswith(NAME)


def in_pieces(
    task: Callable[[slice], T],
    count: int,
    check: Check = go_on,
    *,
    light: bool = False,
    size: int = PIECE,
) -> T:
    """What `task` makes of `count` points that do not depend on each other, a piece at a time.

    It returns arrays with a row for each point, or tuples of such, which are joined. `check` is
    called before each piece, of `size` points at most, and may raise.

    light: small steps of NumPy, or work that holds Python's lock: one thread does it as fast as two
    """
    check()
    if count <= min(size, SMALL):
        return task(slice(0, count))
    pieces = -(-count // size)  # the same ones whatever the number of threads
    parts = [slice(i * count // pieces, (i + 1) * count // pieces) for i in range(pieces)]
    done = []
    results = (task(part) for part in parts) if light else _spread(task, parts)
    with closing(results):
        for result in results:
            check()
            done.append(result)
    return join(done)


def _spread(task: Callable[[slice], T], parts: Sequence[slice]) -> Generator[T]:
    """What the pool's threads make of `parts`, in order.

    They are given no more than keeps them busy: whoever gives out hundreds at once waits for
    Python's lock after each, and hears no cancel meanwhile.
    """
    given: deque[Future[T]] = deque()
    try:
        for part in parts:
            given.append(pool().submit(task, part))
            if len(given) == 2 * threads():
                yield given.popleft().result()
        while given:
            yield given.popleft().result()
    finally:
        for one in given:
            one.cancel()


def join(parts: Sequence[T]) -> T:
    """Arrays, or tuples of arrays, one after another."""
    rows: Any = parts
    kind: Any = type(rows[0])
    if kind is np.ndarray:
        whole = np.concatenate(rows)
    else:
        columns = [join(column) for column in zip(*rows, strict=True)]
        whole = kind(columns) if kind is tuple else kind(*columns)
    return cast(T, whole)
