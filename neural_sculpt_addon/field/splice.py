# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching cubes after an edit: only the cells that were searched for anew, the rest as it was.

Vertices and triangles come in the order of their cells, so which of them belong to which cell is
told by the cells' sign codes, and new ones find their places by counting. That needs a mesh without
welded caps.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cells import ActiveCells, FoundAgain, corner_steps
from .march import CROSSED, RawMesh, march, triangle_table


def splice(
    shown: RawMesh, known: ActiveCells, again: FoundAgain
) -> tuple[RawMesh, NDArray[np.bool_]]:
    """The mesh of the cells found `again`, given that of the `known`; its new vertices (V,)."""
    owned, count = CROSSED.sum(axis=1), triangle_table()[0]  # by sign code
    part, chosen = _with_owners(again.active, again.fresh)
    local = march(part, chosen)
    old, own, new = known.codes, part.codes, again.active.codes

    fresh = np.repeat(again.fresh, owned[new])  # (V,)
    kept = np.repeat(~again.touched, owned[old])
    source = _sources(fresh, kept, np.repeat(chosen, owned[own]))

    def merged(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(shown, name), getattr(local, name)]).take(source, axis=0)

    edges = merged("edges")
    number = np.concatenate([np.searchsorted(edges, mesh.edges) for mesh in (shown, local)])
    corners = np.concatenate([shown.triangles, local.triangles + len(kept)])
    kept = np.repeat(~again.touched, count[old])  # of the triangles
    own = np.ones(len(local.triangles), bool)
    triangles = corners.take(_sources(np.repeat(again.fresh, count[new]), kept, own), axis=0)
    triangles = number.astype(np.int32).take(triangles)
    mesh = RawMesh(
        merged("vertices"),
        merged("normals"),
        merged("slopes"),
        triangles,
        edges,
        merged("held"),
        merged("cap"),
    )
    return mesh, fresh


def _sources(
    fresh: NDArray[np.bool_], kept: NDArray[np.bool_], own: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """Where, among all old and then all new rows, each row (N,) comes from.

    fresh: (N,), whether it is a new one;  kept, own: which of the old and the new are used
    """
    source = np.empty(len(fresh), np.intp)
    source[~fresh], source[fresh] = np.flatnonzero(kept), len(kept) + np.flatnonzero(own)
    return source


def _with_owners(
    active: ActiveCells, chosen: NDArray[np.bool_]
) -> tuple[ActiveCells, NDArray[np.bool_]]:
    """The `chosen` (A,) cells and those that own an edge of theirs; which of these are chosen."""
    wanted = np.zeros((active.cells + 3) ** 3, bool)
    wanted[active.index[chosen] + corner_steps(active.cells)[:, None]] = True
    near = wanted[active.index]
    return ActiveCells(active.cells, active.index[near], active.values[:, near]), chosen[near]
