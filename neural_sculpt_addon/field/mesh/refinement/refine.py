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
from .edge_growth import Growth, Splits, renamed
from .subdivide import Parts

TOLERANCE = 1 / 64
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
    tolerance: float = TOLERANCE,
    progress: Progress = silent,
) -> Refined:
    """The refinement of a field's proxy, of at most so many triangles: where the tolerance, in
    cells, would make more, it is doubled. A proxy that has more stays as it is."""
    whole = Parts.whole(coarse.triangles, np.arange(len(coarse.triangles), dtype=np.int32))
    if len(whole.triangles) >= most:
        tolerance = np.inf
    while True:
        growth = Growth(field, coarse.vertices, coarse.normals)
        parts = growth.grow(whole, tolerance * coarse.active.spacing, most, progress)
        if parts is not None:
            return _numbered(growth, parts, coarse, tolerance)
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
    kept, parents = _same_triangles(coarse, before.coarse, number)
    of_kept = kept.take(before.parents)
    triangles = before.triangles.compress(of_kept, axis=0)

    count, old = len(coarse.vertices), len(before.coarse.vertices)
    used = np.zeros(len(before.vertices), bool)
    used[triangles] = True
    used[:old] = False
    number = np.concatenate([number, np.where(used, 0, -1)[old:]]).astype(np.int32)
    number[used] = count + np.arange(np.count_nonzero(used), dtype=np.int32)
    triangles = number.take(triangles)
    of_kept = parents.take(before.parents.compress(of_kept))

    growth = Growth(
        field,
        np.concatenate([coarse.vertices, before.vertices[used]]),
        np.concatenate([coarse.normals, before.normals[used]]),
        renamed(before.splits, number),
    )
    fresh = np.ones(len(coarse.triangles), bool)
    fresh[parents[kept]] = False
    parts = Parts.whole(coarse.triangles[fresh], np.flatnonzero(fresh).astype(np.int32))
    limit = before.tolerance * coarse.active.spacing
    parts = growth.grow(parts, limit, most - len(triangles), progress)
    if parts is None:
        return refine(field, coarse, most, 2 * before.tolerance, progress)
    if before.tolerance > TOLERANCE and len(before.triangles) < most / 3:
        return refine(field, coarse, most, progress=progress)
    kept_parts = Parts(triangles, of_kept, np.ones(triangles.shape, bool))
    return _numbered(growth, Parts.together([kept_parts, parts]), coarse, before.tolerance)


def _numbered(growth: Growth, parts: Parts, coarse: Proxy, tolerance: float) -> Refined:
    """The mesh of `parts`, which are all that there are."""
    order = np.argsort(parts.parents, kind="stable")
    triangles = parts.triangles.take(order, axis=0)
    # Vertices in the order in which triangles name them, whatever they were made after.
    corners, count = triangles.ravel(), len(growth.vertices)
    first = np.zeros(count, np.intp)
    first[corners[::-1]] = np.arange(len(corners), 0, -1)
    first[: len(coarse.vertices)] = -1
    listed = np.argsort(first, kind="stable")
    number = np.empty(count, np.int32)
    number[listed] = np.arange(count, dtype=np.int32)
    edges, middles = (np.concatenate(each) for each in zip(*growth.splits, strict=True))
    return Refined(
        growth.vertices.take(listed, axis=0),
        growth.normals.take(listed, axis=0),
        number.take(triangles),
        parts.parents.take(order),
        renamed(Splits(edges, middles), number),
        coarse,
        tolerance,
    )


def _same_vertices(coarse: Proxy, before: Proxy, reached: NDArray[np.int32]) -> NDArray[np.int32]:
    """The number (V,) in `coarse` of each vertex of the proxy before it; -1 for those that are
    elsewhere now, or so near to the cells `reached` that the field at an edge may have changed."""
    place = np.searchsorted(coarse.edges, before.edges).clip(max=len(coarse.edges) - 1)
    same = coarse.edges.take(place) == before.edges
    same &= all_true(coarse.vertices.take(place, axis=0) == before.vertices)
    near = np.zeros(cells_per_axis(SUPPORT) ** 3, bool)
    near[dilated(reached, SUPPORT)] = True
    same &= ~near.take(linear(cells_of(before.vertices, SUPPORT), SUPPORT))
    return np.where(same, place, -1).astype(np.int32)


def _same_triangles(
    coarse: Proxy, before: Proxy, number: NDArray[np.int32]
) -> tuple[NDArray[np.bool_], NDArray[np.int32]]:
    """Which triangles (F,) of the proxy before are in `coarse`, too, and their number there.

    number: (V,) of its vertices, as of `_same_vertices`
    """
    old = number.take(before.triangles)
    some = np.flatnonzero(all_true(old >= 0))
    there = _first_edges(coarse.triangles)
    order = np.argsort(there)
    wanted = _first_edges(old[some])
    place = order.take(np.searchsorted(there, wanted, sorter=order), mode="clip")
    same = all_true(coarse.triangles.take(place, axis=0) == old[some])
    kept = np.zeros(len(old), bool)
    kept[some[same]] = True
    parents = np.full(len(old), -1, np.int32)
    parents[some[same]] = place[same]
    return kept, parents


def _first_edges(triangles: NDArray[np.int32]) -> NDArray[np.int64]:
    """The names (F,) of the edges from the first corners to the second, one triangle's each."""
    return triangles[:, 0].astype(np.int64) << 32 | triangles[:, 1]
