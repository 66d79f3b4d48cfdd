# SPDX-License-Identifier: GPL-3.0-or-later
"""The lattice of a proxy: how its points and cells are numbered, and what is known of active ones.

A lattice of `cells` cells per axis spans the box [-1, 1]^3 of model space. Around the box lies one
more ring of points. Cells and points are linear indices into the ringed lattice, n = cells + 3
points per axis; a cell is named by its lowest corner. A cell is active when its eight corners
disagree in sign.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # (8, 3)


@dataclass(frozen=True)
class ActiveCells:
    """All active cells of a lattice of `cells` cells per axis of the box [-1, 1]^3."""

    cells: int
    index: NDArray[np.int32]  # (A,), rising
    values: NDArray[np.float32]  # (8, A), f at the corners; never zero

    @property
    def spacing(self) -> float:
        """Edge of a cell in model space."""
        return 2 / self.cells

    @cached_property
    def codes(self) -> NDArray[np.uint8]:
        """Signs of the corners (A,): bit c is set when corner c is inside."""
        return codes_of(self.values)


def steps(cells: int) -> NDArray[np.int32]:
    """Index steps along each axis (3,) of a lattice of `cells` cells per axis."""
    n = cells + 3
    return np.array([n * n, n, 1], np.int32)


def corner_steps(cells: int) -> NDArray[np.int32]:
    """Index steps (8,) from a cell to its corners."""
    return (CORNERS @ steps(cells)).astype(np.int32)


def places(points: NDArray[np.int32], cells: int) -> NDArray[np.int32]:
    """The three coordinates (3, P) of `points` (P,) in a lattice of `cells` cells per axis."""
    n = np.int32(cells + 3)
    column = points // n
    x = column // n
    return np.stack([x, column - n * x, points - n * column])


def edge_centres(edges: NDArray[np.int64], cells: int) -> NDArray[np.float32]:
    """Where the centres (V, 3) of edges are, each named 3 * (point at its lower end) + axis."""
    point, axis = np.divmod(edges, 3)
    place = places(point.astype(np.int32), cells).T.astype(np.float32)
    place += np.float32(0.5) * np.eye(3, dtype=np.float32).take(axis, axis=0) - 1
    return np.clip(place * np.float32(2 / cells) - 1, -1, 1)


def codes_of(value: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Which of the 8 corners, on the first axis, are inside, as bits; zero counts as inside."""
    codes = np.zeros(value.shape[1:], np.uint8)
    for corner, row in enumerate(value <= 0):
        codes |= row.view(np.uint8) << np.uint8(corner)
    return codes
