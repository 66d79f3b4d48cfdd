# SPDX-License-Identifier: GPL-3.0-or-later
"""Detail: a sparse multilevel grid of quadratic B-splines (docs/method.md, section 1).

    detail(x) = sum over levels k, nodes i of  c_ki B((x - x_ki) / h_k),   h_k = 2^-k

B is the tensor product of the uniform quadratic B-spline, 1.5 wide on either side: it is C1, so
normals are continuous, and 27 nodes reach a point. Outside of the supports of the nodes that exist
detail(x) is exactly zero. Multilevel B-splines: Lee, Wolberg and Shin 1997; sparse grids of neural
fields: Takikawa et al. 2021.

Coefficients are stored and sent in the sparse form of `levels`; a `Detail` is the form that is
evaluated: bricks of 8^3 cells with a halo of one node, found through a dense table. Model space.
"""

from collections.abc import Iterable, Sequence
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from .levels import (
    BRICK,
    COARSEST,
    MARGIN,
    Coefficients,
    Level,
    block,
    cells_of,
    cells_per_axis,
    centres,
    linear,
    places,
    spacing,
)

_SHIFT = BRICK.bit_length() - 1  # torch shifts whole numbers six times as fast as it divides them
_HALO = BRICK + 2  # nodes along the edge of a brick with its halo
_INNER = np.pad(np.ones((BRICK,) * 3, bool), 1).ravel()  # which nodes of a brick are not its halo
OFFSETS = block(0, 3) @ (_HALO * _HALO, _HALO, 1)  # (27,), from a cell to the nodes around it
_OWN = OFFSETS[len(OFFSETS) // 2]  # to its own


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

    @property
    def is_zero(self) -> bool:
        """Whether all nodes are zero: a look at the first brick, but where much was taken away."""
        return not any(brick.any() for brick in self.bricks.numpy())

    def has_brick(self, points: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Whether there is a brick at each of `points` (N, 3): where there is none, no node reaches
        them."""
        table = self.table.cpu().numpy()
        bricks = np.clip(cells_of(points, self.level) // BRICK, 0, len(table) - 1)
        return table[tuple(bricks.T)] >= 0

    def reaches(self, points: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Whether a node that is not zero reaches each of `points` (N, 3) of the box."""
        found, first, bricks = self._cells(points)
        zero = bricks.take(first + _OWN) == 0  # few have none of their own
        left, first = np.flatnonzero(found).compress(zero), first.compress(zero)
        found[left] = bricks.take(first + OFFSETS[:, None]).any(axis=0)
        return found

    def has_node(self, points: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Whether the node in the cell of each of `points` (N, 3) of the box is not zero."""
        found, first, bricks = self._cells(points)
        found[found] = bricks.take(first + _OWN) != 0
        return found

    def _cells(
        self, points: NDArray[np.floating]
    ) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray]:
        """Which of points (N, 3) lie in a brick; the first node around the cell of each that does,
        among all bricks' nodes, which are given, too."""
        table, bricks = self.table.cpu().numpy(), self.bricks.cpu().numpy().ravel()
        size, cells = len(table), cells_of(points, self.level)
        x, y, z = (cells >> _SHIFT).T
        rows = table.ravel().take((x * size + y) * size + z)
        found = rows >= 0
        x, y, z = (cells.compress(found, axis=0) & (BRICK - 1)).T
        first = rows.compress(found) * _HALO**3 + ((x * _HALO + y) * _HALO + z)
        return found, first, bricks

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

    def extremes(self, least: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The nodes beyond +-`least` that are the greatest or the least of the seven that they and
        their neighbours along the axes are: their middles (P, 3), and how far they are from 0 (P,).
        """
        bricks = self.bricks.numpy()
        flat = bricks.reshape(-1)
        large = np.flatnonzero((np.abs(bricks) > least) & _INNER)
        found = []
        for sign in (1, -1):
            spots = large
            for step in (1, _HALO, _HALO * _HALO):
                own = sign * flat[spots]
                is_most = own >= sign * flat[spots - step]
                spots = spots[is_most & (own >= sign * flat[spots + step])]
            found.append(spots)
        spots = np.concatenate(found)
        row, spot = np.divmod(spots, _HALO**3)
        table = self.table.numpy()
        used = np.flatnonzero(table.reshape(-1) >= 0)
        home = np.empty_like(used)
        home[table.reshape(-1)[used]] = used
        brick = np.stack(np.unravel_index(home[row], table.shape), axis=1)
        local = np.stack(np.unravel_index(spot, (_HALO,) * 3), axis=1) - 1
        middles = centres((BRICK * brick + local).astype(np.int32), self.level)
        return middles, np.abs(flat[spots])


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
    sizes, scales, steps = _layout(tuple(grid.level for grid in grids), x.device)
    ends = BRICK * sizes  # no node reaches there, so points beyond see zeros, too
    place = ((x.T.contiguous()[:, None] + 1) * scales + MARGIN).clamp_(min=0)  # (3, L, N)
    place = torch.minimum(place, ends)
    cell = torch.minimum(place.to(torch.int32), ends - 1)
    bx, by, bz = cell >> _SHIFT  # (L, N) each
    homes = (bx * sizes + by) * sizes + bz
    rows = torch.stack([_rows(g.table, home) for g, home in zip(grids, homes, strict=True)])
    ix, iy, iz = cell & (BRICK - 1)
    base = rows * _HALO**3 + ((ix * _HALO + iy) * _HALO + iz)
    there = rows >= 0
    pair = torch.nonzero(there.view(-1))[:, 0]  # (M,)
    grid = pair // len(x)
    offset = (place - cell - 0.5).view(3, -1).index_select(1, pair)
    each = base.view(-1).index_select(0, pair).split(there.sum(dim=1).tolist())
    nodes = [_rows(g.bricks, part + steps) for g, part in zip(grids, each, strict=True)]
    scale = scales[:, 0].index_select(0, grid)
    return Around(pair - grid * len(x), scale, offset, torch.cat(nodes, dim=1))


def _rows(numbers: Tensor, index: Tensor) -> Tensor:
    """The `numbers` at the places `index` of all, in its shape: `torch.take`, in a third of the
    time."""
    return numbers.reshape(-1).index_select(0, index.view(-1)).view(index.shape)


@cache
def _layout(levels: tuple[int, ...], device: torch.device) -> tuple[Tensor, Tensor, Tensor]:
    """Bricks along an axis (L, 1) and cells in a unit of length (L, 1) of the grids of `levels`;
    OFFSETS (27, 1)."""
    with torch.inference_mode(False):  # autograd may come across them later
        sizes = [[cells_per_axis(level) // BRICK] for level in levels]
        scales = torch.tensor([[1 / spacing(level)] for level in levels], device=device)
        steps = torch.tensor(OFFSETS[:, None], dtype=torch.int32, device=device)
        return torch.tensor(sizes, dtype=torch.int32, device=device), scales, steps


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
                if grids[level].is_zero:
                    del grids[level]
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
        """The finest level (N,) with a node that is not zero in the cell of each of `points` (N, 3)
        of the box; COARSEST - 1 where there is none."""
        finest = np.full(len(points), COARSEST - 1)
        for grid in self.grids:
            finest[grid.has_node(points)] = grid.level
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
