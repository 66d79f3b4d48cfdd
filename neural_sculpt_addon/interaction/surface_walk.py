# SPDX-License-Identifier: GPL-3.0-or-later
"""Closest points on a surface of triangles, found by walking on it from a triangle nearby, so that
what is found lies on the same side of a seam. NumPy alone.

    twins          the other side of each edge
    beside_seams   triangles from which a seam is near
    dense_samples  points all over the surface, by which a triangle nearby is found
    walk           from there to the closest point

A walk crosses the edge on which the closest point of its triangle lies, which never leads farther
away, and turns about a vertex in the same manner. It ends within a triangle, at a border or at a
seam. Corners are numbered through: 3 t + k is corner k of triangle t, and stands for the edge from
there to the next corner. All work is done in steps of some milliseconds.
"""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from .nearest_points import PART

Vectors = NDArray[np.float32]
Indices = NDArray[np.intp]

PIECE = 1024  # points that walk in a step
MOST_CROSSED = 64  # edges
MOST_TURNED = 10  # of them about one vertex: once, where six or so meet
MOST_SAMPLES = 1 << 20  # of `dense_samples`; where there would be more they are farther apart
SEAM = 1e-4
"""Jump of values across an edge, as a share of the largest one, that makes it a seam: far more than
rounding, and less than is seen."""


class Seams:
    """Edges that a walk does not cross: those at which values jump."""

    def __init__(self, values: Vectors) -> None:
        """values: (3 T, W) at the corners"""
        some = values[:: 1 + len(values) // PART]
        self._values, self._limit = values, SEAM * float(np.abs(some).max(initial=0))

    def cross(self, corner: Indices, twin: Indices) -> NDArray[np.bool_]:
        """Which edges (K,) are seams."""
        found = np.zeros(len(corner), bool)
        for one, other in ((corner, _next(twin)), (_next(corner), twin)):
            jump = np.abs(self._values[one] - self._values[other])
            found |= ~(jump <= self._limit).all(axis=1)
        return found


def twins(triangles: NDArray[np.int32]) -> Generator[None, None, Indices]:
    """The number (3 T,) of the same edge in the other of its two triangles (T, 3); -1 where there
    is none, there are more, or that one is turned over."""
    start = triangles.ravel()
    end = triangles[:, [1, 2, 0]].ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    yield
    order = np.arange(len(start))
    for key in (high, low):
        for shift in (0, 16):
            digits = (key >> shift).astype(np.uint16)
            if shift == 0 or digits.any():
                order = order[np.argsort(digits[order], kind="stable")]
            yield
    low, high = low[order], high[order]
    same = (low[1:] == low[:-1]) & (high[1:] == high[:-1])
    yield
    alone = same & ~np.append(same[1:], False) & ~np.append(False, same[:-1])
    first = np.flatnonzero(alone)
    one, other = order[first], order[first + 1]
    turned = start[one] == start[other]
    one, other = one[~turned], other[~turned]
    found = np.full(len(start), -1)
    found[one], found[other] = other, one
    return found


def beside_seams(
    triangles: NDArray[np.int32], edges: Indices, seams: Seams
) -> Generator[None, None, NDArray[np.bool_]]:
    """Which triangles (T,) have a vertex on a seam; `edges` are their twins."""
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    on_seam = np.zeros(int(start.max(initial=-1)) + 1, bool)
    for begin in range(0, len(edges), PART):
        corner = np.arange(begin, min(begin + PART, len(edges)))
        corner = corner[edges[corner] > corner]  # once each
        crossed = corner[seams.cross(corner, edges[corner])]
        on_seam[start[crossed]] = on_seam[end[crossed]] = True
        yield
    return on_seam[triangles].any(axis=1)


def dense_samples(
    positions: Vectors, triangles: NDArray[np.int32], spacing: float
) -> Generator[None, None, tuple[Vectors, Indices]]:
    """Points (S, 3) on a surface, and the triangle (S,) of each: first the middles of all, then,
    where triangles are longer than twice the spacing, those of their parts."""
    middles, longest = np.empty((len(triangles), 3), np.float32), np.empty(len(triangles))
    for start in range(0, len(triangles), PART):
        part = slice(start, start + PART)
        a, b, c = (positions.take(corner, axis=0) for corner in triangles[part].T)
        middles[part] = (a + b + c) / np.float32(3)
        yield
        sides = [((one - other) ** 2).sum(axis=1) for one, other in ((a, b), (b, c), (c, a))]
        longest[part] = np.sqrt(np.maximum.reduce(sides))
        yield
    points, owners = [middles], [np.arange(len(triangles))]
    long = np.flatnonzero(longest > 2 * spacing)
    if len(long):
        parts = np.ceil(np.log2(longest[long] / spacing)).clip(1, 8).astype(int)  # halvings
        while (4.0**parts).sum() > MOST_SAMPLES:
            parts = np.maximum(parts - 1, 0)
        for halvings in np.unique(parts[parts > 0]).tolist():
            grid = _middles_of_parts(1 << halvings)
            some, size = long[parts == halvings], max(PART // len(grid), 1)
            for start in range(0, len(some), size):
                chosen = some[start : start + size]
                corners = positions[triangles[chosen]]  # (K, 3, 3)
                points.append((grid @ corners).reshape(-1, 3).astype(np.float32))
                owners.append(np.repeat(chosen, len(grid)))
                yield
    return np.concatenate(points), np.concatenate(owners)


def walk(
    points: Vectors,
    start: Indices,
    positions: Vectors,
    triangles: NDArray[np.int32],
    edges: Indices,
    seams: Seams | None = None,
) -> Generator[None, None, tuple[Indices, Vectors]]:
    """The triangle (P,) in which a walk from `start` (P,) to `points` (P, 3) ends, and the weights
    (P, 3) of its corners at the closest point; one of them is exactly 1 at a corner.

    positions, triangles: (V, 3), (T, 3) of the surface
    edges:                its `twins`
    """
    found, weights = start.copy(), np.empty((len(points), 3), np.float32)
    for begin in range(0, len(points), PIECE):
        part = slice(begin, begin + PIECE)
        to, surface = points[part].astype(float), (positions, triangles, edges, seams)
        triangle, weight, away = _one_way(to, start[part], 1, *surface)
        left = np.flatnonzero((weight == 0).any(axis=1) & (away > 0))
        if len(left):
            other, other_weight, other_away = _one_way(to[left], start[part][left], -1, *surface)
            nearer = other_away < away[left]
            triangle[left[nearer]] = other[nearer]
            weight[left[nearer]] = other_weight[nearer]
        found[part], weights[part] = triangle, weight
        yield
    return found, weights


def _one_way(
    points: NDArray[np.float64],
    start: Indices,
    side: int,
    positions: Vectors,
    triangles: NDArray[np.int32],
    edges: Indices,
    seams: Seams | None,
) -> tuple[Indices, NDArray[np.float64], NDArray[np.float64]]:
    """The triangle (P,), weights (P, 3) and squared distance (P,) at which walks end that turn
    about vertices to one side, 1 or -1."""
    triangle, came = start.copy(), np.full(len(start), -1)
    weights, away = _closest(points, positions[triangles[triangle]])
    walking, turned = np.arange(len(points)), np.zeros(len(points), int)
    for _ in range(MOST_CROSSED):
        goes = (weights[walking] == 0).any(axis=1) & (away[walking] > 0)
        walking = walking[goes & (turned[walking] < MOST_TURNED)]
        if not len(walking):
            break
        open_edges = np.roll(weights[walking] == 0, -2, axis=1)  # those opposite to such corners
        back = np.flatnonzero(came[walking] >= 0)
        open_edges[back, came[walking[back]]] = False
        score = open_edges + 1 * (open_edges & np.roll(open_edges, side, axis=1))
        corner = 3 * triangle[walking] + score.argmax(axis=1)
        across = edges[corner]
        goes = score.any(axis=1) & (across >= 0)
        if seams is not None:
            goes[goes] = ~seams.cross(corner[goes], across[goes])
        walking, across = walking[goes], across[goes]
        triangle[walking], came[walking] = across // 3, across % 3
        before = away[walking]
        weights[walking], away[walking] = _closest(
            points[walking], positions[triangles[triangle[walking]]]
        )
        turned[walking] = np.where(away[walking] < before, 0, turned[walking] + 1)
    return triangle, weights, away


def _closest(
    points: NDArray[np.float64], corners: Vectors
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The weights (P, 3) of the point of each triangle (P, 3, 3) closest to `points` (P, 3), and
    its squared distance (P,). (Ericson, Real-Time Collision Detection, 5.1.5.)"""
    a, b, c = corners.astype(float).transpose(1, 0, 2)
    ab, ac = b - a, c - a
    d1, d2 = _dot(ab, points - a), _dot(ac, points - a)
    d3, d4 = _dot(ab, points - b), _dot(ac, points - b)
    d5, d6 = _dot(ab, points - c), _dot(ac, points - c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    zero, one = np.zeros(len(points)), np.ones(len(points))
    with np.errstate(divide="ignore", invalid="ignore"):
        on_ab, on_ac = d1 / (d1 - d3), d2 / (d2 - d6)
        on_bc = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        second, third = vb / (va + vb + vc), vc / (va + vb + vc)
    regions = (
        ((d1 <= 0) & (d2 <= 0), one, zero, zero),
        ((d3 >= 0) & (d4 <= d3), zero, one, zero),
        ((d6 >= 0) & (d5 <= d6), zero, zero, one),
        ((vc <= 0) & (d1 >= 0) & (d3 <= 0), 1 - on_ab, on_ab, zero),
        ((vb <= 0) & (d2 >= 0) & (d6 <= 0), 1 - on_ac, zero, on_ac),
        ((va <= 0) & (d4 >= d3) & (d5 >= d6), zero, 1 - on_bc, on_bc),
    )
    inside, *known = zip(*regions, strict=True)
    within = 1 - second - third, second, third
    u, v, w = (
        np.nan_to_num(np.select(inside, values, other))
        for values, other in zip(known, within, strict=True)
    )
    gap = a + v[:, None] * ab + w[:, None] * ac - points
    return np.stack([u, v, w], axis=1), np.nan_to_num(_dot(gap, gap))


def _middles_of_parts(count: int) -> NDArray[np.float32]:
    """Barycentric coordinates (count^2, 3) of the middles of the parts of a triangle whose sides
    are cut into `count` each."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(count), np.arange(count), indexing="ij"))
    upright, turned = i + j < count, i + j < count - 1
    first = np.concatenate([i[upright] + 1 / 3, i[turned] + 2 / 3])
    second = np.concatenate([j[upright] + 1 / 3, j[turned] + 2 / 3])
    return (np.stack([count - first - second, first, second], axis=1) / count).astype(np.float32)


def _next(corner: Indices) -> Indices:
    """The next corner (K,) of the same triangle."""
    return corner - corner % 3 + (corner + 1) % 3


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return (a * b).sum(axis=1)
