# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that a stroke is drawn on: which vertices are near to a line, which triangles are
around them, and their normals as they are needed.

Vertices are sorted into cells and triangles by their corners once, so that a query takes time in
proportion to its result. NumPy alone; model space.
"""

from collections.abc import Generator, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..stroke.curve import Array
from .steps import sorting

Vectors = NDArray[np.float32]
Triangles = NDArray[np.int32]
Indices = NDArray[np.intp]

PIECE = 4096  # vertices that are looked at between two rests
CELLS_IN_REACH = 3  # of the grid, in the reach of a stroke
MOST_CELLS = 64  # along an axis; more take longer to count than they save
BLOCK = 1 << 17  # triangles that are sorted together: a step of that takes 5 ms at most


class Lists:
    """Which of N things have a number: `of(numbers)` are their indices, one after another."""

    def __init__(self, order: Indices, starts: Indices) -> None:
        """Of things in the `order` (N,) of their numbers, where those with each one begin."""
        self._order, self._starts = order, starts

    @classmethod
    def sorting(cls, numbers: NDArray[np.int32], count: int) -> Generator[None, None, "Lists"]:
        """Sort things by their numbers (N,), which are below `count`, in steps."""
        order = yield from sorting(numbers)
        yield
        starts = np.zeros(count + 1, np.intp)
        np.cumsum(np.bincount(numbers, minlength=count), out=starts[1:])
        return cls(order, starts)

    def of(self, numbers: Indices) -> Indices:
        """The things (T,) that have one of the numbers (M,)."""
        first = self._starts[numbers]
        counts = self._starts[numbers + 1] - first
        before = np.cumsum(counts) - counts
        return self._order[np.arange(counts.sum()) + np.repeat(first - before, counts)]


class Fans:
    """Triangles (F, 3) by their corners, which are below `count`."""

    def __init__(self, triangles: Triangles, count: int, blocks: Sequence[Lists]) -> None:
        """Of triangles and, of each BLOCK of them, the lists of their corners."""
        self.triangles, self._count, self._blocks = triangles, count, blocks

    @classmethod
    def sorting(cls, triangles: Triangles, count: int) -> Generator[None, None, "Fans"]:
        """Sort the triangles, in steps."""
        blocks = []
        for start in range(0, len(triangles), BLOCK):
            if blocks:
                yield
            corners = triangles[start : start + BLOCK].ravel()
            blocks.append((yield from Lists.sorting(corners, count)))
        return cls(triangles, count, blocks)

    def around(self, vertices: Indices) -> Triangles:
        """The triangles (T, 3) that have one of the vertices (M,) as a corner."""
        chosen = np.zeros(len(self.triangles), bool)
        for number, lists in enumerate(self._blocks):
            chosen[number * BLOCK + lists.of(vertices) // 3] = True
        return self.triangles[chosen]

    def ring(self, vertices: Indices) -> Indices:
        """The vertices (M,) and those beside them, in order."""
        chosen = np.zeros(self._count, bool)
        chosen[self.around(vertices).ravel()] = True
        return np.flatnonzero(chosen)

    def normals(self, positions: NDArray, vertices: Indices) -> Array:
        """Unit normals (M, 3) of some of the positions (V, 3), the mean of the triangles by area;
        zero where there is none."""
        around = self.around(vertices)  # (T, 3)
        place = np.full(len(positions), len(vertices), np.int32)
        place[vertices] = np.arange(len(vertices))
        x, y, z = positions[around.T].astype(float).transpose(2, 0, 1)  # (3, T) each, by corner
        (px, qx), (py, qy), (pz, qz) = ((v[1] - v[0], v[2] - v[0]) for v in (x, y, z))
        area = (py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx)
        corners, count = place[around].T.ravel(), len(vertices) + 1
        normals = np.stack([np.bincount(corners, np.tile(w, 3), count)[:-1] for w in area], axis=1)
        return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


class BaseSurface:
    """Vertices (V, 3) and the fans of their triangles, which are wound outward.

    reach: of the stroke that will be drawn on it
    """

    def __init__(self, positions: Vectors, fans: Fans, reach: float) -> None:
        """Nothing is sorted yet; see `sorting`."""
        self.positions, self.fans, self.reach = positions, fans, reach
        self.normals = np.zeros(positions.shape)  # (V, 3), of those that are known
        self._known = np.zeros(len(positions), bool)
        # One axis after the other is five times as fast
        low, high = (np.array([end(x) for x in positions.T], float) for end in (np.min, np.max))
        self._cell = max(reach / CELLS_IN_REACH, float((high - low).max()) / MOST_CELLS)
        self._low = low
        self._shape = ((high - low) / self._cell).astype(np.intp) + 1
        self._lists = Lists(np.zeros(0, np.intp), np.zeros(1, np.intp))
        around = np.arange(-CELLS_IN_REACH - 1, CELLS_IN_REACH + 2)
        gaps = np.maximum(np.abs(around) - 1, 0) ** 2  # squares, in cells, of what lies between
        near = gaps[:, None, None] + gaps[:, None] + gaps <= (reach / self._cell) ** 2
        self._ball = np.argwhere(near) - CELLS_IN_REACH - 1  # (B, 3)

    @classmethod
    def sorting(
        cls, positions: Vectors, fans: Fans, reach: float
    ) -> Generator[None, None, "BaseSurface"]:
        """Sort the vertices into cells, in steps."""
        surface = cls(positions, fans, reach)
        yield
        low, cell = surface._low.astype(np.float32), np.float32(surface._cell)
        cells = ((positions - low) / cell).astype(np.int32)
        cells = np.minimum(cells, (surface._shape - 1).astype(np.int32))  # (V, 3)
        numbers = surface._flat(cells.T)
        yield
        surface._lists = yield from Lists.sorting(numbers, int(surface._shape.prod()))
        return surface

    def near(self, points: Array) -> Indices:
        """Candidates (M,) for the vertices within reach of points (N, 3): all that are within it,
        and few others."""
        passed = np.floor((points - self._low) / self._cell).astype(np.intp)
        cells = (passed[:, None] + self._ball).reshape(-1, 3)
        cells = cells[((cells >= 0) & (cells < self._shape)).all(axis=1)]
        reached = np.zeros(int(self._shape.prod()), bool)
        reached[self._flat(cells.T)] = True
        return self._lists.of(np.flatnonzero(reached))

    def learn(self, vertices: Indices) -> Iterator[int]:
        """Find out the unit normals of vertices; gives how many were looked at since."""
        unknown = vertices[~self._known[vertices]]
        for start in range(0, len(unknown), PIECE):
            part = unknown[start : start + PIECE]
            self.normals[part] = self.fans.normals(self.positions, part)
            self._known[part] = True
            yield len(part)

    def _flat(self, cells: NDArray[np.integer]) -> NDArray:
        """The numbers (N,) of cells (3, N)."""
        i, j, k = cells
        _, rows, columns = self._shape.tolist()
        return (i * rows + j) * columns + k
