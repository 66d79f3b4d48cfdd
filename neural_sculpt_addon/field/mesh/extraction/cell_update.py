# SPDX-License-Identifier: GPL-3.0-or-later
"""Update of the active cells after an edit: they are searched for only where the surface moved.

All other cells are kept with the values at their corners. The search takes these values where it
comes to the same corners, so all cells agree on them and the surface stays closed. Cells and points
are named as in `lattice`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....common.progress import Progress, silent
from ...field import Field
from .cells import find_beside
from .lattice import ActiveCells, corner_steps


class UpdatedCells(NamedTuple):
    """The active cells after an edit."""

    active: ActiveCells
    fresh: NDArray[np.bool_]  # (A,), those that were searched for
    touched: NDArray[np.bool_]  # of the cells known before, those that were given up for these


def update_cells(
    known: ActiveCells,
    changed: NDArray[np.bool_],
    guesses: NDArray[np.int32],
    field: Field,
    progress: Progress = silent,
) -> UpdatedCells:
    """The active cells after an edit that moved the surface in the `changed` (A,) ones.

    A flood finds them, from where the surface was and from `guesses` (G,), cells where it may be
    now. Pieces born away from all of these are not seen. Cells that have a corner in common with a
    changed one are given up, all others kept.
    """
    corners = corner_steps(known.cells)[:, None]  # (8, 1)
    neighbours = np.unique(corners - corners.T)[:, None]  # (27, 1)
    touched = np.isin(known.index, known.index[changed] + neighbours, kind="table")
    kept, count = np.flatnonzero(~touched), len(known.index)
    held = ActiveCells(known.cells, known.index.take(kept), known.values.take(kept, axis=1))
    seeds = np.unique(np.concatenate([known.index[touched], guesses]))
    found = find_beside(held, seeds, field, progress)

    index = np.concatenate([held.index, found.index])
    order = np.argsort(index, kind="stable")  # quick, because they are two rising runs
    source = np.concatenate([kept, count + np.arange(len(found.index))]).take(order)
    values = np.concatenate([held.values, found.values], axis=1).take(order, axis=1)
    active = ActiveCells(known.cells, index.take(order), values)
    return UpdatedCells(active, source >= count, touched)
