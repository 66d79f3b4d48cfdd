# SPDX-License-Identifier: GPL-3.0-or-later
"""The path: a stroke laid on the surface, with its frame u, v, n, and the way from any surface
point to its place in the stroke.

At each point of the path, u is the unit tangent, n the surface normal and v = n x u (paper,
section 3). v is oriented by u and n and cannot flip along a stroke; where u and n are parallel or
u vanishes it is carried on from its neighbour. NumPy float64, model space.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .curve import Array, arc_length

POINTS_AT_ONCE = 1024  # points whose distances from all vertices are looked at together
ALONG = 0.01  # of a unit normal: an axis that is no nearer to it is along the surface
DEGENERATE = 1e-3  # sine of the angle between u and n below which v is carried on


@dataclass(frozen=True)
class Path:
    """A polyline on the surface; a dab has one point, a closed path repeats its first at the end.

    points, tangents, laterals (v), normals: (N, 3); the last three of unit length
    u: (N,) in [0, 1] by arc length; length: model space
    """

    points: Array
    tangents: Array
    laterals: Array
    normals: Array
    u: Array
    length: float
    closed: bool

    @cached_property
    def table(self) -> Array:
        """Points, normals, laterals and u side by side (N, 10), to be blended together."""
        return np.column_stack([self.points, self.normals, self.laterals, self.u])

    def box(self, reach: float) -> tuple[Array, Array]:
        """Least and greatest coordinates (3,) of all that lies within `reach` of the path."""
        return self.points.min(axis=0) - reach, self.points.max(axis=0) + reach


class Place(NamedTuple):
    """Where points (M, 3) lie in a stroke, by the point of its path that they lie beside."""

    u: Array  # (M,), of that point
    distance: Array  # (M,), to it
    sine: Array  # (M,), +1 on the side of v, -1 on the other, in between around an end
    cosine: Array  # (M,), 0 beside the path; around an end to 1 ahead of the last, -1 behind it
    beyond: NDArray[np.bool_]  # (M,), past an open end: the nearest point is the end itself
    normals: Array  # (M, 3), n(u)
    vertex: NDArray[np.intp]  # (M,), the nearest one of the path

    def put(self, index: NDArray[np.intp], other: "Place") -> "Place":
        """A copy in which the points of these indices (K,) have other places (K,)."""
        both = self._make(array.copy() for array in self)
        for array, put in zip(both, other, strict=True):
            array[index] = put
        return both


def make_path(
    points: ArrayLike, normals: ArrayLike, closed: bool = False, image: Array | None = None
) -> Path:
    """The path through surface points (N, 3) with outward normals (N, 3).

    The points of a closed path end with its first. One point is a dab.

    image: (3, 3), of a copy of a stroke: the frame of a dab is turned by it
    """
    p = np.asarray(points, float)
    n = _unit(np.asarray(normals, float))
    along = arc_length(p)
    if len(p) == 1:
        tangents = np.zeros_like(p)
    elif closed:
        ahead, behind = np.vstack([p[1:], p[1]]), np.vstack([p[-2], p[:-1]])
        tangents = ahead - behind
    else:
        tangents = np.gradient(p, axis=0)
    laterals = _laterals(_unit(tangents), n, np.eye(3) if image is None else image)
    tangents = np.cross(laterals, n)
    u = along / along[-1] if along[-1] > 0 else np.zeros(len(p))
    return Path(p, tangents, laterals, n, u, float(along[-1]), closed)


def locate(path: Path, points: ArrayLike, vertex: NDArray[np.intp] | None = None) -> Place:
    """The place in the stroke of `points` (M, 3); where passes cross, the nearest decides.

    vertex: (M,) the nearest of points beside these, closer to them than vertices to each other
    """
    x = np.asarray(points, float).reshape(-1, 3)
    if len(path.points) == 1:
        return place_at(path, x, np.zeros(len(x), np.intp))
    if vertex is None:
        vertex = _nearest_vertex(path.points, x)
    index, t = _foot(path, x, vertex)
    start, end = path.table.take(index, axis=0), path.table.take(index + 1, axis=0)
    blend = start * (1 - t[:, None]) + end * t[:, None]
    offset = x - blend[:, :3]
    distance = _length(offset)
    normals, laterals, u = _unit(blend[:, 3:6]), _unit(blend[:, 6:9]), blend[:, 9]
    side = np.einsum("ij,ij->i", offset, laterals)
    sine, cosine, beyond = np.sign(side), np.zeros(len(x)), np.zeros(len(x), bool)
    if not path.closed:
        some = np.flatnonzero((u <= 0) | (u >= 1))
        ahead = np.einsum("ij,ij->i", offset[some], path.tangents[np.where(u[some] <= 0, 0, -1)])
        past = np.where(u[some] <= 0, ahead < 0, ahead > 0)
        some, ahead = some[past], ahead[past]
        beyond[some] = True
        flat = np.maximum(np.hypot(side[some], ahead), 1e-12)
        sine[some], cosine[some] = side[some] / flat, ahead / flat
    return Place(u, distance, sine, cosine, beyond, normals, vertex)


def place_at(path: Path, points: ArrayLike, vertex: NDArray[np.intp]) -> Place:
    """The place in the stroke of `points` (M, 3) beside given vertices (M,) of its path, be these
    the nearest or not."""
    offset = np.asarray(points, float) - path.points[vertex]
    side = np.einsum("ij,ij->i", offset, path.laterals[vertex])
    ahead = np.einsum("ij,ij->i", offset, path.tangents[vertex])
    flat = np.maximum(np.hypot(side, ahead), 1e-12)
    last = len(path.points) - 1
    beyond = ((vertex == 0) & (ahead < 0)) | ((vertex == last) & (ahead > 0)) | (last == 0)
    return Place(
        path.u[vertex],
        _length(offset),
        side / flat,
        ahead / flat,
        beyond & (not path.closed),
        path.normals[vertex],
        vertex,
    )


def square_distances(points: Array, others: Array) -> Array:
    """Squares (M, N) of the distances between points (M, 3) and others (N, 3).

    |a - b|^2 expanded, so a product of matrices finds them; for M and N that fit the cache.
    """
    squares = np.einsum("ij,ij->i", others, others)
    factor = np.vstack([-2 * others.T, squares, np.ones(len(others))])  # (5, N)
    square = np.einsum("ij,ij->i", points, points)
    found = np.column_stack([points, np.ones(len(points)), square]) @ factor
    return np.maximum(found, 0, out=found)


def _nearest_vertex(path: Array, x: Array) -> NDArray[np.intp]:
    """Index of the vertex of `path` nearest to each x."""
    vertex = np.empty(len(x), np.intp)
    for start in range(0, len(x), POINTS_AT_ONCE):
        part = slice(start, start + POINTS_AT_ONCE)
        vertex[part] = square_distances(x[part], path).argmin(axis=1)
    return vertex


def _foot(path: Path, x: Array, vertex: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array]:
    """The foot of each x (M, 3) on the path: its segment (M,), and its place t on that in [0, 1].

    The plane across the path at the foot passes through x: (x - p(t)) . u(t) = 0, with the point p
    and the tangent u linear along the segment. The tangent has no jumps, so the foot has none. (The
    nearest point of a polyline does jump: inside of a bend it leaps over the vertices, and outside
    it rests on them.) The segment is one of the two at the nearest vertex.
    """
    count = len(path.points) - 1
    ahead = np.einsum("ij,ij->i", x - path.points[vertex], path.tangents[vertex]) >= 0
    segment = vertex - ~ahead
    segment = segment % count if path.closed else np.clip(segment, 0, count - 1)
    offset = x - path.points[segment]
    tangent, turn = path.tangents[segment], np.diff(path.tangents, axis=0)[segment]
    chord = np.diff(path.points, axis=0)[segment]
    a = -np.einsum("ij,ij->i", chord, turn)  # a t^2 + b t + c = 0
    b = np.einsum("ij,ij->i", offset, turn) - np.einsum("ij,ij->i", chord, tangent)
    c = np.einsum("ij,ij->i", offset, tangent)
    root = np.sqrt(np.maximum(b * b - 4 * a * c, 0)) - b  # b < 0 up to the center of the bend
    return segment, np.clip(2 * c / np.where(np.abs(root) > 1e-30, root, 1e-30), 0, 1)


def _laterals(tangents: Array, normals: Array, image: Array) -> Array:
    """v = n x u, unit; carried on from the nearest sound neighbour where that is degenerate.

    The u of a dab is the coordinate axis farthest from n, on the side of n: mirrored with it. On
    flat faces along the axes rounding must not choose, so of axes that are as far the first counts,
    and its positive side. The u of an image is the image of the u that the dab itself has.
    """
    v = np.cross(normals, tangents)
    sound = np.flatnonzero(np.linalg.norm(v, axis=1) > DEGENERATE)
    if not len(sound):
        upright = normals[0] @ image  # as of the stroke that was drawn: an image's inverse is .T
        away = np.abs(upright)
        k = int(np.argmax(away <= away.min() + ALONG))
        axis = image[:, k] * (-1 if upright[k] < -ALONG else 1)
        v, sound = np.tile(np.cross(normals[0], axis), (len(v), 1)), np.arange(1)
    carried = v
    if len(sound) < len(v):
        carried = v[sound[np.argmin(np.abs(np.arange(len(v))[:, None] - sound), axis=1)]]
    carried -= normals * np.einsum("ij,ij->i", carried, normals)[:, None]
    return _unit(carried)


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(_length(vectors), 1e-12)[:, None]


def _length(vectors: Array) -> Array:
    """(N,) of vectors (N, 3); NumPy's norm takes more than twice as long."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
