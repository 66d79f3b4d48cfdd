# SPDX-License-Identifier: GPL-3.0-or-later
"""Refinement: a proxy as fine as its field (docs/method.md, section 8).

    edges whose middle is off the surface -> split there, vertices onto f = 0 -> their halves again

The lattice's proxy knows the topology. Its edges, their halves and the edges between them are split
when their middles are farther than a tolerance from f = 0, unless a triangle would come out thin or
turned over. Both triangles of an edge split it alike, so no crack can come, and a closed mesh stays
closed.

After an edit `again` takes over what was made of the triangles that the edit left as they were, and
splits their edges as they are split already. Model space.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....common.progress import Progress, silent
from ...field import Field
from ...geometry import all_true
from ...levels import SUPPORT, cells_of, cells_per_axis, dilated, linear
from ..proxy import Proxy
from .edge_growth import EdgeGrowth, Splits, renamed
from .subdivide import Subdivision

EDGE_TOLERANCE = 1 / 64
"""Cells that the middle of an edge may be off the surface: at 128 cells per axis 2.4e-4."""


@dataclass(frozen=True)
class Refined:
    """The refinement of a proxy: its vertices come first, then those in the middle of edges.

    parents:   (F,), rising: the triangle of the proxy that each is a part of
    tolerance: in cells; doubled as often as the budget asked for
    """

    vertices: NDArray[np.float32]  # (V, 3)
    normals: NDArray[np.float32]  # (V, 3), unit, outward
    triangles: NDArray[np.int32]  # (F, 3), counter-clockwise seen from outside
    parents: NDArray[np.int32]
    splits: Splits
    coarse: Proxy
    tolerance: float


def refine(
    field: Field,
    coarse: Proxy,
    most: int,
    tolerance: float = EDGE_TOLERANCE,
    progress: Progress = silent,
) -> Refined:
    """The refinement of a field's proxy, of at most so many triangles: where the tolerance, in
    cells, would make more, it is doubled. A proxy that has more stays as it is."""
    whole = Subdivision.whole(coarse.triangles, np.arange(len(coarse.triangles), dtype=np.int32))
    if len(whole.triangles) >= most:
        tolerance = np.inf
    while True:
        growth = EdgeGrowth(field, coarse.vertices, coarse.normals)
        parts = growth.grow(whole, tolerance * coarse.active.spacing, most, progress)
        if parts is not None:
            return _result(growth, parts, coarse, tolerance)
        tolerance *= 2


def again(
    field: Field,
    coarse: Proxy,
    before: Refined,
    reached: NDArray[np.int32],
    most: int,
    progress: Progress = silent,
) -> Refined:
    """The refinement of `coarse`, the proxy of a field that differs in `reached` alone from the one
    whose refinement was `before`. The tolerance stays, while the budget allows.

    reached: (S,) cells as of `levels.support`
    """
    if coarse.active.cells != before.coarse.active.cells:
        return refine(field, coarse, most, progress=progress)
    number = _same_vertices(coarse, before.coarse, reached)
    parents = _same_triangles(coarse, before.coarse, number)
    of_all = parents.take(before.parents)
    kept = np.flatnonzero(of_all >= 0)
    triangles = before.triangles.take(kept, axis=0)

    count, old = len(coarse.vertices), len(before.coarse.vertices)
    is_used = np.zeros(len(before.vertices), bool)
    is_used[triangles] = True
    used = old + np.flatnonzero(is_used[old:])
    number = np.append(number, np.full(len(before.vertices) - old, -1, np.int32))
    number[used] = count + np.arange(len(used), dtype=np.int32)

    growth = EdgeGrowth(
        field,
        np.concatenate([coarse.vertices, before.vertices.take(used, axis=0)]),
        np.concatenate([coarse.normals, before.normals.take(used, axis=0)]),
        renamed(before.splits, number),
    )
    is_fresh = np.ones(len(coarse.triangles), bool)
    is_fresh[parents[parents >= 0]] = False
    fresh = np.flatnonzero(is_fresh).astype(np.int32)
    parts = Subdivision.whole(coarse.triangles.take(fresh, axis=0), fresh)
    limit = before.tolerance * coarse.active.spacing
    parts = growth.grow(parts, limit, most - len(triangles), progress)
    if parts is None:
        return refine(field, coarse, most, 2 * before.tolerance, progress)
    if before.tolerance > EDGE_TOLERANCE and len(before.triangles) < most / 3:
        return refine(field, coarse, most, progress=progress)
    triangles = number.take(triangles)
    kept_parts = Subdivision(triangles, of_all.take(kept), np.ones(triangles.shape, bool))
    return _result(growth, Subdivision.together([kept_parts, parts]), coarse, before.tolerance)


def _result(growth: EdgeGrowth, parts: Subdivision, coarse: Proxy, tolerance: float) -> Refined:
    """The mesh of `parts`, which are all that there are."""
    order = np.argsort(parts.parents, kind="stable")
    return Refined(
        growth.vertices,
        growth.normals,
        parts.triangles.take(order, axis=0),
        parts.parents.take(order),
        growth.all_splits(),
        coarse,
        tolerance,
    )


def _same_vertices(coarse: Proxy, before: Proxy, reached: NDArray[np.int32]) -> NDArray[np.int32]:
    """The number (V,) in `coarse` of each vertex of the proxy before it; -1 for those that are
    elsewhere now, or so near to the cells `reached` that the field at an edge may have changed."""
    place = np.searchsorted(coarse.edges, before.edges)
    same = coarse.edges.take(place, mode="clip") == before.edges
    same &= all_true(coarse.vertices.take(place, axis=0, mode="clip") == before.vertices)
    near = np.zeros(cells_per_axis(SUPPORT) ** 3, bool)
    near[dilated(reached, SUPPORT)] = True
    same &= ~near.take(linear(cells_of(before.vertices, SUPPORT), SUPPORT))
    return np.where(same, place, -1).astype(np.int32)


def _same_triangles(coarse: Proxy, before: Proxy, number: NDArray[np.int32]) -> NDArray[np.int32]:
    """The number (F,) in `coarse` of each triangle of the proxy before it; -1 for those that are
    not there any more.

    number: (V,) of its vertices, as of `_same_vertices`
    """
    known = np.zeros(len(coarse.vertices), bool)
    known[number[number >= 0]] = True
    there = np.flatnonzero(all_true(known.take(coarse.triangles)))
    old = number.take(before.triangles)
    some = np.flatnonzero(all_true(old >= 0))
    old = old.take(some, axis=0)
    # Both are in the order of the lattice's cells, so hardly ever does one have to be searched for.
    if not np.array_equal(coarse.triangles.take(there, axis=0), old):
        name = _first_edges(coarse.triangles)
        order = np.argsort(name)
        place = np.searchsorted(name, _first_edges(old), sorter=order)
        there = order.take(place, mode="clip")
        same = all_true(coarse.triangles.take(there, axis=0) == old)
        some, there = some[same], there[same]
    parents = np.full(len(before.triangles), -1, np.int32)
    parents[some] = there
    return parents


def _first_edges(triangles: NDArray[np.int32]) -> NDArray[np.int64]:
    """The names (F,) of the edges from the first corners to the second, one triangle's each."""
    return triangles[:, 0].astype(np.int64) << 32 | triangles[:, 1]
