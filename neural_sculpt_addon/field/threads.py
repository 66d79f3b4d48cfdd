# SPDX-License-Identifier: GPL-3.0-or-later
"""A pool of threads, and maps over parts of work on it.

Every thread has one torch thread: torch's own threads wait for each other after every operation.
How work is divided depends on its size alone, so any number of cores gives the same bits.
"""

import os
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, contextmanager
from contextvars import copy_context
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np
import torch

from ..common.progress import Check, go_on

MOST_THREADS = 8
THREAD_NAME = "neural-sculpt-field"  # of the pool's threads
PIECE = 2048  # points at most; some 30 ms of work, after which a cancel is heard
SEARCHED = 1024  # points whose nearest are searched: mostly 1 ms, and 0.2 s where much is as near
SMALL_WORK = 64  # points that are not worth a second thread

S = TypeVar("S")
T = TypeVar("T")


@contextmanager
def one_thread() -> Iterator[None]:
    """One torch thread for the thread that enters, as those of the pool have."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@cache
def threads() -> int:
    """How many threads the pool has."""
    return min(MOST_THREADS, os.cpu_count() or 1)


@cache
def pool() -> ThreadPoolExecutor:
    """The one pool. Its tasks must not wait for tasks of their own."""
    return ThreadPoolExecutor(
        threads(), THREAD_NAME, initializer=torch.set_num_threads, initargs=(1,)
    )


def in_pool() -> bool:
    """Whether a task of the pool asks, which must do its parts by itself."""
    return threading.current_thread().name.startswith(THREAD_NAME)


def submit(task: Callable[[S], T], part: S) -> Future[T]:
    """Have a thread of the pool do a part, which is interrupted as its caller is."""
    return pool().submit(copy_context().run, task, part)


def parallel(task: Callable[[S], T], parts: Iterable[S]) -> list[T]:
    """What the pool's threads make of `parts`, in order. A single one is not worth handing over."""
    parts = list(parts)
    if in_pool() or (len(parts) == 1 and torch.get_num_threads() == 1):
        return [task(part) for part in parts]
    return list(_ahead(task, parts))


def shares(count: int, size: int) -> list[slice]:
    """`count` points in equal parts of `size` at most. Their number is even where there are more
    points than PIECE: of three parts two threads do two and one, and one of them waits."""
    parts = -(-count // size)
    if count > PIECE:
        parts += parts % 2
    return [slice(i * count // parts, (i + 1) * count // parts) for i in range(parts)]


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
    if count <= min(size, SMALL_WORK):
        return task(slice(0, count))
    parts = shares(count, size)
    done = []
    results = (task(part) for part in parts) if light else _ahead(task, parts)
    with closing(results):
        for result in results:
            check()
            done.append(result)
    return join(done)


def _ahead(task: Callable[[S], T], parts: Sequence[S]) -> Generator[T]:
    """What the pool's threads make of `parts`, in order, with few of them given out ahead.

    Whoever gives out hundreds at once waits for Python's lock after each, and hears no cancel.
    """
    given: deque[Future[T]] = deque()
    try:
        for part in parts:
            given.append(submit(task, part))
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
