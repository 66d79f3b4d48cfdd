# SPDX-License-Identifier: GPL-3.0-or-later
"""The lattice cells that the surface passes through, found without evaluating all the others.

A lattice of `cells` cells per axis spans the box [-1, 1]^3 of model space. A cell is active when
its eight corners disagree in sign; marching cubes needs those cells and no other. Two steps find
them:

1. An octree over the lattice's own points. A block of cells is divided if its corners change sign,
   or if one of them is so close to the surface that it may hide between them. The margin is a
   measured share of the block's edge (a Lipschitz bound of the weights would be 30 times wider).
2. A flood. Where the corners of a face disagree, the cell on its other side is active too; such
   faces lead through every component of which the octree found a single cell.

After an edit the flood alone finds what became of a surface that is known (`find_again`).

Around the box lies one more ring of points, said to be outside, so that a surface that leaves the
box is closed off on its faces. The ring also keeps the flood's index arithmetic inside the array.
Cells and points are linear indices into the ringed lattice, n = cells + 3 points per axis; a cell
is named by its lowest corner.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from .evaluate import values
from .network import Siren

ROOT_BLOCKS = 16  # blocks per axis at least, before the first division
BATCH = 1 << 15  # points between two looks at `progress`; some 20 ms
WIDEST_LEVEL = 1 << 19  # blocks handled at once; bounds the memory of the descent
UNKNOWN = np.float32(0)  # never evaluated: a value of zero is stored as INSIDE
INSIDE, OUTSIDE = np.float32(-1e-12), np.float32(1)
CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # (8, 3)

# Trilinear weights that carry a block's 8 corners to the 8 corners of each of its 8 children.
_CHILD_CORNERS = (CORNERS[:, None] + CORNERS[None]).reshape(64, 1, 3) / 2  # (corner * child, 1, 3)
_TO_CHILDREN = np.prod(
    np.where(CORNERS[None] == 1, _CHILD_CORNERS, 1 - _CHILD_CORNERS), axis=2
).astype(np.float32)  # (corner * child, 8)

# Whether the corners of a face disagree, for each sign code: (axis, side) -> (256,).
_CODE_BITS = np.arange(256)[:, None] >> np.arange(8) & 1  # (256, 8)
_MIXED_FACE = {
    (axis, side): np.isin(_CODE_BITS[:, CORNERS[:, axis] == side].sum(axis=1), (1, 2, 3))
    for axis in range(3)
    for side in (0, 1)
}


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

    @property
    def codes(self) -> NDArray[np.uint8]:
        """Signs of the corners (A,): bit c is set when corner c is inside."""
        return _codes(self.values)


def steps(cells: int) -> NDArray[np.int32]:
    """Index steps along each axis (3,) of a lattice of `cells` cells per axis."""
    n = cells + 3
    return np.array([n * n, n, 1], np.int32)


def find_active(network: Siren, cells: int, progress: Progress = silent) -> ActiveCells:
    """The active cells of `network`. SculptError when it yields values that are not finite."""
    search = _Search(network, cells, progress)
    search.flood(np.concatenate([search.descend(), search.ring_seeds()]))
    return search.result()


class FoundAgain(NamedTuple):
    """The active cells after an edit."""

    active: ActiveCells
    fresh: NDArray[np.bool_]  # (A,), those that were searched for
    touched: NDArray[np.bool_]  # of the cells known before, those that were given up for these


def find_again(
    known: ActiveCells, changed: NDArray[np.bool_], network: Siren, progress: Progress = silent
) -> FoundAgain:
    """The active cells after an edit that moved the surface in the `changed` (A,) ones.

    Corners of cells that did not change keep their values, so the result is exactly that of one
    lattice: closed wherever the surface is. Pieces born away from the known surface are not seen.
    """
    search = _Search(network, known.cells, progress)
    corners = known.index + search.corners  # (8, A)
    search.flat[corners] = known.values
    search.flat[corners[:, changed]] = UNKNOWN
    near = np.zeros_like(search.seen)
    near[(known.index[changed] + search.corners)[:, None] - search.corners] = True
    touched = near[known.index]  # those that have a corner in common with a changed one
    search.seen[known.index[~touched]] = True
    search.evaluate(corners[:, touched].ravel())
    search.flood(known.index[touched][_mixed(search.flat[corners[:, touched]])])
    found = search.result()
    kept = known.index[~touched]
    fresh = np.zeros(len(kept) + len(found.index), bool)
    fresh[np.searchsorted(kept, found.index) + np.arange(len(found.index))] = True
    index, values = np.empty(len(fresh), np.int32), np.empty((8, len(fresh)), np.float32)
    index[fresh], index[~fresh] = found.index, kept
    values[:, fresh], values[:, ~fresh] = found.values, known.values[:, ~touched]
    return FoundAgain(ActiveCells(known.cells, index, values), fresh, touched)


class _Search:
    """The state of one search: the values so far, the cells so far.

    The arrays span the lattice, but of memory that nobody touches the system gives none.
    """

    def __init__(self, network: Siren, cells: int, progress: Progress) -> None:
        self.network, self.cells, self.progress = network, cells, progress
        self.n = cells + 3
        self.flat = np.zeros(self.n**3, np.float32)
        self.tags = self.flat.view(np.int32)  # the same memory
        self.seen = np.zeros(self.n**3, bool)
        self.found = [np.empty(0, np.int32)]
        self.steps = steps(cells)
        self.corners = (CORNERS @ self.steps).astype(np.int32)[:, None]  # (8, 1)
        self.spacing = 2 / cells
        self.axis = np.zeros(self.n, np.float32)  # coordinates of the points; any in the ring
        self.axis[1:-1] = np.linspace(-1, 1, cells + 1)
        self.root = _root_stride(cells)
        self.fraction = 0.0

    def result(self) -> ActiveCells:
        """All cells marked so far."""
        index = np.unique(np.concatenate(self.found))
        return ActiveCells(self.cells, index, self.flat[index + self.corners])

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
            self.evaluate(corners.ravel())
            value = self.flat[corners]  # (8, B)
            if stride == 1:
                found.append(blocks[_mixed(value)])
                continue
            keep = _mixed(value) | _near(value, edge, slope)
            children = blocks[keep] + stride // 2 * self.corners  # (8, B')
            if stride == 2:  # the last and widest level: divide only where the surface is expected
                expected = (_TO_CHILDREN @ value[:, keep]).reshape(8, *children.shape)
                children = children[_mixed(expected) | _near(expected, edge / 2, slope)]
            stack.extend((stride // 2, part) for part in _parts(children.ravel()))
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
        place = np.stack(np.unravel_index(points, (self.n,) * 3))  # (3, P)
        points = points[((place == 1) | (place == self.cells + 1)).any(axis=0)]
        cells = np.unique(points - self.corners)
        self.evaluate((cells + self.corners).ravel())
        return cells[_mixed(self.flat[cells + self.corners])]

    def flood(self, frontier: NDArray[np.int32]) -> None:
        """Mark `frontier` (A,) and every cell reached from it through faces of mixed sign."""
        self.fraction = 0.9
        while len(frontier):
            self.mark(frontier)
            codes = _codes(self.flat[frontier + self.corners])  # (A,)
            reached = [
                frontier[mixed[codes]] + (2 * side - 1) * self.steps[axis]
                for (axis, side), mixed in _MIXED_FACE.items()
            ]
            frontier = np.concatenate(reached)
            frontier = np.unique(frontier[~self.seen[frontier]])
            self.evaluate((frontier + self.corners).ravel())

    def mark(self, cells: NDArray[np.int32]) -> None:
        """Say that `cells` (A,) are active."""
        self.seen[cells] = True
        self.found.append(cells)

    def evaluate(self, points: NDArray[np.int32]) -> None:
        """Make the field known at the lattice points (P,), which may repeat."""
        unknown = points[self.flat[points] == UNKNOWN]
        order = np.arange(len(unknown), dtype=np.int32)
        self.tags[unknown] = order  # of a point named twice the last writer stays,
        unknown = unknown[self.tags[unknown] == order]  # and the values soon overwrite the tags
        for start in range(0, len(unknown), BATCH):
            self.progress(self.fraction, "Searching the surface")
            part = unknown[start : start + BATCH]
            x = np.empty((len(part), 3), np.float32)
            rest, in_ring = part, np.zeros(len(part), bool)
            for axis in (2, 1, 0):
                above = rest // np.int32(self.n)
                place = rest - above * np.int32(self.n)
                in_ring |= (place == 0) | (place == self.cells + 2)
                x[:, axis] = self.axis[place]
                rest = above
            value = values(self.network, x)
            if not np.isfinite(value).all():
                raise SculptError("The field's weights are damaged. Undo the last change.")
            value[value == 0] = INSIDE
            value[in_ring] = OUTSIDE
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


def _codes(value: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Which of the 8 corners, on the first axis, are inside, as bits; zero counts as inside."""
    codes = np.zeros(value.shape[1:], np.uint8)
    for corner, row in enumerate(value <= 0):
        codes |= row.view(np.uint8) << np.uint8(corner)
    return codes


def _mixed(value: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Whether the 8 corners, on the first axis, disagree in sign."""
    codes = _codes(value)
    return (codes != 0) & (codes != 255)


def _near(value: NDArray[np.float32], edge: float, slope: float) -> NDArray[np.bool_]:
    """Whether the surface may hide between corners of equal sign, `edge` apart.

    The share of the edge was measured on trained and edited networks; it falls with the edge,
    because a smooth field is the flatter the closer one looks, and levels out at 0.15.
    """
    share = np.clip(6 * edge, 0.15, 0.6)
    return np.abs(value).min(axis=0) < share * edge * slope
