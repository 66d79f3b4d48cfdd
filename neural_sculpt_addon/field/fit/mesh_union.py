# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of what several parts make together: faces are cut where they cross, and what then
has the inside on both sides is dropped.

Parts that stick into each other hide parts of their faces, whatever the size of those. CGAL cuts
large faces exactly along each other; of small ones the middle decides. Model space.
"""

from collections.abc import Callable
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ...common.progress import Progress
from ..geometry import areas, face_normals, unit
from . import cgal_process
from .mesh_cut import cut_along

Array = NDArray[np.float64]

BATCH = 8192  # faces between two looks at `progress`
BESIDE_FACE = 2e-3  # how far beside a face its two sides are looked at,
BESIDE_THIN = 0.25  # at most this share of the radius of its inscribed circle,
CLOSEST = 1e-5  # but not closer
BOTH_INSIDE = 0.8  # |mean winding number| of a face's sides, from which on both may be inside
HIDDEN = 0.3  # |winding number| of either, from which on they are
ALIKE = 0.5  # difference of winding numbers, below which both sides are inside, or neither is
WHOLE = 0.2  # distance from a whole number, beyond which a winding number is that of an open wall
UNCUT_EDGE = 0.025  # longest edge of faces that need no cut
PARALLEL = 1e-3  # sine of the angle between faces, below which they touch rather than cross
NEAR_CORNER = 1 / 16  # size of the triangles in a face's corners that are looked at by themselves
MOST_PAIRS = 20_000  # of faces that are cut, the largest: each takes milliseconds, at times tens
NONE = np.empty((0, 3, 3))  # no faces


class Parts(NamedTuple):
    """What parts are made of, by the corners of triangles that may share no vertices."""

    surface: Array  # (S, 3, 3), what bounds the union
    solid: Array  # (F, 3, 3), what tells the inside by its winding number: open walls are left out
    uncut: int  # how many crossings were too many to cut; inner walls may be left there


def crossings(vertices: Array, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs of faces that cross (N, 2), one of them large."""
    corners = vertices[faces]
    longest = _longest(corners)
    large = longest > UNCUT_EDGE
    if not large.any():
        return np.empty((0, 2), np.int64)
    tree = igl.AABB()
    tree.init(vertices, faces[large])
    small = np.flatnonzero(~large)
    square = tree.squared_distance(vertices, faces[large], corners[small].mean(axis=1))[0]
    near = small[np.asarray(square) < longest[small] ** 2]
    some = np.concatenate([np.flatnonzero(large), near])
    pairs = some[cgal_process.crossings(corners[some])]
    return pairs[large[pairs].any(axis=1)]


def cut(
    vertices: Array,
    faces: NDArray[np.int64],
    pairs: NDArray[np.int64],
    winding: Callable[[Array], Array],
    progress: Progress,
) -> Parts:
    """What the faces (F, 3) are made of, those of `pairs` (N, 2) cut along each other.

    Where more cross than are cut, and where they touch, they are divided until they are small.
    Touching faces bound nothing where both of their sides are outside, either: where a cavity
    touches the wall around it.

    winding: the winding number of the faces
    """
    corners, crossing = vertices[faces], np.zeros(len(faces), bool)
    largest = _largest(corners, pairs)  # (N,)
    crossing[pairs[largest]] = True
    apart, parts, upon = corners[~crossing], NONE, NONE
    if len(pairs):
        parts, owners = cut_along(corners[crossing], int(largest.sum()), progress)
        uncut, touching = np.zeros((2, len(faces)), bool)
        uncut[pairs[~largest]] = True
        touching[pairs[_touching(corners, pairs)]] = True
        uncut, touching = uncut[crossing][owners], touching[crossing][owners]
        upon = _in_order(parts[touching])
        apart = np.concatenate([apart, _in_order(parts[uncut & ~touching])])
        parts = _in_order(parts[~uncut & ~touching])
    surface, solid = [], []
    for whole, divisible, touch in ((parts, apart, False), (NONE, upon, True)):
        some = np.concatenate([_divided(divisible, touch, winding, progress), whole])
        some = some[areas(some) > 0]
        sides = _sides(some, touch, winding, progress)
        dropped = _dropped(sides, touch)
        open_wall = dropped & (np.abs(sides - np.rint(sides)) > WHOLE).any(axis=0)
        surface.append(some[~dropped])
        solid.append(some[~open_wall])
    return Parts(np.concatenate(surface), np.concatenate(solid), int(np.sum(~largest)))


def _largest(corners: Array, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which pairs (N, 2) are those of the largest faces (F, 3, 3), so many of these that no more
    than `MOST_PAIRS` cross."""
    if len(pairs) <= MOST_PAIRS:
        return np.ones(len(pairs), bool)
    rank = np.empty(len(corners), np.int64)
    rank[np.argsort(-_longest(corners), kind="stable")] = np.arange(len(corners))
    last = rank[pairs].max(axis=1)  # a pair comes in with the smaller of its two
    return last < np.partition(last, MOST_PAIRS)[MOST_PAIRS]


def _touching(corners: Array, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which pairs (N, 2) of faces (F, 3, 3) are parallel: rounding makes parts that touch in a face
    cross, and then only here and there."""
    one, other = np.moveaxis(unit(face_normals(corners))[pairs], 1, 0)
    return np.linalg.norm(np.cross(one, other), axis=1) < PARALLEL


def _dropped(sides: Array, touch: bool) -> NDArray[np.bool_]:
    """Which faces (F,) bound nothing, by the winding numbers on their `sides` (2, F): they have the
    inside on both, or, where they touch others, on neither."""
    inside = (np.abs(sides.mean(axis=0)) > BOTH_INSIDE) & (np.abs(sides).min(axis=0) > HIDDEN)
    return inside | (touch & (np.abs(sides[0] - sides[1]) < ALIKE))


def _divided(
    corners: Array, touch: bool, winding: Callable[[Array], Array], progress: Progress
) -> Array:
    """Faces (F, 3, 3), those that are dropped in part in quarters until these are small: parts that
    touch in a face, but for rounding, do not cross it."""
    done = [NONE]
    while len(corners):
        large = _longest(corners) > UNCUT_EDGE
        done.append(corners[~large])
        corners = corners[large]
        middles = (corners + np.roll(corners, -1, axis=1)) / 2  # (L, 3, 3)
        outer = np.stack([corners, middles, np.roll(middles, 1, axis=1)], axis=2)
        quarters = np.concatenate([outer, middles[:, None]], axis=1)  # (L, 4, 3, 3)
        tips = corners[:, :, None] + NEAR_CORNER * (corners[:, None] - corners[:, :, None])
        asked = np.concatenate([quarters, tips], axis=1)  # (L, 7, 3, 3)
        sides = _sides(asked.reshape(-1, 3, 3), touch, winding, progress)
        dropped = _dropped(sides, touch).reshape(-1, 7)
        mixed = dropped.any(axis=1) & ~dropped.all(axis=1)
        done.append(corners[~mixed])
        corners = quarters[mixed].reshape(-1, 3, 3)
    return np.concatenate(done)


def _in_order(corners: Array) -> Array:
    """The triangles (F, 3, 3) in an order that follows from them alone: CGAL's is another one each
    time, and so would be the samples that are drawn from them."""
    _, names = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    names = names.reshape(-1, 3)
    turned = (names.argmin(axis=1)[:, None] + np.arange(3)) % 3
    names = np.take_along_axis(names, turned, axis=1)
    corners = np.take_along_axis(corners, turned[:, :, None], axis=1)
    return corners[np.lexsort(names.T[::-1])]


def _sides(
    corners: Array, touch: bool, winding: Callable[[Array], Array], progress: Progress
) -> Array:
    """Winding numbers behind and before the middles of faces (F, 3, 3) -> (2, F)."""
    farthest = CLOSEST if touch else BESIDE_FACE
    sides = np.empty((2, len(corners)))
    for start in range(0, len(corners), BATCH):
        progress(start / len(corners), "Looking for inner walls")
        part = slice(start, start + BATCH)
        sides[:, part] = winding(_beside(corners[part], farthest)).reshape(2, -1)
    return sides


def _beside(corners: Array, farthest: float) -> Array:
    """Points behind and before the middles of faces (F, 3, 3) -> (2F, 3)."""
    around = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).sum(axis=1)  # (F,)
    radius = 2 * areas(corners) / np.maximum(around, 1e-30)
    away = np.clip(BESIDE_THIN * radius, CLOSEST, farthest)
    middle, step = corners.mean(axis=1), away[:, None] * unit(face_normals(corners))
    return np.concatenate([middle - step, middle + step])


def _longest(corners: Array) -> Array:
    """The longest edges (F,) of the triangles (F, 3, 3)."""
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
