# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching cubes after an edit: only the cells that were searched for anew, the rest as it was.

Vertices and triangles come in the order of their cells, so which of them belong to which cell is
told by the cells' sign codes, and new ones find their places by counting. That needs a mesh without
welded caps.
"""

import numpy as np
from numpy.typing import NDArray

from .again import FoundAgain
from .cells import ActiveCells, corner_steps
from .march import CROSSED, RawMesh, march, triangle_table


def splice(
    shown: RawMesh, known: ActiveCells, again: FoundAgain
) -> tuple[RawMesh, NDArray[np.bool_]]:
    """The mesh of the cells found `again`, given that of the `known`; its new vertices (V,)."""
    owned, count = CROSSED.sum(axis=1), triangle_table()[0]  # by sign code
    part, chosen = _with_owners(again.active, again.fresh)
    local = march(part, chosen)
    old, own, new = known.codes, part.codes, again.active.codes

    kept, fresh = np.repeat(~again.touched, owned[old]), np.repeat(again.fresh, owned[new])  # (V,)
    source = _sources(kept, fresh, np.repeat(chosen, owned[own]))
    arrays = {
        name: np.concatenate([getattr(shown, name), getattr(local, name)]).take(source, axis=0)
        for name in ("vertices", "normals", "slopes", "edges", "held", "cap")
    }
    number = _numbers(source, np.concatenate([shown.edges, local.edges]))
    corners = np.concatenate([shown.triangles, local.triangles + len(kept)])
    kept, new = np.repeat(~again.touched, count[old]), np.repeat(again.fresh, count[new])  # (F,)
    source = _sources(kept, new, np.ones(len(local.triangles), bool))
    return RawMesh(triangles=number.take(corners.take(source, axis=0)), **arrays), fresh


def _sources(
    kept: NDArray[np.bool_], fresh: NDArray[np.bool_], own: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """Where, among all old and then all new rows, each row (N,) comes from.

    fresh: (N,), whether it is a new one;  kept, own: which of the old and the new are used
    """
    source = np.empty(len(fresh), np.intp)
    source[~fresh], source[fresh] = np.flatnonzero(kept), len(kept) + np.flatnonzero(own)
    return source


def _numbers(source: NDArray[np.intp], edges: NDArray[np.int64]) -> NDArray[np.int32]:
    """The new number of all old and then all new vertices (N,), of which `source` (V,) are used.

    The others have the number of the one that is used on the same of the `edges` (N,).
    """
    number = np.full(len(edges), -1, np.int32)
    number[source] = np.arange(len(source), dtype=np.int32)
    others = np.flatnonzero(number < 0)
    number[others] = np.searchsorted(edges.take(source), edges.take(others))
    return number


def _with_owners(
    active: ActiveCells, chosen: NDArray[np.bool_]
) -> tuple[ActiveCells, NDArray[np.bool_]]:
    """The `chosen` (A,) cells and those that own an edge of theirs; which of these are chosen."""
    above = active.index[chosen] + corner_steps(active.cells)[:, None]
    near = np.isin(active.index, above, kind="table")
    return ActiveCells(active.cells, active.index[near], active.values[:, near]), chosen[near]
