# SPDX-License-Identifier: GPL-3.0-or-later
"""Edge flips: thin and turned triangles of a refined mesh are mended within their coarse ones.

The two triangles beside an edge are divided by their other diagonal where the worse of them is
better then. Edges of a coarse triangle's border stay, so what becomes of it depends on it alone.
Nor does a flip join two vertices on the same side of it: the coarse triangle across that side could
get the same edge, and four triangles would share it. Model space.
"""

import numpy as np
from numpy.typing import NDArray

from ..edges import find_edges
from .subdivide import ends_of, names

POOR = 0.25
"""Quality below which a triangle is mended: angles of some 8 degrees. 1 is equilateral, below zero
the triangle looks the other way than the surface."""

BETTER = 0.02
"""Quality that a flip must bring."""

ROUNDS = 6


def flip(
    triangles: NDArray[np.int32],
    parents: NDArray[np.int32],
    vertices: NDArray[np.float32],
    normals: NDArray[np.float32],
    sides: NDArray[np.int64],
    count: int,
) -> None:
    """Flip edges of triangles (F, 3), in place, while that mends some of them.

    parents:           (F,), the coarse triangle that each is a part of, and stays
    vertices, normals: (V, 3), of which the first `count` are of the coarse triangles
    sides:             (V,), the names of the coarse edges that the others lie on, or -1
    """
    for _ in range(ROUNDS):
        if not _flip(triangles, parents, vertices, normals, sides, count):
            return


def find_poor(
    triangles: NDArray[np.int32], vertices: NDArray[np.float32], normals: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """Which triangles (F,) are to be mended."""
    return _quality(triangles, vertices, normals) < POOR


def _flip(
    triangles: NDArray[np.int32],
    parents: NDArray[np.int32],
    vertices: NDArray[np.float32],
    normals: NDArray[np.float32],
    sides: NDArray[np.int64],
    count: int,
) -> bool:
    """Flip edges of `triangles` (F, 3), those that gain most from it, at most one of each triangle;
    whether there was one."""
    ends, of_corners = find_edges(triangles)
    order = np.argsort(of_corners.ravel(), kind="stable")  # corners by their edges
    uses = np.bincount(of_corners.ravel(), minlength=len(ends))
    first = (np.cumsum(uses) - uses)[uses == 2]
    corner, other = order[first], order[first + 1]
    quality = _quality(triangles, vertices, normals)
    now = np.minimum(quality[corner // 3], quality[other // 3])
    mendable = (parents[corner // 3] == parents[other // 3]) & (now < POOR)
    corner, other, now = corner[mendable], other[mendable], now[mendable]
    one, two = corner // 3, other // 3  # the triangles beside
    flat = triangles.ravel()
    a, b = flat[corner], flat[_next(corner)]
    c, d = flat[_next(_next(corner))], flat[_next(_next(other))]
    left, right = np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)
    then = np.minimum(*(_quality(each, vertices, normals) for each in (left, right)))
    fresh = names(np.stack([c, d], axis=1))
    gain = np.where(np.isin(fresh, names(ends)), -1.0, then - now)
    gain[(gain < BETTER) | _on_one_side(c, d, sides, count)] = -1
    best = np.full(len(triangles), -1.0)
    np.maximum.at(best, one, gain)
    np.maximum.at(best, two, gain)
    chosen = np.flatnonzero((gain > 0) & (gain == best[one]) & (gain == best[two]))
    for each in (one, two):  # of several with the same gain only those that meet no other
        uses = np.bincount(np.concatenate([one[chosen], two[chosen]]), minlength=len(triangles))
        chosen = chosen[uses[each[chosen]] == 1]
    chosen = chosen[np.unique(fresh[chosen], return_index=True)[1]]
    triangles[one[chosen]], triangles[two[chosen]] = left[chosen], right[chosen]
    return len(chosen) > 0


def _on_one_side(
    one: NDArray[np.int32], other: NDArray[np.int32], sides: NDArray[np.int64], count: int
) -> NDArray[np.bool_]:
    """Whether both of two vertices (N,) of a coarse triangle are on the same edge of it (N,)."""
    side = np.maximum(sides.take(one), sides.take(other))
    ends = ends_of(side)
    on = [(sides.take(each) == side) | (each[:, None] == ends).any(axis=1) for each in (one, other)]
    return (side >= 0) & on[0] & on[1] | (one < count) & (other < count)


def _next(corner: NDArray[np.intp]) -> NDArray[np.intp]:
    """The next corner of the same triangle."""
    return corner - corner % 3 + (corner % 3 + 1) % 3


def _quality(
    triangles: NDArray[np.int32], vertices: NDArray[np.float32], normals: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Of triangles (N, 3): area by the squares of the edges, with the sign of its side."""
    a, b, c = (vertices.take(corner, axis=0).astype(float) for corner in triangles.T)
    along = np.cross(b - a, c - a)  # (N, 3)
    area = np.sqrt(np.einsum("na,na->n", along, along))
    squares = sum(np.einsum("na,na->n", edge, edge) for edge in (b - a, c - b, a - c))
    outward = sum(normals.take(corner, axis=0) for corner in triangles.T)
    side = np.where(np.einsum("na,na->n", along, outward) < 0, -1.0, 1.0)
    return 2 * np.sqrt(3) * side * area / np.maximum(squares, 1e-30)
