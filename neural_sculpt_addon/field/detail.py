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
from itertools import product
from typing import NamedTuple

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


def block(start: int, end: int) -> NDArray[np.int32]:
    """All steps (n^3, 3) from `start` to before `end` on each axis, the last one fastest."""
    return (np.indices((end - start,) * 3).reshape(3, -1).T + start).astype(np.int32)


OFFSETS = block(0, 3) @ (_HALO * _HALO, _HALO, 1)  # (27,), from a cell to the nodes around it


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
    """Each of the numbers (N,) once, rising. They are some rising runs, one after another: Timsort,
    the stable one, puts these together several times as fast as it would be to sort them."""
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
        """A grid without nodes. One number stands for all of its table."""
        size = cells_per_axis(level) // BRICK
        table = torch.full((1, 1, 1), -1, dtype=torch.int32).expand((size,) * 3)
        return Grid(level, table, torch.empty((0, _HALO**3), dtype=dtype))

    def plus(self, index: NDArray[np.int32], values: NDArray) -> "Grid":
        """This grid with `values` (N,) added at the nodes `index` (N,), none at its very edge."""
        table = self.table.numpy().copy()
        size, flat = len(table), table.reshape(-1)
        x, y, z = places(index, self.level).T
        home = (x // BRICK * size + y // BRICK) * size + z // BRICK
        spot = ((x % BRICK + 1) * _HALO + y % BRICK + 1) * _HALO + z % BRICK + 1
        # Beside another brick a node lies in its halo, too.
        for stride, step in ((size * size, _HALO * _HALO), (size, _HALO), (1, 1)):
            place = spot // step % _HALO
            for end, side in ((1, -1), (BRICK, 1)):
                some = np.flatnonzero(place == end)
                home = np.append(home, home[some] + side * stride)
                spot = np.append(spot, spot[some] - side * BRICK * step)
                values = np.append(values, values[some])
        new = np.unique(home[flat[home] < 0])
        flat[new] = len(self.bricks) + np.arange(len(new), dtype=np.int32)
        bricks = np.zeros((len(self.bricks) + len(new), _HALO**3), self.bricks.numpy().dtype)
        bricks[: len(self.bricks)] = self.bricks.numpy()
        bricks.reshape(-1)[flat[home] * _HALO**3 + spot] += values
        return Grid(self.level, torch.from_numpy(table), torch.from_numpy(bricks))

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


class Around(NamedTuple):
    """What points see of grids: M pairs of a point and a grid that has a brick there.

    point:  (M,), which
    scale:  (M,), cells in a unit of length
    offset: (3, M), of the point from the middle of its cell, in cells
    nodes:  (27, M), the numbers at the nodes around
    """

    point: Tensor
    scale: Tensor
    offset: Tensor
    nodes: Tensor


def around(grids: Sequence[Grid], x: Tensor) -> Around:
    """What points x (N, 3) see of `grids`, grid by grid.

    All grids together: so few points fit the cache that the number of operations decides.
    """
    sizes = torch.tensor([[len(grid.table)] for grid in grids], device=x.device)  # (L, 1)
    scales = torch.tensor([1 / spacing(grid.level) for grid in grids], device=x.device)  # (L,)
    ends = BRICK * sizes[:, :, None]  # no node reaches there, so points beyond see zeros, too
    place = torch.minimum(((x.T + 1) * scales[:, None, None] + MARGIN).clamp_(min=0), ends)
    cell = torch.minimum(place.to(torch.int64), ends - 1)  # (L, 3, N)
    bx, by, bz = (cell // BRICK).unbind(1)  # (L, N) each
    homes = (bx * sizes + by) * sizes + bz
    rows = torch.stack([g.table.reshape(-1)[home] for g, home in zip(grids, homes, strict=True)])
    grid, point = torch.nonzero(rows >= 0, as_tuple=True)
    cell, place = cell[grid, :, point].T, place[grid, :, point].T  # (3, M)
    ix, iy, iz = cell % BRICK
    base = rows[grid, point].to(torch.int64) * _HALO**3 + (ix * _HALO + iy) * _HALO + iz
    index = base + torch.as_tensor(OFFSETS, device=x.device)[:, None]  # (27, M)
    each = index.split((rows >= 0).sum(dim=1).tolist(), dim=1)
    nodes = [torch.take(g.bricks, part) for g, part in zip(grids, each, strict=True)]
    return Around(point, scales[grid], place - cell - 0.5, torch.cat(nodes, dim=1))


def weights(offset: Tensor) -> Tensor:
    """Quadratic B-splines (3, ...) of the nodes below, at and above, by offsets (...) in cells."""
    return torch.stack([0.5 * (0.5 - offset) ** 2, 0.75 - offset**2, 0.5 * (0.5 + offset) ** 2])


def slopes(offset: Tensor) -> Tensor:
    """Their derivatives (3, ...), per cell."""
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

    def finest_at(self, points: NDArray[np.floating]) -> NDArray[np.int64]:
        """The finest level (N,) with a node in the cell of each of `points` (N, 3); COARSEST - 1
        where there is none."""
        finest = np.full(len(points), COARSEST - 1)
        for level, part in self.coefficients.items():
            some = np.isin(linear(cells_of(points, level), level), part.index)
            finest[some] = np.maximum(finest[some], level)
        return finest

    def up_to(self, level: int) -> "Detail":
        """This detail without levels that are finer."""
        return Detail(grid for grid in self.grids if grid.level <= level)

    def to(self, device: torch.device | str) -> "Detail":
        """The same detail on another device."""
        return Detail(Grid(g.level, g.table.to(device), g.bricks.to(device)) for g in self.grids)

    def add_value(self, x: Tensor, value: Tensor) -> None:
        """Add the detail at points x (N, 3) to `value` (N,)."""
        if self.grids:
            point, _, offset, nodes = around(self.grids, x)
            wx, wy, wz = weights(offset).unbind(1)  # (3, M) each
            c = (nodes.view(3, 3, 3, -1) * wz).sum(2)
            value.index_add_(0, point, ((c * wy).sum(1) * wx).sum(0))

    def add_value_and_gradient(self, x: Tensor, value: Tensor, gradient: Tensor) -> None:
        """Add the detail at points x (N, 3) to `value` (N,), its gradient to `gradient` (N, 3)."""
        if self.grids:
            point, scale, offset, nodes = around(self.grids, x)
            wx, wy, wz = weights(offset).unbind(1)  # (3, M) each
            sx, sy, sz = slopes(offset).unbind(1)
            c = nodes.view(3, 3, 3, -1)
            along_z = (((c * sz).sum(2) * wy).sum(1) * wx).sum(0)
            c = (c * wz).sum(2)
            along_y = ((c * sy).sum(1) * wx).sum(0)
            c = (c * wy).sum(1)
            value.index_add_(0, point, (c * wx).sum(0))
            along = torch.stack([(c * sx).sum(0), along_y, along_z], dim=1)  # per cell
            gradient.index_add_(0, point, along * scale[:, None])
