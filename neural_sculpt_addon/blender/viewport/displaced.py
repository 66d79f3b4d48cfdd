# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh with strokes displaced on it at once, as a preview: p' = p + d n.

The path of a stroke is laid on the mesh by its nearest vertices and their tangent planes, an error
of second order in the size of a triangle. Only what lies near the path is touched: at 100,000
triangles a stroke takes some 6 ms. NumPy alone; model space.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...stroke.curve import Array, arc_length, fit_curve
from ...stroke.displacement import displace
from ...stroke.path import Path, make_path
from ...stroke.stroke import Kind, Stroke

Vectors = NDArray[np.float32]
Triangles = NDArray[np.int32]

LEAST, MOST = 48, 512  # points of a path
CELLS = 3  # of the grid, in the reach of a stroke
MOST_CELLS = 96  # along an axis


class Displaced:
    """Vertices (V, 3) of triangles (F, 3), wound outward, and the strokes that displace them."""

    def __init__(self, positions: Vectors, triangles: Triangles) -> None:
        """Nothing is displaced yet."""
        self.strokes: tuple[Stroke, ...] = ()
        self._triangles = triangles
        self._positions = positions.copy()
        self._normals = np.zeros_like(positions)
        self._touched = np.zeros(len(positions), bool)

    @property
    def vertices(self) -> NDArray[np.intp]:
        """The vertices (M,) that strokes came near to."""
        return np.flatnonzero(self._touched)

    @property
    def positions(self) -> Vectors:
        """Where those are now (M, 3)."""
        return self._positions[self._touched]

    @property
    def normals(self) -> Vectors:
        """Their unit normals (M, 3) there."""
        return self._normals[self._touched]

    def add(self, stroke: Stroke) -> None:
        """Displace by one more stroke and its images; other kinds show when done.

        Where images overlap, the larger displacement wins.
        """
        self.strokes += (stroke,)
        if stroke.kind is not Kind.DRAW:
            return
        drawn = _path_points(stroke)  # (N, 3)
        copies = [(copy, drawn @ copy.image.T) for copy in stroke.copies()]
        reach = stroke.brush.radius * stroke.largest_factor + arc_length(drawn)[-1] / len(drawn)
        within = _within(self._positions, np.concatenate([points for _, points in copies]), reach)
        if not within.any():
            return
        a, b, c = self._triangles.T
        around = self._triangles[within.take(a) | within.take(b) | within.take(c)]  # (T, 3)
        used = np.zeros(len(within), bool)
        used[around.ravel()] = True
        chosen = np.flatnonzero(used)  # (M,), all else is as if it were not there
        place = np.empty(len(within), np.int32)
        place[chosen] = np.arange(len(chosen))
        corners = place[around]  # (T, 3)
        moving, near = self._positions[chosen].astype(float), within[chosen]
        moving[near] += _shift(copies, reach, moving[near], _normals(moving, corners)[near])
        self._positions[within] = moving[near]
        self._normals[within] = _normals(moving, corners)[near]
        self._touched |= within


def _shift(
    copies: Sequence[tuple[Stroke, Array]], reach: float, positions: Array, upright: Array
) -> Array:
    """What copies of a stroke, with points (N, 3) of their paths, displace positions (M, 3) by."""
    largest, shift = np.zeros(len(positions)), np.zeros_like(positions)
    for stroke, points in copies:
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        close = np.arange(len(positions))
        for axis in range(3):
            x = positions[close, axis]
            close = close[(x > low[axis]) & (x < high[axis])]
        if not len(close):
            continue
        path = _lay(points, positions[close], upright[close], stroke)
        found = displace(stroke, path, positions[close], upright[close])
        wins = np.abs(found.amount) > largest[close]
        won = close[wins]
        largest[won] = np.abs(found.amount[wins])
        shift[won] = found.amount[wins, None] * found.direction[wins]
    return shift


def _path_points(stroke: Stroke) -> Array:
    """Points (N, 3) along the spline, a third of a radius apart."""
    curve = fit_curve(stroke.points, stroke.closed)
    length = arc_length(curve.points)[-1]
    if length == 0:
        return curve.points[:1]
    return curve.resample(int(np.clip(3 * length / stroke.brush.radius, LEAST, MOST)))[0]


def _normals(positions: Array, triangles: Triangles) -> Array:
    """Unit normals (V, 3), the mean of the triangles by area; zero where there is none."""
    x, y, z = np.ascontiguousarray(positions.T)[:, triangles.T]  # (3, T) each, by corner
    (px, qx), (py, qy), (pz, qz) = ((v[1] - v[0], v[2] - v[0]) for v in (x, y, z))
    area = (py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx)
    corners, count = triangles.T.ravel(), len(positions)
    normals = np.stack([np.bincount(corners, np.tile(w, 3), count) for w in area], axis=1)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def _lay(points: Array, positions: Array, normals: Array, stroke: Stroke) -> Path:
    """Points (N, 3) brought onto the tangent planes of the nearest positions (M, 3)."""
    squares = np.einsum("ij,ij->i", positions, positions)
    nearest = np.argmin(squares - 2 * points @ positions.T, axis=1)  # (N,)
    offset = np.einsum("ij,ij->i", points - positions[nearest], normals[nearest])
    laid = points - offset[:, None] * normals[nearest]
    closed = stroke.closed and len(points) > 1
    return make_path(laid, normals[nearest], closed, stroke.image)


def _within(positions: Vectors, points: Array, reach: float) -> NDArray[np.bool_]:
    """Which positions (V, 3) may lie within `reach` of points (N, 3): by the cells of a grid.

    None that does is missed; most of those that do not are left out.
    """
    low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
    size = max(reach / CELLS, float((high - low).max()) / MOST_CELLS)
    around = np.arange(-CELLS, CELLS + 1)
    gaps = np.maximum(np.abs(around) - 1, 0) ** 2  # squares, in cells, of what lies between
    ball = np.argwhere(gaps[:, None, None] + gaps[:, None] + gaps <= CELLS**2) - CELLS  # (B, 3)
    shape = ((high - low) / size).astype(np.intp) + 1
    passed = np.zeros(shape, bool)
    passed[tuple(((points - low) / size).astype(np.intp).T)] = True
    reached = np.zeros(shape + 2 * CELLS, bool)
    cells = np.argwhere(passed)[:, None] + ball + CELLS
    reached[tuple(cells.reshape(-1, 3).T)] = True
    found = np.arange(len(positions))
    for axis in range(3):
        x = positions[found, axis]
        found = found[(x > low[axis]) & (x < high[axis])]
    place = ((positions[found] - low) / size).astype(np.intp) + CELLS  # (I, 3)
    within = np.zeros(len(positions), bool)
    within[found[reached[tuple(place.T)]]] = True
    return within
