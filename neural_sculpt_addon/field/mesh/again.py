# SPDX-License-Identifier: GPL-3.0-or-later
"""The active cells after an edit, searched for only where the surface moved.

All other cells are kept with the values at their corners. What the search has in common with them
it takes from them, so the result is exactly that of one lattice: closed wherever the surface is.
Cells and points are named as in `cells`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Progress, silent
from ..field import Field
from .cells import UNKNOWN, ActiveCells, Search, clearance, corner_steps


class FoundAgain(NamedTuple):
    """The active cells after an edit."""

    active: ActiveCells
    fresh: NDArray[np.bool_]  # (A,), those that were searched for
    touched: NDArray[np.bool_]  # of the cells known before, those that were given up for these


def find_again(
    known: ActiveCells,
    changed: NDArray[np.bool_],
    guesses: NDArray[np.int32],
    field: Field,
    progress: Progress = silent,
) -> FoundAgain:
    """The active cells after an edit that moved the surface in the `changed` (A,) ones.

    A flood finds them, from where the surface was and from `guesses` (G,), cells where it may be
    now. Pieces born away from all of these are not seen. Cells that have a corner in common with a
    changed one are given up, all others kept.
    """
    corners = corner_steps(known.cells)[:, None]  # (8, 1)
    neighbours = np.unique(corners - corners.T)[:, None]  # (27, 1)
    touched = np.isin(known.index, known.index[changed] + neighbours, kind="table")
    search = _SearchAgain(known, ~touched, field, progress)
    seeds = search.unseen(np.unique(np.concatenate([known.index[touched], guesses])))
    corners = seeds + search.corners  # (8, S)
    search.evaluate(search.distinct(corners))
    found = search.flood(seeds[clearance(search.flat.take(corners)) < 0])

    kept, count = np.flatnonzero(~touched), len(known.index)
    index = np.concatenate([known.index.take(kept), found.index])
    order = np.argsort(index, kind="stable")  # quick, because they are two rising runs
    source = np.concatenate([kept, count + np.arange(len(found.index))]).take(order)
    values = np.concatenate([known.values, found.values], axis=1).take(source, axis=1)
    active = ActiveCells(known.cells, index.take(order), values)
    return FoundAgain(active, source >= count, touched)


class _SearchAgain(Search):
    """A search among `known` cells, of which some are `kept` (A,)."""

    def __init__(
        self, known: ActiveCells, kept: NDArray[np.bool_], field: Field, progress: Progress
    ) -> None:
        super().__init__(field, known.cells, progress)
        self.known, self.kept = known, kept

    def unseen(self, cells: NDArray[np.int32]) -> NDArray[np.int32]:
        """Those of `cells` (A,) that are neither kept nor reached yet."""
        cells = super().unseen(cells)
        return cells[~self._find(cells)[1]]

    def evaluate(self, points: NDArray[np.int32]) -> None:
        """Make the field known at the lattice points (P,), each once: kept values stay."""
        points = points.compress(self.flat.take(points) == UNKNOWN)
        for step, value in zip(self.corners.ravel(), self.known.values, strict=True):
            row, kept = self._find(points - step)
            self.flat[points[kept]] = value.take(row[kept])
        super().evaluate(points)

    def _find(self, cells: NDArray[np.int32]) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Where each of `cells` (N,) is among the known ones, and whether it is kept."""
        row = np.searchsorted(self.known.index, cells)
        found = self.known.index.take(row, mode="clip") == cells
        return row, found & self.kept.take(row, mode="clip")
