# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels of a detail: how their cells are numbered, and coefficients at some of their nodes.

A level k has cells of edge h_k = 2^-k that tile the box [-1, 1]^3 and `MARGIN` cells around it. A
cell has a place (3,), whole numbers from the grid's corner, and a linear number; its node is its
middle. Only nodes near what was sculpted or fitted have a coefficient.

Coefficients are whole multiples of `UNIT`, so float32 adds and subtracts them exactly: a sum of
layers does not depend on its order, and taking a layer away again leaves no trace. Model space.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

COARSEST, FINEST = 2, 9
"""Levels that can exist. A finer one needs indices of more than 32 bits, and its table 70 MB."""

UNIT = 2.0**-22
"""Of coefficients, model units: a tenth of what float32 tells apart in f near the surface."""

LARGEST = 2.0
"""Bound of |coefficient|; float32 holds sums of them up to 4 exactly."""

SUPPORT = 5
"""Level of the cells that tell where a layer reaches: finer ones are closer, and more."""

BRICK = 8  # cells along the edge of a brick
MARGIN = BRICK  # cells outside of the box, on each side


def block(start: int, end: int) -> NDArray[np.int32]:
    """All steps (n^3, 3) from `start` to before `end` on each axis, the last one fastest."""
    return (np.indices((end - start,) * 3).reshape(3, -1).T + start).astype(np.int32)


def spacing(level: int) -> float:
    """Edge of a cell, model units."""
    return 2.0**-level


def cells_per_axis(level: int) -> int:
    """Cells along each axis of a level's grid, margins included."""
    return 2 ** (level + 1) + 2 * MARGIN


def cells_of(points: NDArray[np.floating], level: int) -> NDArray[np.int32]:
    """The cells (N, 3) of a level around `points` (N, 3)."""
    return np.floor((points + 1) / spacing(level) + MARGIN).astype(np.int32)


def centres(cells: NDArray[np.int32], level: int) -> NDArray[np.float32]:
    """The middles (N, 3) of cells (N, 3): where their nodes are."""
    return ((cells + (0.5 - MARGIN)) * spacing(level) - 1).astype(np.float32)


def linear(cells: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """The numbers (N,) of cells (N, 3) of a level."""
    n = np.int32(cells_per_axis(level))
    return (cells[:, 0] * n + cells[:, 1]) * n + cells[:, 2]


def places(index: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """The cells (N, 3) of a level that have the numbers `index` (N,)."""
    n = np.int32(cells_per_axis(level))
    column, z = np.divmod(index, n)
    return np.stack([*np.divmod(column, n), z], axis=1)


def distinct(cells: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """The numbers (K,) of cells (N, 3), rising, but those at the grid's edge: they have no node."""
    return np.unique(linear(cells[_inner(cells, level)], level))


def merged(runs: NDArray[np.int32]) -> NDArray[np.int32]:
    """Each of the numbers (N,) once, rising. They come as a few rising runs, one after another,
    which NumPy's stable sort merges several times as fast as another one would sort them."""
    index = np.sort(runs, kind="stable")
    last = np.ones(len(index), bool)
    last[:-1] = index[:-1] < index[1:]
    return index[last]


def dilated(index: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """The cells `index` (N,), rising, of a level and all that touch them, as of `distinct`."""
    for step in linear(np.eye(3, dtype=np.int32), level):
        index = merged(np.concatenate([index - step, index, index + step]))
    return index[_inner(places(index, level), level)]


def children(index: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """The cells of the next level in cells `index` (N,), rising, of a level, as of `distinct`."""
    cells = (2 * places(index, level) - MARGIN + block(0, 2)[:, None]).reshape(-1, 3)
    return merged(linear(cells[_inner(cells, level + 1)], level + 1))


def _inner(cells: NDArray[np.int32], level: int) -> NDArray[np.bool_]:
    """Which of cells (N, 3) are not at the grid's edge, nor beyond it."""
    x, y, z = ((cells > 0) & (cells < cells_per_axis(level) - 1)).T
    return x & y & z


@dataclass(frozen=True)
class Level:
    """The coefficients of one level: those of all other nodes are zero."""

    index: NDArray[np.int32]  # (N,), `linear` numbers of the nodes, rising
    values: NDArray[np.float32]  # (N,), multiples of UNIT

    @staticmethod
    def sum(parts: Sequence["Level"]) -> "Level":
        """The sum of `parts` of one level, without what has become zero."""
        index, place = np.unique(np.concatenate([p.index for p in parts]), return_inverse=True)
        values = np.bincount(place, np.concatenate([p.values for p in parts]), len(index))
        some = np.flatnonzero(values)
        return Level(index[some], values[some].astype(np.float32))


Coefficients = Mapping[int, Level]
"""By level. What one stroke or fit adds."""


def quantised(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Values (N,) rounded to multiples of UNIT, within +-LARGEST."""
    return (np.rint(np.clip(values, -LARGEST, LARGEST) / UNIT) * UNIT).astype(np.float32)


def scaled(coefficients: Coefficients, strength: float) -> Coefficients:
    """The coefficients times a strength in [0, 1], rounded to multiples of UNIT."""
    if strength == 1:
        return coefficients
    return {k: Level(c.index, quantised(strength * c.values)) for k, c in coefficients.items()}


def support(coefficients: Coefficients) -> NDArray[np.int32]:
    """The `linear` numbers (S,) of the cells of level SUPPORT that coefficients reach, rising."""
    size = cells_per_axis(SUPPORT)
    reached = np.zeros(size**3, bool)
    for level, part in coefficients.items():
        cells = places(part.index, level) - MARGIN
        if level > SUPPORT:
            # A node reaches the cells beside its own. Of three fine cells in a row, the outer two
            # lie in all coarse cells that the row meets.
            ends = [(cells + side >> level - SUPPORT) + MARGIN for side in (-1, 1)]
            x, y, z = zip(*((end * (size * size, size, 1)).T for end in ends), strict=True)
            for corner in product(x, y, z):
                reached[sum(corner)] = True
            continue
        cells = (cells[:, None] + block(-1, 2)).reshape(-1, 3)
        for _ in range(SUPPORT - level):  # the eight children
            cells = np.unique(cells, axis=0)
            cells = (2 * cells[:, None] + block(0, 2)).reshape(-1, 3)
        cells += MARGIN
        cells = cells[((cells >= 0) & (cells < size)).all(axis=1)]
        reached[linear(cells, SUPPORT)] = True
    return np.flatnonzero(reached).astype(np.int32)
