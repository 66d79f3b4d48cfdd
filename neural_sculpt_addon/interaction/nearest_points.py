# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest of many points, for points most of which are among them: the vertices of a proxy
before and after a change. NumPy alone.

The search runs in steps of some milliseconds, between which Blender can do other things. 140,000
points take 0.3 s in all when none is among the others, 35 ms when all but 2,000 are.
"""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from .steps import finish, sorting

Vectors = NDArray[np.float32]
Indices = NDArray[np.intp]
Steps = Generator[None, None, Indices]
"""Yields between two steps, and returns what was found."""

PART = 65536  # points that are compared in a step
PIECE = 2048  # points whose neighbours are looked for in a step,
CANDIDATES = 1 << 16  # and neighbours at most, about
FIRST_CELLS = 2.0  # usual spacings: the first cells in which neighbours are looked for
MOST_CELLS = 1024  # along an axis
WALK = 8  # from neighbour to neighbour
MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)  # odd
SLOTS = 21  # bits: of the table of equal points, which lacks one in a hundred or two
LOWEST_BITS = 64 - SLOTS, 64 - 2 * SLOTS  # lowest bits of a key that are its slot, in turn


def nearest(points: Vectors, among: Vectors) -> Indices:
    """The numbers (P,) of the nearest of `among` (N, 3), at least one, to `points` (P, 3), at once.
    See `search`."""
    return finish(search(points, among))


def search(points: Vectors, among: Vectors) -> Steps:
    """The numbers (P,) of the nearest of `among` (N, 3), at least one, to finite `points` (P, 3).

    A point that is farther from all of them than these usually are from each other gets one that is
    nearer than its own neighbours, which may not be the nearest of all. For such a point the search
    doubles its reach and skips three of four, until it finds one, and so costs the same at any
    distance; then it goes on from neighbour to neighbour while that is nearer.
    """
    found = yield from _equal(points, among)
    left = np.flatnonzero(found < 0)
    if len(left):
        known = np.flatnonzero(np.isfinite(among).all(axis=1))
        some = among if len(known) == len(among) else among[known]
        yield
        if len(some):
            found[left] = known[(yield from _search(points[left], some))]
        else:
            found[left] = 0
    return found


def _search(points: Vectors, among: Vectors) -> Steps:
    """`search` for points that equal none of `among`, in pieces."""
    finest = FIRST_CELLS * _spacing(among)
    found = yield from _within(points, points, among, finest, finest / 2)
    far = left = np.flatnonzero(found < 0)
    size, every = finest, 1
    while len(left):
        size, every = 2 * size, 4 * every
        some = yield from _within(points[left], points[left], among[::every], size, size / 2)
        found[left] = np.where(some < 0, -1, every * some)
        left = left[found[left] < 0]
    for _ in range(WALK):
        if not len(far):
            break
        nearer = yield from _within(points[far], among[found[far]], among, finest, np.inf)
        walks = nearer != found[far]
        far = far[walks]
        found[far] = nearer[walks]
    return found


def _equal(points: Vectors, among: Vectors) -> Steps:
    """The numbers (P,) of equal points `among` (N, 3), -1 where none is found.

    Before the first difference of both arrays, and after the last one, rows are equal in pairs.
    """
    count = min(len(points), len(among))
    same = _same(points[:count], among[:count])
    head = count if same.all() else int(same.argmin())
    yield
    same = _same(points[len(points) - count + head :], among[len(among) - count + head :])
    tail = len(same) if same.all() else int(same[::-1].argmin())
    found = np.arange(len(points))
    found[head:] += len(among) - len(points)
    found[head : len(points) - tail] = -1
    yield
    for lowest in LOWEST_BITS:
        table = np.zeros(1 << SLOTS, np.int32)
        for start in range(head, len(among) - tail, PART):
            end = min(start + PART, len(among) - tail)
            table[_slots(among[start:end], lowest)] = np.arange(start, end)
            yield
        for start in range(head, len(points) - tail, PART):
            part = np.arange(start, min(start + PART, len(points) - tail))
            part = part[found[part] < 0]
            match = table[_slots(points[part], lowest)]
            equal = _same(points[part], among[match])
            found[part[equal]] = match[equal]
            yield
    return found


def _spacing(points: Vectors) -> float:
    """The usual distance of neighbours, as if (N, 3) lay on the box around them."""
    box = np.ptp(points[:: 1 + len(points) // 4096], axis=0).astype(float)
    area = 2 * (box * np.roll(box, 1)).sum()
    return max(float(np.sqrt(area / len(points))), float(box.max()) / len(points), 1e-6)


def _same(points: Vectors, others: Vectors) -> NDArray[np.bool_]:
    """Which (N,) are equal, one by one."""
    x, y, z = (points == others).T
    return x & y & z


def _box(points: Vectors) -> tuple[Vectors, Vectors]:
    """The lowest and highest coordinates (3,); one axis after the other is five times as fast."""
    return np.stack([x.min() for x in points.T]), np.stack([x.max() for x in points.T])


def _slots(points: Vectors, lowest: int) -> Indices:
    """The places (N,) in a table of points, the same for equal ones."""
    bits = np.ascontiguousarray(points, np.float32).view(np.uint32)
    x, y, z = (axis * factor for axis, factor in zip(bits.T, MIX, strict=True))
    key = (x + y + z) >> np.uint64(lowest)
    return (key & np.uint64((1 << SLOTS) - 1)).astype(np.intp)


def _within(points: Vectors, places: Vectors, among: Vectors, size: float, reach: float) -> Steps:
    """The numbers (P,) of the points `among` nearest to `points` (P, 3), -1 where none is in reach.

    Looked at are the eight cells of that size around `places` (P, 3).
    """
    found = np.full(len(points), -1)
    low, high = _box(places)
    yield
    bounds = zip(among.T, low - size, high + size, strict=True)
    x, y, z = ((axis > a) & (axis < b) for axis, a, b in bounds)
    near = np.flatnonzero(x & y & z)
    yield
    if len(near):
        cells = yield from _Cells.sorting(among, near, size)
        for start in range(0, len(points), PIECE):
            part = slice(start, start + PIECE)
            found[part] = yield from cells.nearest(points[part], places[part], reach)
    return found


class _Cells:
    """Points sorted into the cells of a grid."""

    def __init__(self, among: Vectors, size: float) -> None:
        self._among, self._size = among, size
        self._low, self._shape = np.zeros(3, np.float32), np.full(3, 2)
        self._number, self._near = np.empty(0, np.int32), np.empty(0, np.intp)

    @classmethod
    def sorting(cls, among: Vectors, near: Indices, size: float) -> "Generator[None, None, _Cells]":
        """Sort `near` (M,), the numbers of points, into cells of that size, or a larger one where
        they would be too many."""
        points = among.take(near, axis=0)
        low, high = _box(points)
        cells = cls(among, max(size, float((high - low).max()) / MOST_CELLS))
        cells._low = low
        cells._shape = ((high - low) / cells._size).astype(np.intp) + 2
        yield
        number = cells._linear(((points - low) / np.float32(cells._size)).astype(np.int32))
        yield
        order = yield from sorting(number)
        cells._number, cells._near = number[order], near[order]
        yield
        return cells

    def nearest(self, points: Vectors, places: Vectors, reach: float) -> Steps:
        """The numbers (P,) of the points nearest to `points` (P, 3), -1 where none is in reach.

        Looked at are the eight cells around `places` (P, 3), or others where these are beyond all
        cells.
        """
        first = np.floor((places - self._low) / self._size - 0.5)
        first = np.clip(first, 0, self._shape - 2).astype(np.int32)  # (P, 3)
        columns = first[:, None] + np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], np.int32)
        cell = self._linear(columns.reshape(-1, 3))  # (4 P,), of two each
        ends = (np.searchsorted(self._number, c) for c in (cell, cell + np.int32(2)))
        start, end = (each.reshape(-1, 4) for each in ends)  # (P, 4)
        total = np.cumsum((end - start).sum(axis=1))
        found = np.full(len(points), -1)
        breaks = np.flatnonzero(np.diff(total // CANDIDATES)) + 1
        for part in np.split(np.arange(len(points)), breaks):
            found[part] = self._nearest(points[part], start[part], end[part], reach)
            yield
        return found

    def _nearest(self, points: Vectors, start: Indices, end: Indices, reach: float) -> Indices:
        """The numbers (P,) of those nearest to `points` (P, 3) in rows `start` to `end` (P, 4)."""
        start, count = start.ravel(), (end - start).ravel()
        owner = np.repeat(np.repeat(np.arange(len(points)), 4), count)  # (Q,), rising
        skipped = np.repeat(start - (np.cumsum(count) - count), count)
        candidate = self._near[np.arange(len(owner)) + skipped]
        away = ((points[owner] - self._among[candidate]) ** 2).sum(axis=1)
        least = np.full(len(points), np.inf, np.float32)
        begins = np.flatnonzero(np.diff(owner, prepend=-1))
        if len(begins):
            least[owner[begins]] = np.minimum.reduceat(away, begins)
        best = (away == least[owner]) & (away <= reach**2)
        found = np.full(len(points), -1)
        found[owner[best]] = candidate[best]
        return found

    def _linear(self, cells: NDArray[np.int32]) -> NDArray[np.int32]:
        """Numbers (N,) of cells (N, 3); the last axis runs fastest."""
        _, rows, columns = self._shape.tolist()
        x, y, z = cells.T
        return (x * np.int32(rows) + y) * np.int32(columns) + z
