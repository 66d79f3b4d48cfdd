# SPDX-License-Identifier: GPL-3.0-or-later
"""Update of a mesh by marching cubes after an edit, in the cells alone that were searched for anew.

Vertices and triangles come in the order of their cells, and a cell's sign code says how many it
has. So counting tells which belong to which cell, and where new ones come. That needs a mesh
without welded caps. Model space.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cell_update import UpdatedCells
from .lattice import ActiveCells, corner_steps
from .march import CROSSED, RawMesh, march, triangle_table


def update_mesh(
    shown: RawMesh, known: ActiveCells, updated: UpdatedCells
) -> tuple[RawMesh, NDArray[np.intp]]:
    """The mesh of the `updated` cells, given that of the `known` ones.

    Beside it the number (V,) that each of its vertices had before; new ones count on from there.
    """
    part, chosen = _with_owners(updated.active, updated.fresh)
    local = march(part, chosen)
    own = CROSSED.sum(axis=1).take(part.codes)  # vertices of each cell
    count = len(shown.vertices)
    vertices = _Patch(known, updated, CROSSED.sum(axis=1), np.flatnonzero(np.repeat(chosen, own)))
    triangles = _Patch(known, updated, triangle_table()[0], np.arange(len(local.triangles)))
    source = vertices.apply(np.arange(count), count + np.arange(len(local.vertices)))
    number = _numbers(source, np.concatenate([shown.edges, local.edges]))
    mesh = RawMesh(
        vertices.apply(shown.vertices, local.vertices),
        vertices.apply(shown.normals, local.normals),
        number.take(triangles.apply(shown.triangles, local.triangles + np.int32(count))),
        vertices.apply(shown.edges, local.edges),
        vertices.apply(shown.held, local.held),
        vertices.apply(shown.cap, local.cap),
    )
    return mesh, source


class _Patch:
    """Which rows of old and new arrays come together, where each cell has some rows, in order.

    Only from the first to the last cell that differs are they looked at one by one.
    """

    def __init__(
        self,
        known: ActiveCells,
        updated: UpdatedCells,
        rows: NDArray[np.integer],
        own: NDArray[np.intp],
    ) -> None:
        """rows: of a cell of each sign code (256,);  own: the rows of the new arrays to be used"""
        touched, fresh = updated.touched, updated.fresh
        before, after = _unchanged(touched, fresh), _unchanged(touched[::-1], fresh[::-1])
        old, new = slice(before, len(touched) - after), slice(before, len(fresh) - after)
        kept = np.repeat(~touched[old], rows.take(known.codes[old]))
        fresh = np.repeat(fresh[new], rows.take(updated.active.codes[new]))
        self.start = rows.take(known.codes[:before]).sum()
        self.end = self.start + len(kept)
        self.source = np.empty(len(fresh), np.intp)
        self.source[~fresh] = np.flatnonzero(kept)
        self.source[fresh] = len(kept) + own

    def apply(self, old: NDArray[Any], new: NDArray[Any]) -> NDArray[Any]:
        """The rows of `old` that are kept and those of `new` that are used."""
        between = np.concatenate([old[self.start : self.end], new]).take(self.source, axis=0)
        return np.concatenate([old[: self.start], between, old[self.end :]])


def _unchanged(touched: NDArray[np.bool_], fresh: NDArray[np.bool_]) -> int:
    """How many cells at the beginning are neither."""
    return min(int(np.argmax(np.append(flags, True))) for flags in (touched, fresh))


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
