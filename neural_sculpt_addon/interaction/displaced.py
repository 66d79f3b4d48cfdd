# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh with strokes displaced on it at once, as a preview: p' = p + d n.

The last stroke may grow. It is displaced in pieces of bounded size, so that no move of the pen
waits long, and is shown when it is whole. Only what lies near the strokes is touched. Images by
symmetry stand on the same surface, and where they meet the farthest counts, as in the field. NumPy
alone; model space.
"""

import weakref
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..stroke.stroke import Kind, Stroke
from .base_surface import PIECE, BaseSurface, Fans, Indices, Triangles, Vectors
from .growth import Growth, reach_of
from .steps import counted


class Displaced:
    """Vertices (V, 3) of triangles (F, 3), wound outward, and the strokes that displace them."""

    def __init__(self, positions: Vectors, triangles: Triangles) -> None:
        """Nothing is displaced yet."""
        self.strokes: tuple[Stroke, ...] = ()
        self.seen: tuple[Stroke, ...] = ()
        """What of them is displaced already; the last may be one that it was before."""
        self._positions, self._triangles = positions.copy(), triangles
        self._before = self._positions  # the last stroke
        self._protection: NDArray[np.float32] | None = None
        self._normals = np.zeros_like(positions)
        self._touched = np.zeros(len(positions), bool)
        self._fans: Fans | None = None
        self._growths: tuple[Growth, ...] = ()
        self._work: Iterator[int] | None = None

    @property
    def vertices(self) -> Indices:
        """The vertices (M,) that strokes displace or did, and those beside them."""
        return np.flatnonzero(self._touched)

    @property
    def positions(self) -> Vectors:
        """Where those are now (M, 3)."""
        return self._positions[self._touched]

    @property
    def normals(self) -> Vectors:
        """Their unit normals (M, 3) there."""
        return self._normals[self._touched]

    @property
    def below(self) -> Vectors:
        """Where all vertices (V, 3) are without the last stroke."""
        return self._before

    def add(self, stroke: Stroke) -> None:
        """Displace by one more stroke and its images; other kinds show when done."""
        self.begin(stroke)
        self.advance()

    def begin(self, stroke: Stroke, protection: NDArray[np.float32] | None = None) -> None:
        """One more stroke, which `advance` displaces.

        protection: (V,) what weakens it from 0 to 1 while it has no mask
        """
        self.advance()
        self._before, self._protection = self._positions, protection
        self.strokes += (stroke,)

    def change(self, stroke: Stroke) -> None:
        """The last stroke is this one now, as `advance` will displace it."""
        self.strokes = (*self.strokes[:-1], stroke)

    def advance(self, most: int | None = None) -> int:
        """Work on what was asked for until some `most` vertices were looked at; how many were."""
        looked = 0
        while most is None or looked < most:
            if self._work is None:
                if self.seen is self.strokes:
                    break
                itself = weakref.proxy(self)  # or both would stay until garbage is collected
                self._work = Displaced._displace(itself, self.strokes)
            piece = next(self._work, None)
            if piece is None:
                self._work = None
            else:
                looked += piece
        return looked

    def _displace(self, strokes: tuple[Stroke, ...]) -> Iterator[int]:
        """Displace by the last of the strokes as it is now, piece by piece. Yields how many
        vertices each piece has looked at; the mesh shows nothing of it before the last one."""
        if self._fans is None:
            steps = Fans.sorting(self._triangles, len(self._positions))
            self._fans = yield from counted(steps, len(self._positions) // 4)
        fans, before = self._fans, self._before
        stale = np.zeros(len(before), bool)
        copies = strokes[-1].copies() if strokes[-1].kind is Kind.DRAW else ()
        if len(self.seen) < len(strokes):
            yield from Displaced._anew(self, strokes[-1], fans, len(copies))
        elif _differ(strokes[-1], self.seen[-1]) or len(copies) != len(self._growths):
            for growth in self._growths:
                stale |= growth.amounts != 0
            yield from Displaced._anew(self, strokes[-1], fans, len(copies))
        for growth, copy in zip(self._growths, copies, strict=True):
            yield from growth.follow(copy)
            stale |= growth.fresh
        positions, normals = self._positions.copy(), self._normals.copy()
        fresh = np.flatnonzero(stale)
        for start in range(0, len(fresh), PIECE):
            part = fresh[start : start + PIECE]
            shifts = self._shifts(part)
            if self._protection is not None and strokes[-1].mask is None:
                shifts *= 1 - self._protection[part, None]
            positions[part] = before[part] + shifts
            yield len(part) // 2
        around = fans.ring(fresh[(positions[fresh] != self._positions[fresh]).any(axis=1)])
        yield len(stale) // 64 + len(around) // 8
        for start in range(0, len(around), PIECE):
            part = around[start : start + PIECE]
            normals[part] = fans.normals(positions, part)
            yield len(part)
        self._positions, self._normals, self.seen = positions, normals, strokes
        self._touched[around] = True

    def _anew(self, stroke: Stroke, fans: Fans, copies: int) -> Iterator[int]:
        """Nothing is known of the stroke, which has so many copies."""
        self._growths = ()
        if not copies:
            return
        steps = BaseSurface.sorting(self._before, fans, reach_of(stroke))
        surface = yield from counted(steps, len(self._before) // 8)
        for _ in range(copies):
            self._growths += (Growth(surface),)
            yield len(self._before) // 64

    def _shifts(self, vertices: Indices) -> Vectors:
        """Shifts (M, 3) of vertices (M,), each by the image that moves it farthest."""
        shifts, farthest = np.zeros((len(vertices), 3)), np.zeros(len(vertices))
        for growth in self._growths:
            amounts = np.abs(growth.amounts[vertices])
            farther = amounts > farthest
            shifts[farther], farthest[farther] = growth.shifts[vertices[farther]], amounts[farther]
        return shifts.astype(np.float32)


def _differ(one: Stroke, other: Stroke) -> bool:
    """Whether two strokes differ by more than points and pressures within the same reach."""
    words = ("brush", "closed", "ends", "direction", "mirror", "radial", "kind", "mask")
    return reach_of(one) != reach_of(other) or any(
        getattr(one, word) != getattr(other, word) for word in words
    )
