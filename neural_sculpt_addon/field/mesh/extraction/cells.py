# SPDX-License-Identifier: GPL-3.0-or-later
"""Active cells, which the surface passes through, found without evaluating all the others.

Marching cubes needs the active cells and no other. Two steps find them:

1. An octree over the lattice's own points. A block of cells is divided if its corners change sign,
   or if they are so close to the surface that it may hide between them; of its children those go on
   where interpolation says so. Both err by the square of the edge, and so the margins are (a
   Lipschitz bound of the weights would be 30 times wider).
2. A flood. Where the corners of a face disagree, the cell on its other side is active too; such
   faces lead through every component of which the octree found a single cell. So where a block's
   corners change sign the octree need not be careful.

Small pieces far from the others, which neither comes to, are looked for in the detail
(`loose_pieces`).

Around the box lies one more ring of points, said to be outside, so that a surface that leaves the
box is closed off on its faces. The ring also keeps the flood's index arithmetic inside the array.
Cells and points are named as in `lattice`.
"""

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ....common.errors import SculptError
from ....common.progress import Progress, silent
from ...evaluate import values
from ...field import Field
from .lattice import CORNERS, ActiveCells, codes_of, corner_steps, places, steps
from .loose_pieces import loose_places

ROOT_BLOCKS = 16  # blocks per axis at least, before the first division
BATCH = 1 << 14  # points between two looks at `progress`; some 8 ms, in wide networks 20
WIDEST_LEVEL = 1 << 19  # blocks handled at once; bounds the memory of the descent
CROSSED_MARGIN, HIDING_MARGIN = 1, 6
"""Margins of f, in squares of a block's edge: wider ones look at more blocks, narrower ones may
miss what hides between the corners of one."""
UNKNOWN = np.float32(0)  # never evaluated: a value of zero is stored as INSIDE
INSIDE, OUTSIDE = np.float32(-1e-12), np.float32(1)

Values = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""f at points (N, 3) -> (N,)."""

# Whether the corners of a face disagree, for each sign code: (axis, side) -> (256,).
_CODE_BITS = np.arange(256)[:, None] >> np.arange(8) & 1  # (256, 8)
_MIXED_FACE = {
    (axis, side): np.isin(_CODE_BITS[:, CORNERS[:, axis] == side].sum(axis=1), (1, 2, 3))
    for axis in range(3)
    for side in (0, 1)
}


def find_active(field: Field, cells: int, progress: Progress = silent) -> ActiveCells:
    """The active cells of `field`. SculptError when it yields values that are not finite."""
    search = Search(partial(values, field), cells, progress)
    active = search.flood(np.concatenate([search.descend(), search.ring_seeds()]))
    loose = search.loose_seeds(field)
    return search.flood(np.concatenate([active.index, loose])) if len(loose) else active


def find_beside(
    kept: ActiveCells, seeds: NDArray[np.int32], field: Field, progress: Progress = silent
) -> ActiveCells:
    """The active cells of `field` among `seeds` (S,), rising, and those that a flood finds from
    there: none of the `kept` ones, which stay as they are, with the values at their corners.

    Away from the seeds and the cells beside them the field must be what it was.
    """
    search = Search(partial(values, field), kept.cells, progress)
    if len(seeds):
        beside = int(search.steps.sum())
        ends = np.searchsorted(kept.index, (seeds[0] - beside, seeds[-1] + beside + 1))
        index = kept.index[slice(*ends)]
        search.seen[index] = True
        for step, known in zip(search.corners.ravel(), kept.values, strict=True):
            search.flat[index + step] = known[slice(*ends)]
    return search.flood(search.crossed(search.unseen(seeds)))


def find_near(
    value: Values,
    cells: int,
    points: NDArray[np.float32],
    within: Callable[[NDArray[np.int32]], NDArray[np.bool_]],
    progress: Progress = silent,
) -> ActiveCells:
    """The active cells of `value` around points (N, 3), and those that a flood finds from there
    `within` a part of the lattice: see `Search.flood`."""
    search = Search(value, cells, progress)
    seeds = search.distinct(search.cells_at(points))
    return search.flood(search.crossed(seeds[within(seeds)]), within)


class Search:
    """The state of one search: the values so far, the cells so far.

    The arrays span the lattice, but of memory that nobody touches the system gives none.
    """

    def __init__(self, value: Values, cells: int, progress: Progress) -> None:
        self.value, self.cells, self.progress = value, cells, progress
        self.n = cells + 3
        self.flat = np.zeros(self.n**3, np.float32)
        self.seen = np.zeros(self.n**3, bool)  # cells that are known to be active
        self.steps = steps(cells)
        self.corners = corner_steps(cells)[:, None]  # (8, 1)
        self.spacing = 2 / cells
        self.axis = np.full(self.n, 2, np.float32)  # coordinates of the points; 2 in the ring
        self.axis[1:-1] = np.linspace(-1, 1, cells + 1)
        self.root = _root_stride(cells)
        self.fraction = 0.0

    @cached_property
    def wanted(self) -> NDArray[np.bool_]:
        """Points (n^3,), marked for a moment."""
        return np.zeros(self.n**3, bool)

    def descend(self) -> NDArray[np.int32]:
        """Active cells found by the octree (A,)."""
        blocks = self.outer_sum(np.arange(1, self.cells + 1, self.root))  # (R,)
        slope = self.slope()
        found = [np.empty(0, np.int32)]
        stack = [(self.root, part) for part in _parts(blocks)]
        divided, roots = 0, len(stack)
        while stack:
            stride, blocks = stack.pop()
            edge = stride * self.spacing
            corners = blocks + stride * self.corners  # (8, B)
            self.evaluate(self.distinct(corners))
            value = self.flat.take(corners)  # (8, B)
            free = clearance(value)
            if stride == 1:
                found.append(blocks[free < 0])
                continue
            square = slope * edge**2
            keep = free < HIDING_MARGIN * square
            margin = np.where(
                free[keep] < 0, CROSSED_MARGIN * square, HIDING_MARGIN * square
            )  # (B',)
            children = blocks[keep] + stride // 2 * self.corners  # (8, B')
            children = children[_expected(value.compress(keep, axis=1)) < margin]
            stack.extend((stride // 2, part) for part in _parts(children))
            if stride == self.root:
                divided += 1
                self.fraction = 0.9 * divided / roots
        return np.concatenate(found)

    def slope(self) -> float:
        """The steepest change of f between neighbouring root points, 1 at least.

        A field steeper than a distance changes sign within a wider margin of f.
        """
        points = self.outer_sum(np.arange(1, self.cells + 2, self.root))
        self.evaluate(points)
        size = self.cells // self.root + 1
        value = self.flat[points].reshape(size, size, size)
        steepest = max(float(np.abs(np.diff(value, axis=axis)).max()) for axis in range(3))
        return max(1.0, steepest / (self.root * self.spacing))

    def ring_seeds(self) -> NDArray[np.int32]:
        """Cells of the ring beside a root point that is inside: seeds of the closing faces."""
        points = self.outer_sum(np.arange(1, self.cells + 2, self.root))
        points = points[self.flat[points] < 0]
        place = places(points, self.cells)
        points = points[((place == 1) | (place == self.cells + 1)).any(axis=0)]
        return self.crossed(np.unique(points - self.corners))

    def loose_seeds(self, field: Field) -> NDArray[np.int32]:
        """Active cells of loose pieces of the field, after a flood that has not come to them."""
        around = np.unique(self.corners - self.corners.T)  # (27,)

        def unseen(points: NDArray[np.float32]) -> NDArray[np.bool_]:
            return ~self.seen.take(self.cells_at(points) + around[:, None]).any(axis=0)

        beside = self.cells_at(loose_places(field, unseen))[:, None] + around
        inner = np.unique(beside)
        place = places(inner, self.cells)
        inner = inner[((place > 0) & (place <= self.cells)).all(axis=0)]
        return self.crossed(inner)

    def cells_at(self, points: NDArray[np.float32]) -> NDArray[np.int32]:
        """The cells (N,) around points (N, 3), or next to them where they lie outside the box."""
        place = np.floor((points + 1) / self.spacing).astype(np.int32).clip(0, self.cells - 1)
        return (place + 1) @ self.steps

    def crossed(self, cells: NDArray[np.int32]) -> NDArray[np.int32]:
        """Those of `cells` (A,), each there once, that are active."""
        corners = cells + self.corners  # (8, A)
        self.evaluate(self.distinct(corners))
        return cells[clearance(self.flat.take(corners)) < 0]

    def flood(
        self,
        frontier: NDArray[np.int32],
        within: Callable[[NDArray[np.int32]], NDArray[np.bool_]] | None = None,
    ) -> ActiveCells:
        """The cells of `frontier` (A,), and those that faces of mixed sign lead to from there.

        within: which of cells (C,) may be among them, if not all
        """
        self.fraction = 0.9
        found = []
        while len(frontier):
            self.seen[frontier] = True
            found.append(frontier)
            codes = codes_of(self.flat.take(frontier + self.corners))  # (A,)
            reached = np.concatenate(
                [
                    frontier.compress(mixed.take(codes)) + (2 * side - 1) * self.steps[axis]
                    for (axis, side), mixed in _MIXED_FACE.items()
                ]
            )
            frontier = np.unique(self.unseen(reached))
            if within is not None:
                frontier = frontier[within(frontier)]
            self.evaluate(self.distinct(frontier + self.corners))
        index = self.distinct(np.concatenate(found)) if found else frontier
        return ActiveCells(self.cells, index, self.flat.take(index + self.corners))

    def unseen(self, cells: NDArray[np.int32]) -> NDArray[np.int32]:
        """Those of `cells` (A,) that the flood has not reached yet."""
        return cells.compress(~self.seen.take(cells))

    def distinct(self, points: NDArray[np.int32]) -> NDArray[np.int32]:
        """Each of `points` once (P,), rising."""
        if points.size < self.n**2:
            return np.unique(points)
        self.wanted[points] = True
        found = np.flatnonzero(self.wanted)
        self.wanted[found] = False
        return found.astype(np.int32)

    def evaluate(self, points: NDArray[np.int32]) -> None:
        """Make the field known at the lattice points (P,), which are distinct."""
        points = points.compress(self.flat.take(points) == UNKNOWN)
        for start in range(0, len(points), BATCH):
            self.progress(self.fraction, "Searching the surface")
            part = points[start : start + BATCH]
            x = self.axis.take(places(part, self.cells))  # (3, P)
            value = self.value(x.T)
            if not np.isfinite(value).all():
                raise SculptError("The field's weights are damaged. Undo the last change.")
            value[value == 0] = INSIDE
            value[(x > 1).any(axis=0)] = OUTSIDE
            self.flat[part] = value

    def outer_sum(self, place: NDArray[np.intp]) -> NDArray[np.int32]:
        """All points (K^3,) whose three coordinates are in `place` (K,)."""
        x, y, z = (place.astype(np.int32) * step for step in self.steps)
        return (x[:, None, None] + y[:, None] + z).ravel()


def _root_stride(cells: int) -> int:
    """The largest power of two that divides `cells` into at least ROOT_BLOCKS blocks per axis."""
    stride = 1
    while cells % (2 * stride) == 0 and cells // (2 * stride) >= ROOT_BLOCKS:
        stride *= 2
    return stride


def _parts(blocks: NDArray[np.int32]) -> list[NDArray[np.int32]]:
    return [blocks[i : i + WIDEST_LEVEL] for i in range(0, len(blocks), WIDEST_LEVEL)]


def clearance(value: NDArray[np.float32]) -> NDArray[np.float32]:
    """The least |f| of the 8 corners, on the first axis; negative where they change sign."""
    return np.maximum(value.min(axis=0), -value.max(axis=0))


def _expected(value: NDArray[np.float32]) -> NDArray[np.float32]:
    """The clearance (8, B) of each child of blocks, by trilinear interpolation of theirs (8, B)."""
    points = np.empty((3, 3, 3, value.shape[1]), np.float32)
    points[::2, ::2, ::2] = value.reshape(2, 2, 2, -1)
    points[1, ::2, ::2] = (points[0, ::2, ::2] + points[2, ::2, ::2]) / 2
    points[:, 1, ::2] = (points[:, 0, ::2] + points[:, 2, ::2]) / 2
    points[:, :, 1] = (points[:, :, 0] + points[:, :, 2]) / 2
    low, high = _of_neighbours(np.minimum, points), _of_neighbours(np.maximum, points)
    return np.maximum(low, -high).reshape(8, -1)


def _of_neighbours(least: np.ufunc, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """The least, or the greatest, of each 8 points (3, 3, 3, B) that are a cube: (2, 2, 2, B)."""
    points = least(points[:-1], points[1:])
    points = least(points[:, :-1], points[:, 1:])
    return least(points[:, :, :-1], points[:, :, 1:])
