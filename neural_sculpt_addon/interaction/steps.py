# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps of some milliseconds, between which Blender can do other things: a generator yields
between two steps, and returns what it has made. NumPy alone.
"""

from collections.abc import Generator
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Made = TypeVar("Made")


def finish(steps: Generator[object, None, Made]) -> Made:
    """Take all steps; what they have made."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def counted(steps: Generator[object, None, Made], count: int) -> Generator[int, None, Made]:
    """The same steps, each of which yields a count of what it took."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        yield count


def sorting(numbers: NDArray[np.int32]) -> Generator[None, None, NDArray[np.intp]]:
    """The order of numbers (N,), at least 0, by size; NumPy sorts 16 bits at a time the fastest.
    Each half of 900,000 takes 5 ms."""
    order = np.argsort((numbers & 0xFFFF).astype(np.uint16), kind="stable")
    yield
    return order[np.argsort((numbers >> 16).astype(np.uint16)[order], kind="stable")]
