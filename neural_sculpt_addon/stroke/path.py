# SPDX-License-Identifier: GPL-3.0-or-later
"""The path: a stroke laid on the surface, with its frame u, v, n, and the way from any surface
point to its place in the stroke.

At each point of the path, u is the unit tangent, n the surface normal and v = n x u (paper,
section 3). v is oriented by u and n and cannot flip along a stroke; where u and n are parallel or
u vanishes it is carried on from its neighbour. NumPy float64, model space.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .curve import Array, arc_length

CHUNK = 1024  # points whose distances from all vertices are looked at together
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


class Place(NamedTuple):
    """Where points (M, 3) lie in a stroke, by the nearest point of its path."""

    u: Array  # (M,), of the nearest path point
    distance: Array  # (M,), to it
    sine: Array  # (M,), +1 on the side of v, -1 on the other, in between around an end
    cosine: Array  # (M,), 0 beside the path; around an end to 1 ahead of the last, -1 behind it
    beyond: NDArray[np.bool_]  # (M,), past an open end: the nearest point is the end itself
    normals: Array  # (M, 3), n(u)


def make_path(points: ArrayLike, normals: ArrayLike, closed: bool = False) -> Path:
    """The path through surface points (N, 3) with outward normals (N, 3).

    The points of a closed path end with its first. One point is a dab.
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
    laterals = _laterals(_unit(tangents), n)
    tangents = np.cross(laterals, n)
    u = along / along[-1] if along[-1] > 0 else np.zeros(len(p))
    return Path(p, tangents, laterals, n, u, float(along[-1]), closed)


def locate(path: Path, points: ArrayLike) -> Place:
    """The place in the stroke of `points` (M, 3); where passes cross, the nearest decides."""
    x = np.asarray(points, float).reshape(-1, 3)
    if len(path.points) == 1:
        index, t = np.zeros(len(x), int), np.zeros(len(x))
        following = index
    else:
        index, t = _nearest(path.points, path.closed, x)
        following = index + 1

    def blend(values: Array) -> Array:
        weight = t[:, None] if values.ndim == 2 else t
        return values[index] * (1 - weight) + values[following] * weight

    offset = x - blend(path.points)  # (M, 3)
    distance = np.linalg.norm(offset, axis=1)
    normals, laterals = _unit(blend(path.normals)), _unit(blend(path.laterals))
    side = np.einsum("ij,ij->i", offset, laterals)
    ahead = np.einsum("ij,ij->i", offset, np.cross(laterals, normals))
    u = blend(path.u)
    end = np.full(len(x), len(path.points) == 1)
    if len(path.points) > 1 and not path.closed:
        end = (u <= 0) & (ahead < 0) | (u >= 1) & (ahead > 0)
    flat = np.maximum(np.hypot(side, ahead), 1e-12)
    sine, cosine = np.where(end, side / flat, np.sign(side)), np.where(end, ahead / flat, 0.0)
    return Place(u, distance, sine, cosine, end, normals)


def _nearest(path: Array, closed: bool, x: Array) -> tuple[np.ndarray, Array]:
    """Index of the segment of `path` nearest to each x, and the place on it in [0, 1].

    The segment is one of the two at the nearest vertex; |a - b|^2 expanded, so a product of
    matrices finds that vertex, in chunks that fit the cache.
    """
    squares = np.einsum("ij,ij->i", path, path)
    factor = np.vstack([-2 * path.T, squares])  # (4, N)
    homogeneous = np.column_stack([x, np.ones(len(x))])  # (M, 4)
    vertex = np.empty(len(x), int)
    for start in range(0, len(x), CHUNK):
        part = slice(start, start + CHUNK)
        vertex[part] = np.argmin(homogeneous[part] @ factor, axis=1)
    best = np.full(len(x), np.inf)
    index, place = np.zeros(len(x), int), np.zeros(len(x))
    count = len(path) - 1
    for neighbour in (vertex - 1, vertex):
        segment = neighbour % count if closed else np.clip(neighbour, 0, count - 1)
        a, chord = path[segment], path[segment + 1] - path[segment]
        t = np.einsum("ij,ij->i", x - a, chord) / np.maximum(
            np.einsum("ij,ij->i", chord, chord), 1e-30
        )
        t = np.clip(t, 0, 1)
        distance = np.linalg.norm(x - a - t[:, None] * chord, axis=1)
        closer = distance < best
        best[closer], index[closer], place[closer] = distance[closer], segment[closer], t[closer]
    return index, place


def _laterals(tangents: Array, normals: Array) -> Array:
    """v = n x u, unit; carried on from the nearest sound neighbour where that is degenerate.

    The u of a dab is the coordinate axis farthest from n, on the side of n: mirrored with it.
    """
    v = np.cross(normals, tangents)
    sound = np.flatnonzero(np.linalg.norm(v, axis=1) > DEGENERATE)
    if not len(sound):
        k = np.argmin(np.abs(normals[0]))
        axis = np.eye(3)[k] * np.copysign(1, normals[0, k])
        v, sound = np.tile(np.cross(normals[0], axis), (len(v), 1)), np.arange(1)
    carried = v[sound[np.argmin(np.abs(np.arange(len(v))[:, None] - sound), axis=1)]]
    carried -= normals * np.einsum("ij,ij->i", carried, normals)[:, None]
    return _unit(carried)


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
