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

Around the box lies one more ring of points, said to be outside, so that a surface that leaves the
box is closed off on its faces. The ring also keeps the flood's index arithmetic inside the array.
Cells and points are linear indices into the padded array; a cell is named by its lowest corner.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from .evaluate import values
from .network import Siren

ROOT_BLOCKS = 16  # blocks per axis at least, before the first division
BATCH = 1 << 15  # points between two looks at `progress`; some 20 ms
WIDEST_LEVEL = 1 << 19  # blocks handled at once; bounds the memory of the descent
CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # (8, 3)

# Trilinear weights that carry a block's 8 corners to the 8 corners of each of its 8 children.
_CHILD_CORNERS = (CORNERS[:, None] + CORNERS[None]).reshape(64, 1, 3) / 2  # (corner * child, 1, 3)
_TO_CHILDREN = np.prod(
    np.where(CORNERS[None] == 1, _CHILD_CORNERS, 1 - _CHILD_CORNERS), axis=2
).astype(np.float32)  # (corner * child, 8)


@dataclass(frozen=True)
class Lattice:
    """Field values where they are known, and the active cells.

    values: (n, n, n) float32 with n = cells + 3, ring included; NaN where the field was not needed
    active: (n, n, n) bool, true at the highest corner of every active cell (scikit-image's mask)
    cells:  cells per axis of the box [-1, 1]^3
    """

    values: NDArray[np.float32]
    active: NDArray[np.bool_]
    cells: int

    @property
    def spacing(self) -> float:
        """Edge of a cell in model space."""
        return 2 / self.cells


def find_active(network: Siren, cells: int, progress: Progress = silent) -> Lattice:
    """The lattice of `cells` cells per axis with all active cells of `network` marked.

    SculptError when the network yields values that are not finite.
    """
    search = _Search(network, cells, progress)
    search.flood(np.concatenate([search.descend(), search.ring_seeds()]))
    return Lattice(search.lattice, search.active, cells)


class _Search:
    """The state of one search: the values so far, the cells so far."""

    def __init__(self, network: Siren, cells: int, progress: Progress) -> None:
        self.network, self.cells, self.progress = network, cells, progress
        n = cells + 3
        self.lattice = np.full((n, n, n), np.nan, np.float32)
        for axis in range(3):
            np.moveaxis(self.lattice, axis, 0)[[0, -1]] = 1.0
        self.active = np.zeros((n, n, n), bool)
        self.steps = np.array([n * n, n, 1], np.int32)  # index step along each axis
        self.flat = self.lattice.reshape(-1)  # a view
        self.tags = self.flat.view(np.int32)  # the same memory
        self.seen = self.active.reshape(-1)[self.steps.sum() :]  # a view: by a cell's lowest corner
        self.corners = (CORNERS @ self.steps).astype(np.int32)[:, None]  # (8, 1)
        self.axis = np.linspace(-1, 1, cells + 1, dtype=np.float32)  # coordinates of the points
        self.spacing = 2 / cells
        self.root = _root_stride(cells)
        self.fraction = 0.0

    def descend(self) -> NDArray[np.int32]:
        """Active cells found by the octree (A,)."""
        root = np.arange(1, self.cells + 1, self.root)
        blocks = _outer_sum(root, self.steps)  # (R,)
        self.evaluate(_outer_sum(np.arange(1, self.cells + 2, self.root), self.steps))
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
        value = self.lattice[1 : -1 : self.root, 1 : -1 : self.root, 1 : -1 : self.root]
        steepest = max(float(np.abs(np.diff(value, axis=axis)).max()) for axis in range(3))
        return max(1.0, steepest / (self.root * self.spacing))

    def ring_seeds(self) -> NDArray[np.int32]:
        """Cells of the ring beside a root point that is inside: seeds of the closing faces."""
        points = _outer_sum(np.arange(1, self.cells + 2, self.root), self.steps)
        index = np.stack(np.unravel_index(points, self.lattice.shape), axis=1)  # (P, 3)
        on_face = ((index == 1) | (index == self.cells + 1)).any(axis=1)
        points = points[on_face & (self.flat[points] <= 0)]
        cells = np.unique(points - self.corners)
        self.evaluate((cells + self.corners).ravel())
        return cells[_mixed(self.flat[cells + self.corners])]

    def flood(self, frontier: NDArray[np.int32]) -> None:
        """Mark `frontier` (A,) and every cell reached from it through faces of mixed sign."""
        self.fraction = 0.9
        sides = [(axis, side) for axis in range(3) for side in (0, 1)]
        while len(frontier):
            self.seen[frontier] = True
            value = self.flat[frontier + self.corners]  # (8, A)
            reached = []
            for axis, side in sides:
                crossed = frontier[_mixed(value[CORNERS[:, axis] == side])]  # (4, A) corners of it
                reached.append(crossed + (2 * side - 1) * self.steps[axis])
            frontier = np.concatenate(reached)
            frontier = np.unique(frontier[~self.seen[frontier]])
            self.evaluate((frontier + self.corners).ravel())

    def evaluate(self, points: NDArray[np.int32]) -> None:
        """Make the field known at the lattice points (P,), which may repeat."""
        unknown = points[np.isnan(self.flat[points])]
        order = np.arange(len(unknown), dtype=np.int32)
        self.tags[unknown] = order  # of a point named twice the last writer stays,
        unknown = unknown[self.tags[unknown] == order]  # and the values soon overwrite the tags
        for start in range(0, len(unknown), BATCH):
            self.progress(self.fraction, "Searching the surface")
            part = unknown[start : start + BATCH]
            index = np.unravel_index(part, self.lattice.shape)
            x = np.stack([self.axis[i - 1] for i in index], axis=1)  # (P, 3)
            value = values(self.network, x)
            if not np.isfinite(value).all():
                raise SculptError("The field's weights are damaged. Undo the last change.")
            self.flat[part] = value


def _root_stride(cells: int) -> int:
    """The largest power of two that divides `cells` into at least ROOT_BLOCKS blocks per axis."""
    stride = 1
    while cells % (2 * stride) == 0 and cells // (2 * stride) >= ROOT_BLOCKS:
        stride *= 2
    return stride


def _outer_sum(index: NDArray[np.intp], steps: NDArray[np.int32]) -> NDArray[np.int32]:
    """Linear indices of all points whose three coordinates are in `index` (K,) -> (K^3,)."""
    x, y, z = (index.astype(np.int32) * step for step in steps)
    return (x[:, None, None] + y[:, None] + z).ravel()


def _parts(blocks: NDArray[np.int32]) -> list[NDArray[np.int32]]:
    return [blocks[i : i + WIDEST_LEVEL] for i in range(0, len(blocks), WIDEST_LEVEL)]


def _mixed(value: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Whether the corners, on the first axis, disagree in sign; zero counts as inside."""
    inside = value <= 0
    return inside.any(axis=0) & ~inside.all(axis=0)


def _near(value: NDArray[np.float32], edge: float, slope: float) -> NDArray[np.bool_]:
    """Whether the surface may hide between corners of equal sign, `edge` apart.

    The share of the edge was measured on trained and edited networks; it falls with the edge,
    because a smooth field is the flatter the closer one looks, and levels out at 0.15.
    """
    share = np.clip(6 * edge, 0.15, 0.6)
    return np.abs(value).min(axis=0) < share * edge * slope
