# SPDX-License-Identifier: GPL-3.0-or-later
"""A concave polygon as triangles, by clipping one ear after another.

An ear is a triangle of three corners in a row that turns the way of the polygon and holds no other
corner (Meisters, "Polygons have ears", 1975). The polygon is looked at along its normal, which is
Newell's. It may touch itself, as one whose holes are joined to its outline by bridges. One that
crosses itself has triangles, too, but no right ones.
"""

from bisect import bisect_left, bisect_right
from collections import deque
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

ROUNDING = 1e-15  # of the polygon's extent squared: a turn of less is none, or straight


def clipped(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The triangles (N - 2, 3) of a polygon with corners `points` (N, 3), N at least 3.

    The time grows with the corners that lie beside an ear: up to ten seconds for 30,000 of them."""
    return _Outline(_flattened(points)).triangles()


def _flattened(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the corners (N, 2) lie in the polygon's plane, seen so that it turns left."""
    offsets = points - points[0]
    normal = np.cross(offsets, np.roll(offsets, -1, axis=0)).sum(axis=0)
    across = np.eye(3)[np.abs(normal).argmin()]
    first = np.cross(across, normal)
    second = np.cross(normal, first)
    axes = [axis / (np.linalg.norm(axis) or 1.0) for axis in (first, second)]
    return np.stack([(offsets * axis).sum(axis=1) for axis in axes], axis=1)


class _Outline:
    """What is left of a polygon, as a ring of corners, and those that can lie within an ear."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        count = len(points)
        self.x, self.y = points[:, 0].tolist(), points[:, 1].tolist()
        self.before = [count - 1, *range(count - 1)]
        self.after = [*range(1, count), 0]
        self.slack = ROUNDING * float(np.ptp(points, axis=0).max()) ** 2
        turns = np.array([self._turn(corner) for corner in range(count)])
        order = np.argsort(points[:, 0], kind="stable")
        order = order[turns[order] <= self.slack]
        self.place = dict(zip(order.tolist(), range(len(order)), strict=True))
        self.hollow = points[order]  # (H, 2), by x: where the outline does not turn left
        self.hollow_x = self.hollow[:, 0].tolist()
        self.stands = np.ones(len(order), bool)  # (H,), those that are not clipped and still do not

    def triangles(self) -> NDArray[np.int64]:
        """Ears until nothing is left; a fan of what has none."""
        found = list[tuple[int, int, int]]()
        left, corners = len(self.x), list(range(len(self.x)))
        for strict in (True, False):
            waiting, entries = deque(corners), [1] * len(self.x)
            while waiting and left > 3:
                corner = waiting.popleft()
                entries[corner] -= 1
                if entries[corner] or not self._is_ear(corner, strict):
                    continue
                left -= 1
                before, after = self._clip(corner)
                found.append((before, corner, after))
                for beside in (before, after):
                    waiting.append(beside)
                    entries[beside] += 1
            clipped = {corner for _, corner, _ in found}
            corners = [corner for corner in corners if corner not in clipped]
        fan = pairwise(corners[1:])
        return np.array([*found, *((corners[0], *edge) for edge in fan)], np.int64)

    def _clip(self, corner: int) -> tuple[int, int]:
        """Take a corner away; its neighbours."""
        before, after = self.before[corner], self.after[corner]
        self.after[before], self.before[after] = after, before
        for each in (corner, before, after):
            place = self.place.get(each)
            if place is not None and (each == corner or self._turn(each) > self.slack):
                self.stands[place] = False
        return before, after

    def _turn(self, corner: int) -> float:
        """Twice the area of a corner and its neighbours, positive where the outline turns left."""
        x, y, a, c = self.x, self.y, self.before[corner], self.after[corner]
        edge = x[corner] - x[a], y[corner] - y[a]
        return edge[0] * (y[c] - y[corner]) - edge[1] * (x[c] - x[corner])

    def _is_ear(self, corner: int, strict: bool) -> bool:
        """Whether a corner's triangle turns left and holds no other corner, on its edges neither.

        not strict: it may be flat and have corners on its edges."""
        slack = self.slack if strict else -self.slack
        if self._turn(corner) <= slack:
            return False
        ring = (self.before[corner], corner, self.after[corner])
        xs, ys = [self.x[each] for each in ring], [self.y[each] for each in ring]
        near = slice(bisect_left(self.hollow_x, min(xs)), bisect_right(self.hollow_x, max(xs)))
        inside = self.stands[near].copy()
        if not inside.any():
            return True
        x, y = self.hollow[near].T
        for a, b in ((0, 1), (1, 2), (2, 0)):
            inside &= (xs[b] - xs[a]) * (y - ys[a]) - (ys[b] - ys[a]) * (x - xs[a]) >= -slack
            inside &= (x != xs[a]) | (y != ys[a])
        return not inside.any()
