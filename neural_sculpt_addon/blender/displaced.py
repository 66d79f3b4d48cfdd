# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh with strokes displaced on it at once, as a preview: p' = p + d n.

The path of a stroke is laid on the mesh by its nearest vertices and their tangent planes, an error
of second order in the size of a triangle. Only what lies near the path is touched: at 100,000
triangles a stroke takes some 10 ms. NumPy alone; model space.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..stroke.curve import Array, arc_length, fit_curve
from ..stroke.displacement import displace
from ..stroke.path import Path, make_path
from ..stroke.stroke import Stroke

Vectors = NDArray[np.float32]
Triangles = NDArray[np.int32]

LEAST, MOST = 48, 512  # points of a path
SMALLEST_CELL = 0.02  # model space


class Displaced(NamedTuple):
    """Where vertices are now: indices (M,), positions and unit normals (M, 3)."""

    vertices: NDArray[np.intp]
    positions: Vectors
    normals: Vectors


def displaced(positions: Vectors, triangles: Triangles, strokes: Iterable[Stroke]) -> Displaced:
    """Displace vertices (V, 3) of triangles (F, 3), wound outward, by strokes one after another."""
    moving = positions.astype(float)
    normals = np.zeros_like(moving)
    touched = np.zeros(len(moving), bool)
    for stroke in (copy for drawn in strokes for copy in drawn.copies()):
        points = _path_points(stroke)  # (N, 3)
        spacing = arc_length(points)[-1] / len(points)
        reach = stroke.brush.radius * stroke.largest_factor + spacing
        within = _within(moving, points, reach)
        near = np.flatnonzero(within)
        if not len(near):
            continue
        a, b, c = triangles.T
        around = triangles[within.take(a) | within.take(b) | within.take(c)]  # (T, 3)
        upright = _normals(moving, around)[near]
        path = _lay(points, moving[near], upright, stroke.closed)
        shift = displace(stroke, path, moving[near], upright)
        moving[near] += shift.amount[:, None] * shift.direction
        normals[near] = _normals(moving, around)[near]
        touched |= within
    chosen = np.flatnonzero(touched)
    return Displaced(chosen, moving[chosen].astype(np.float32), normals[chosen].astype(np.float32))


def _path_points(stroke: Stroke) -> Array:
    """Points (N, 3) along the spline, a third of a radius apart."""
    curve = fit_curve(stroke.points, stroke.closed)
    length = arc_length(curve.points)[-1]
    if length == 0:
        return curve.points[:1]
    return curve.resample(int(np.clip(3 * length / stroke.brush.radius, LEAST, MOST)))[0]


def _normals(positions: Array, triangles: Triangles) -> Array:
    """Unit normals (V, 3), the mean of the given triangles by area; zero where there is none."""
    a, b, c = (positions[corner] for corner in triangles.T)
    area = np.repeat(np.cross(b - a, c - a), 3, axis=0)  # (3T, 3)
    corners, count = triangles.ravel(), len(positions)
    normals = np.stack([np.bincount(corners, weight, count) for weight in area.T], axis=1)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def _lay(points: Array, positions: Array, normals: Array, closed: bool) -> Path:
    """Points (N, 3) brought onto the tangent planes of the nearest positions (M, 3)."""
    squares = np.einsum("ij,ij->i", positions, positions)
    nearest = np.argmin(squares - 2 * points @ positions.T, axis=1)  # (N,)
    offset = np.einsum("ij,ij->i", points - positions[nearest], normals[nearest])
    laid = points - offset[:, None] * normals[nearest]
    return make_path(laid, normals[nearest], closed and len(points) > 1)


def _within(positions: Array, points: Array, reach: float) -> NDArray[np.bool_]:
    """Which positions (V, 3) may lie within `reach` of points (N, 3): by the cells of a grid."""
    size = max(reach, SMALLEST_CELL)
    low = points.min(axis=0) - 2 * size
    cells = ((points - low) / size).astype(np.intp)  # (N, 3), from 2 on
    grid = np.zeros(cells.max(axis=0) + 3, bool)
    for step in np.ndindex(3, 3, 3):
        grid[tuple((cells + step - 1).T)] = True
    high = low + size * np.array(grid.shape)
    x, y, z = ((a > b) & (a < c) for a, b, c in zip(positions.T, low, high, strict=True))
    inside = x & y & z
    place = ((positions[inside] - low) / size).astype(np.intp)  # (I, 3)
    inside[inside] = grid[tuple(np.minimum(place, np.array(grid.shape) - 1).T)]
    return inside
