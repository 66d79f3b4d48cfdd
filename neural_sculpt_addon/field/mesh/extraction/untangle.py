# SPDX-License-Identifier: GPL-3.0-or-later
"""Untangling: triangles that look the other way than the field are turned back.

Where something is thinner than a cell, marching cubes join its sides as the signs of eight corners
say, and the mesh may fold back over itself. Its topology is not to blame: on the surface there are
places for the corners of such triangles where none is turned over. Each corner is tried in places
around it, and goes where the triangles around it are turned over the least. Model space. See
docs/method.md, section 8.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....common.progress import Progress
from ...field import Field
from ...projection import ARRIVED, project
from ..quality import POOR, facing, find_doubtful, shapes
from .march import RawMesh

ROUNDS = 64
"""How often corners are moved at most. Six turn nine of ten triangles back; one in ten thousand of
them takes all."""

MEANS = 2
"""Rounds in which corners are tried on the way to the mean of their neighbours alone: that turns
half of the triangles back, with a tenth of the places."""

PLACES, LATER_PLACES = 12, 36
"""Random places where a corner is tried in a round, at first and later."""

NEAREST, FARTHEST = 0.1, 1.5
"""From and to how many cells away they are."""

CALM = 8
"""Rounds in which a corner only goes where it is better, and makes no triangle thin. Then in every
second one chance has a say: of few corners no single one may have a better place."""

CHANCE = 0.5
"""The scale of what chance adds to a score."""

THIN = 0.1
"""Quality below which no triangle becomes in the end, some 3 degrees."""

MOST_TURNED = 5000
"""Triangles that are turned back at most, each in a millisecond: after a hundred wild strokes there
were 3000 in 384 cells. Where there are more, the lattice is too coarse for all of the field."""


class _Rings(NamedTuple):
    """The triangles around vertices, in rows, each vertex's one after another.

    vertices: (N,), rising
    starts:   (N,), the first row of each
    owners:   (R,), its number among the vertices
    names:    (R,), of the triangles
    corners:  (R, 3), theirs: the vertex itself first, then the others in their order
    """

    vertices: NDArray[np.intp]
    starts: NDArray[np.intp]
    owners: NDArray[np.intp]
    names: NDArray[np.intp]
    corners: NDArray[np.int32]


class _Tried(NamedTuple):
    """Places that are tried for vertices, C for each; the first is where it is.

    points, normals: (C, N, 3)
    usable:          (C, N), whether they are on f = 0 within the box
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    usable: NDArray[np.bool_]


def untangle(
    mesh: RawMesh, fresh: NDArray[np.bool_], field: Field, spacing: float, progress: Progress
) -> None:
    """Move `fresh` (V,) vertices, which are on f = 0, along it until none of their triangles is
    turned over, as far as that can be had; what is held on a box face stays.

    spacing: edge of a cell
    """
    free = fresh & ~mesh.held.any(axis=1)
    turned = _find_turned(mesh, free, field)
    for number in range(ROUNDS):
        progress(number / ROUNDS, "Meshing")
        moving = np.zeros(len(free), bool)
        moving[mesh.triangles[turned]] = True
        moving &= free
        if not moving.any():
            return
        rings, random = _rings(mesh, moving), np.random.default_rng(number)
        if number < MEANS:
            goals = _means(mesh, rings)
        else:
            goals = _around(mesh, rings, PLACES if number < CALM else LATER_PLACES, spacing, random)
        tried = _tried(mesh, rings, goals, field, spacing)
        score, cosines = _scores(mesh, rings, tried, field, POOR if number < CALM else THIN)
        if number >= CALM and number % 2:
            score += np.float32(CHANCE) * random.gumbel(size=score.shape).astype(np.float32)
        best = _nearest(tried, score)  # (N,)
        each = np.arange(len(best))
        moves = _apart(rings, score[best, each] - score[0])
        vertices, places = rings.vertices[moves], (best[moves], each[moves])
        mesh.vertices[vertices] = tried.points[places]
        mesh.normals[vertices] = tried.normals[places]
        rows = np.flatnonzero(moves[rings.owners])
        turned[rings.names[rows]] = cosines[best[rings.owners[rows]], rows] < 0


def _find_turned(mesh: RawMesh, free: NDArray[np.bool_], field: Field) -> NDArray[np.bool_]:
    """Which triangles (F,) with a `free` (V,) corner are turned over: the first MOST_TURNED."""
    some = _with_corner(mesh.triangles, free)
    triangles = mesh.triangles.take(some, axis=0)
    a, b, c = (mesh.vertices.take(corner, axis=0) for corner in triangles.T)
    across, _ = shapes(a, b, c)
    normals = tuple(mesh.normals.take(corner, axis=0) for corner in triangles.T)
    asked = np.flatnonzero(find_doubtful(field, (a, b, c), normals, across))
    turned = np.zeros(len(mesh.triangles), bool)
    a, b, c, across = (each.take(asked, axis=0) for each in (a, b, c, across))
    over = np.flatnonzero(facing(field, a, b, c, across) < 0)
    turned[some[asked[over[:MOST_TURNED]]]] = True
    return turned


def _with_corner(triangles: NDArray[np.int32], chosen: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The numbers of the triangles with a corner among the `chosen` (V,) vertices."""
    one, two, three = chosen.take(triangles).T
    return np.flatnonzero(one | two | three)


def _rings(mesh: RawMesh, chosen: NDArray[np.bool_]) -> _Rings:
    """Those of the `chosen` (V,) vertices."""
    some = _with_corner(mesh.triangles, chosen)
    triangles = mesh.triangles.take(some, axis=0)
    row, first = np.nonzero(chosen.take(triangles))
    vertices, owners = np.unique(triangles[row, first], return_inverse=True)
    order = np.argsort(owners, kind="stable")
    row, first, owners = row[order], first[order], owners[order]
    corners = triangles[row[:, None], (first[:, None] + np.arange(3)) % 3]
    starts = np.searchsorted(owners, np.arange(len(vertices)))
    return _Rings(vertices, starts, owners, some[row], corners)


def _means(mesh: RawMesh, rings: _Rings) -> NDArray[np.float32]:
    """Goals (2, N, 3) of the vertices of rings: the mean of their neighbours, and half the way."""
    start = mesh.vertices.take(rings.vertices, axis=0)  # (N, 3)
    neighbours = mesh.vertices.take(rings.corners[:, 1], axis=0)  # (R, 3)
    count = np.bincount(rings.owners)[:, None].astype(np.float32)
    mean = np.add.reduceat(neighbours, rings.starts, axis=0) / count
    return np.stack([mean, (start + mean) / 2])


def _around(
    mesh: RawMesh, rings: _Rings, count: int, spacing: float, random: np.random.Generator
) -> NDArray[np.float32]:
    """Goals (count, N, 3) of the vertices of rings, all in the same directions from where each
    is."""
    way = random.normal(size=(count, 1, 3))
    away = spacing * np.exp(random.uniform(np.log(NEAREST), np.log(FARTHEST), (count, 1, 1)))
    way *= away / np.linalg.norm(way, axis=2, keepdims=True)
    return mesh.vertices.take(rings.vertices, axis=0) + way.astype(np.float32)


def _tried(
    mesh: RawMesh, rings: _Rings, goals: NDArray[np.float32], field: Field, spacing: float
) -> _Tried:
    """Places for the vertices of rings: on the surface, near `goals` (C - 1, N, 3)."""
    start = mesh.vertices.take(rings.vertices, axis=0)  # (N, 3)
    found = project(field, goals.reshape(-1, 3), reach=spacing / 2)
    usable = (found.distance < ARRIVED) & (np.abs(found.points) < 1).all(axis=1)
    normals = mesh.normals.take(rings.vertices, axis=0)
    return _Tried(
        np.concatenate([start[None], found.points.reshape(goals.shape)]),
        np.concatenate([normals[None], found.normals.reshape(goals.shape)]),
        np.concatenate([np.ones((1, len(start)), bool), usable.reshape(goals.shape[:2])]),
    )


def _scores(
    mesh: RawMesh, rings: _Rings, tried: _Tried, field: Field, thin: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """How good each place is (C, N): the sum of those cosines between the triangles around it and
    the field in their middles that are negative; and all cosines (C, R).

    A place that makes a triangle `thin` in quality, and thinner than it was, is none.
    """
    own = tried.points.take(rings.owners, axis=1)  # (C, R, 3)
    b, c = (
        np.broadcast_to(mesh.vertices.take(corner, axis=0), own.shape).reshape(-1, 3)
        for corner in rings.corners.T[1:]
    )
    across, quality = shapes(own.reshape(-1, 3), b, c)
    cosines = facing(field, own.reshape(-1, 3), b, c, across).reshape(own.shape[:2])
    score = np.add.reduceat(np.minimum(cosines, 0), rings.starts, axis=1)
    least = np.minimum.reduceat(quality.reshape(cosines.shape), rings.starts, axis=1)
    score[~tried.usable | (least < np.minimum(np.float32(thin), least[0]))] = -np.inf
    return score, cosines


def _nearest(tried: _Tried, score: NDArray[np.float32]) -> NDArray[np.intp]:
    """The nearest (N,) of those places whose `score` (C, N) is the best, mostly 0."""
    way = np.square(tried.points - tried.points[0]).sum(axis=2)
    return np.where(score == score.max(axis=0), way, np.inf).argmin(axis=0)


def _apart(rings: _Rings, gain: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which vertices (N,) of rings gain, and more than all that they share a triangle with: these
    can move at the same time."""
    rank = np.empty(len(gain), np.intp)
    rank[np.argsort(gain, kind="stable")] = np.arange(len(gain))
    rank = rank[rings.owners]  # (R,)
    highest = np.zeros(rings.names.max() + 1, np.intp)
    np.maximum.at(highest, rings.names, rank)
    is_first = np.logical_and.reduceat(rank == highest[rings.names], rings.starts)
    return (gain > 0) & is_first
