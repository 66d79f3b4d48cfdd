# SPDX-License-Identifier: GPL-3.0-or-later
"""Detail: a sparse multilevel grid of quadratic B-splines (docs/method.md, section 1).

    detail(x) = sum over levels k, nodes i of  c_ki B((x - x_ki) / h_k),   h_k = 2^-k

B is the tensor product of the uniform quadratic B-spline, 1.5 wide on either side: it is C1, so
normals are continuous, and 27 nodes reach a point. A level has cells of edge h_k that tile the box
[-1, 1]^3 and `MARGIN` cells around it; node i is the middle of cell i. Only nodes near what was
sculpted or fitted exist, and outside of their supports detail(x) is exactly zero. Multilevel
B-splines: Lee, Wolberg and Shin 1997; sparse grids of neural fields: Takikawa et al. 2021.

`Coefficients` are the sparse form, which is stored and sent; a `Detail` is the form that is
evaluated: bricks of 8^3 cells with a halo of one node, found through a dense table. Coefficients
are whole multiples of `UNIT`, so float32 adds and subtracts them exactly: a sum of layers does not
depend on its order, and taking a layer away again leaves no trace. Model space.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

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
_HALO = BRICK + 2  # nodes along the edge of a brick with its halo
_AROUND = [(i, j, k) for i in range(3) for j in range(3) for k in range(3)]
OFFSETS = np.array(_AROUND) @ (_HALO * _HALO, _HALO, 1)  # (27,), from a cell to the nodes around it


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
        # A node reaches the cells beside its own. Of three fine cells in a row, the outer two lie
        # in all coarse cells that the row meets.
        steps = (-1, 1) if level > SUPPORT else (-1, 0, 1)
        around = np.array([(i, j, k) for i in steps for j in steps for k in steps])
        cells = (places(part.index, level)[:, None] + around).reshape(-1, 3) - MARGIN
        cells >>= max(level - SUPPORT, 0)
        for _ in range(SUPPORT - level):  # the eight children
            cells = np.unique(cells, axis=0)
            halves = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
            cells = (2 * cells[:, None] + halves).reshape(-1, 3)
        cells += MARGIN
        cells = cells[((cells >= 0) & (cells < size)).all(axis=1)].astype(np.int32)
        reached[linear(cells, SUPPORT)] = True
    return np.flatnonzero(reached).astype(np.int32)


class Grid:
    """Numbers at the nodes of one level, in bricks: `table` leads from a brick's place to its row.

    table:  (B, B, B) int32, -1 where there is no brick
    bricks: (M, 10^3), the nodes of its 8^3 cells and one more on each side
    """

    def __init__(self, level: int, table: Tensor, bricks: Tensor) -> None:
        """Parts of `level` as they are."""
        self.level, self.table, self.bricks = level, table, bricks

    @staticmethod
    def empty(level: int, dtype: torch.dtype = torch.float32) -> "Grid":
        """A grid without nodes."""
        size = cells_per_axis(level) // BRICK
        table = torch.full((size,) * 3, -1, dtype=torch.int32)
        return Grid(level, table, torch.empty((0, _HALO**3), dtype=dtype))

    def plus(self, index: NDArray[np.int32], values: NDArray) -> "Grid":
        """This grid with `values` (N,) added at the nodes `index` (N,), none at its very edge."""
        cells = places(index, self.level)
        brick, place = cells // BRICK, cells % BRICK
        table = self.table.numpy().copy()
        size = len(table)
        homes = (brick[:, 0] * size + brick[:, 1]) * size + brick[:, 2]
        rows, locals_, chosen = [], [], []
        for step in np.array(_AROUND) - 1:
            inside = np.ones(len(cells), bool)  # which nodes lie in the halo of that neighbour
            for axis in np.flatnonzero(step):
                inside &= place[:, axis] == (BRICK - 1 if step[axis] > 0 else 0)
            some = np.flatnonzero(inside)
            if len(some):
                rows.append(homes[some] + (step[0] * size + step[1]) * size + step[2])
                local = place[some] + 1 - BRICK * step
                locals_.append((local[:, 0] * _HALO + local[:, 1]) * _HALO + local[:, 2])
                chosen.append(some)
        if not rows:
            return self
        homes, local, some = map(np.concatenate, (rows, locals_, chosen))
        flat = table.reshape(-1)
        new = np.unique(homes[flat[homes] < 0])
        flat[new] = len(self.bricks) + np.arange(len(new), dtype=np.int32)
        bricks = np.zeros((len(self.bricks) + len(new), _HALO**3), self.bricks.numpy().dtype)
        bricks[: len(self.bricks)] = self.bricks.numpy()
        bricks.reshape(-1)[flat[homes].astype(np.int64) * _HALO**3 + local] += values[some]
        return Grid(self.level, torch.from_numpy(table), torch.from_numpy(bricks))

    def around(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Which of the points x (N, 3) lie in a brick (n,), where in `bricks` the first of the 27
        nodes around each of those is (n,), and their offsets (3, n) in cells from the middle one.
        """
        size = len(self.table)
        place = (x.T + 1) * (1 / spacing(self.level)) + MARGIN  # (3, N)
        cell = place.floor()
        index = cell.to(torch.int64).clamp_(0, size * BRICK - 1)
        brick = index >> 3
        row = self.table.view(-1)[(brick[0] * size + brick[1]) * size + brick[2]]
        row[((cell < 0) | (cell >= size * BRICK)).any(dim=0)] = -1
        some = torch.nonzero(row >= 0)[:, 0]
        x_, y_, z_ = index[:, some] & 7
        base = row[some].to(torch.int64) * _HALO**3 + (x_ * _HALO + y_) * _HALO + z_
        return some, base, (place - cell - 0.5)[:, some]

    def take(self, base: Tensor) -> Tensor:
        """The numbers (27, n) of the nodes around points, given where those begin (n,)."""
        index = base + torch.as_tensor(OFFSETS, device=base.device)[:, None]
        return self.bricks.view(-1).index_select(0, index.view(-1)).view(27, -1)

    def nodes(self) -> Level:
        """The nodes that are not zero."""
        if not len(self.bricks):
            return Level(np.empty(0, np.int32), np.empty(0, np.float32))
        table = self.table.numpy()
        where = np.argwhere(table >= 0).astype(np.int32)  # (M, 3)
        rows = table[tuple(where.T)]
        inner = self.bricks.view(-1, *(_HALO,) * 3)[:, 1:-1, 1:-1, 1:-1].numpy()[rows]
        row, *local = np.nonzero(inner)
        cells = BRICK * where[row] + np.stack(local, axis=1).astype(np.int32)
        index = linear(cells, self.level)
        order = np.argsort(index)
        return Level(index[order], inner[(row, *local)][order])


def weights(offset: Tensor) -> Tensor:
    """Quadratic B-splines (3, n) of the nodes below, at and above, by offsets (n,) in cells."""
    return torch.stack([0.5 * (0.5 - offset) ** 2, 0.75 - offset**2, 0.5 * (0.5 + offset) ** 2])


def slopes(offset: Tensor) -> Tensor:
    """Their derivatives (3, n), per cell."""
    return torch.stack([offset - 0.5, -2 * offset, offset + 0.5])


class Detail:
    """The sum of all levels; an immutable value."""

    def __init__(self, grids: Iterable[Grid] = ()) -> None:
        """At most one grid of each level."""
        self.grids = tuple(grids)

    @staticmethod
    def of(*terms: Coefficients) -> "Detail":
        """The sum of `terms`."""
        detail = Detail()
        for coefficients in terms:
            detail = detail.plus(coefficients)
        return detail

    def plus(self, coefficients: Coefficients, sign: int = 1) -> "Detail":
        """This detail with `coefficients` added, or with -1 taken away."""
        grids = {grid.level: grid for grid in self.grids}
        for level, part in coefficients.items():
            if len(part.index):
                grid = grids.get(level) or Grid.empty(level)
                grids[level] = grid.plus(part.index, sign * part.values)
        return Detail(grids[level] for level in sorted(grids))

    @cached_property
    def coefficients(self) -> Coefficients:
        """All coefficients that are not zero."""
        parts = {grid.level: grid.nodes() for grid in self.to("cpu").grids}
        return {level: part for level, part in parts.items() if len(part.index)}

    @property
    def levels(self) -> tuple[int, ...]:
        """The levels that exist, rising."""
        return tuple(grid.level for grid in self.grids)

    def to(self, device: torch.device | str) -> "Detail":
        """The same detail on another device."""
        return Detail(Grid(g.level, g.table.to(device), g.bricks.to(device)) for g in self.grids)

    def add_value(self, x: Tensor, value: Tensor) -> None:
        """Add the detail at points x (N, 3) to `value` (N,)."""
        for grid in self.grids:
            some, base, offset = grid.around(x)
            if len(some):
                wx, wy, wz = map(weights, offset)  # (3, n) each
                c = (grid.take(base).view(3, 3, 3, -1) * wz).sum(2)
                value[some] += ((c * wy).sum(1) * wx).sum(0)

    def add_value_and_gradient(self, x: Tensor, value: Tensor, gradient: Tensor) -> None:
        """Add the detail at points x (N, 3) to `value` (N,), its gradient to `gradient` (N, 3)."""
        for grid in self.grids:
            some, base, offset = grid.around(x)
            if len(some):
                wx, wy, wz = map(weights, offset)  # (3, n) each
                sx, sy, sz = map(slopes, offset)
                c = grid.take(base).view(3, 3, 3, -1)
                along_z = (((c * sz).sum(2) * wy).sum(1) * wx).sum(0)
                c = (c * wz).sum(2)
                along_y = ((c * sy).sum(1) * wx).sum(0)
                c = (c * wy).sum(1)
                value[some] += (c * wx).sum(0)
                along = torch.stack([(c * sx).sum(0), along_y, along_z], dim=1)  # per cell
                gradient[some] += along / spacing(grid.level)
