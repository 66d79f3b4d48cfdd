# SPDX-License-Identifier: GPL-3.0-or-later
"""Subdivision of triangles by their edges: those that a rule marks are split in the middle.

A triangle with one, two or three marked edges becomes two, three or four. An edge is named by
its two vertices, so the triangles on both sides of it split it alike, and what was closed stays
closed.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...geometry import any_true, lengths
from ...threads import join
from ..edges import find_edges

T = TypeVar("T", bound=tuple[NDArray[Any], ...])

LOW = np.int64(2**32 - 1)
DIVISIONS = 8  # of an edge at most


class Subdivision(NamedTuple):
    """Triangles, each a part of a coarser one.

    triangles: (F, 3)
    parents:   (F,), of the coarser ones
    settled:   (F, 3), whether the edge from each corner to the next stays as it is
    """

    triangles: NDArray[np.int32]
    parents: NDArray[np.int32]
    settled: NDArray[np.bool_]

    @staticmethod
    def whole(triangles: NDArray[np.int32], parents: NDArray[np.int32]) -> "Subdivision":
        """Coarse triangles (F, 3) by their numbers (F,), with everything open."""
        return Subdivision(triangles, parents, np.zeros(triangles.shape, bool))

    @staticmethod
    def together(some: list["Subdivision"]) -> "Subdivision":
        """All of some."""
        return Subdivision(*map(np.concatenate, zip(*some, strict=True)))

    def where(self, chosen: NDArray[np.bool_]) -> "Subdivision":
        """The chosen (F,) ones."""
        return Subdivision(*(array.compress(chosen, axis=0) for array in self))


class Edges(NamedTuple):
    """The edges of triangles that are open.

    ends:    (E, 2), vertices, the lower number first
    alone:   (E,), whether only one of the triangles has it
    corners: (F, 3), from each corner to the next; -1 for those that are settled
    """

    ends: NDArray[np.int32]
    alone: NDArray[np.bool_]
    corners: NDArray[np.int32]

    def at_corners(
        self, number: NDArray[np.int32], triangles: NDArray[np.intp] | slice = slice(None)
    ) -> NDArray[np.int32]:
        """What `number` (E,) has for the edges of triangles (F, 3); -1 for what is settled."""
        return np.append(number, np.int32(-1)).take(self.corners[triangles])


def open_edges(parts: Subdivision) -> Edges:
    """The open edges of `parts`, each once."""
    ends, corners = find_edges(parts.triangles)
    is_open = np.ones(len(ends), bool)
    is_open[corners[parts.settled]] = False
    number = np.where(is_open, np.cumsum(is_open) - 1, -1).astype(np.int32)
    alone = np.bincount(corners.ravel(), minlength=len(ends)) == 1
    return Edges(ends[is_open], alone[is_open], number.take(corners))


def names(ends: NDArray[np.int32]) -> NDArray[np.int64]:
    """One number (E,) for each edge by its vertices (E, 2), in either order."""
    one, other = ends.T
    return np.minimum(one, other).astype(np.int64) << 32 | np.maximum(one, other)


def ends_of(name: NDArray[np.int64]) -> NDArray[np.int32]:
    """The vertices (E, 2) of edges by their names (E,)."""
    return np.stack([name >> 32, name & LOW], axis=1).astype(np.int32)


def divided(
    parts: Subdivision, middles: NDArray[np.int32], vertices: NDArray[np.float32]
) -> Subdivision:
    """What becomes of triangles that have a marked edge each.

    middles:  (F, 3), the vertex in the middle of the edge from each corner to the next, or -1
    vertices: (V, 3), where they are

    The edges that are not marked are settled.
    """
    six = np.concatenate([parts.triangles, middles], axis=1)  # (F, 6)
    one, two, three = (middles >= 0).view(np.int8).T
    marks = one + 2 * two + 4 * three
    found = []
    for mark, turn, pattern, *otherwise in _DIVISIONS:
        some = np.flatnonzero(marks == mark)
        turned = six.take(some, axis=0).take(_TURNS[turn], axis=1)
        if otherwise:
            a, b, c, d = (vertices.take(turned[:, k], axis=0) for k in (0, 4, 3, 2))
            other = lengths(c - d)[:, 0] < lengths(a - b)[:, 0]
            found.append(_patterned(turned[other], parts.parents[some[other]], *otherwise))
            some, turned = some[~other], turned[~other]
        found.append(_patterned(turned, parts.parents[some], pattern))
    return Subdivision.together(found)


def halved(
    triangles: NDArray[np.int32],
    of_corners: NDArray[np.int32],
    chosen: NDArray[np.bool_],
    vertices: NDArray[np.float32],
    middles: NDArray[np.float32],
) -> NDArray[np.int32]:
    """Triangles (U, 3) after the `chosen` (E,) of their edges were halved, wound as before.

    of_corners: (T, 3), the edge from each corner to the next, see `find_edges`
    vertices:   (V, 3)
    middles:    (M, 3), of the chosen edges, in order: the vertices from number V on
    """
    number = np.where(chosen, len(vertices) - 1 + np.cumsum(chosen), -1).astype(np.int32)
    number = number[of_corners]  # (T, 3)
    marked = any_true(number >= 0)
    parts = Subdivision.whole(triangles[marked], np.flatnonzero(marked).astype(np.int32))
    parts = divided(parts, number[marked], np.concatenate([vertices, middles]))
    return np.concatenate([triangles[~marked], parts.triangles])


def divide(
    triangles: NDArray[np.int32],
    vertices: T,
    excess: Callable[[T, T], NDArray[Any]],
    middles: Callable[[T, T], T],
    most: int,
) -> tuple[NDArray[np.int32], T]:
    """Triangles (T, 3) and vertices after edges were halved, time and again, until none is too long
    or there are too many: the longest first.

    vertices: a tuple of arrays with a row for each, the first one (V, 3) their places
    excess:   lengths (E,) of edges, 0 of those that are short enough, by the vertices at both ends,
              with a row for each edge
    middles:  the vertices in the middle of edges, by those at both ends
    most:     vertices at most
    """
    for _ in range(DIVISIONS):
        ends, of_corners = find_edges(triangles)
        length = excess(*(rows(vertices, end) for end in ends.T))
        longest = np.argsort(-length, kind="stable")[: max(most - len(vertices[0]), 0)]
        long = np.zeros(len(ends), bool)
        long[longest] = length[longest] > 0
        if not long.any():
            break
        new = middles(*(rows(vertices, end) for end in ends[long].T))
        triangles = halved(triangles, of_corners, long, vertices[0], new[0])
        vertices = join([vertices, new])
    return triangles, vertices


def rows(arrays: T, chosen: NDArray) -> T:
    """The chosen rows of each array of a named tuple."""
    return type(arrays)(*(array[chosen] for array in arrays))


_Pattern = tuple[tuple[tuple[int, int, int], ...], tuple[tuple[int, int], ...]]
"""Triangles of six vertices, the corners 0 1 2 and the middles 3 4 5 of the edges that begin there,
and which edges of which of these triangles are settled."""

_ONE: _Pattern = (((0, 3, 2), (3, 1, 2)), ((0, 2), (1, 1)))
_TWO: _Pattern = (((3, 1, 4), (0, 3, 4), (0, 4, 2)), ((2, 2),))
_TWO_OTHERWISE: _Pattern = (((3, 1, 4), (3, 4, 2), (0, 3, 2)), ((2, 2),))
_THREE: _Pattern = (((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)), ())

_TURNS = [[*np.roll((0, 1, 2), -turn), *np.roll((3, 4, 5), -turn)] for turn in range(3)]
"""Of six vertices, until the only marked edge comes first, or the only one that is not marked last.
"""

_DIVISIONS: list[tuple[int, int, _Pattern] | tuple[int, int, _Pattern, _Pattern]] = [
    *((1 << turn, turn, _ONE) for turn in range(3)),
    *((1 << turn | 1 << (turn + 1) % 3, turn, _TWO, _TWO_OTHERWISE) for turn in range(3)),
    (7, 0, _THREE),
]
"""Marked edges, as bits; the turn; the pattern, and that along the other diagonal."""


def _patterned(
    six: NDArray[np.int32], parents: NDArray[np.int32], pattern: _Pattern
) -> Subdivision:
    corners, settled = pattern
    flags = np.zeros((len(corners), 3), bool)
    for triangle, edge in settled:
        flags[triangle, edge] = True
    return Subdivision(
        six.take(corners, axis=1).reshape(-1, 3),
        np.repeat(parents, len(corners)),
        np.tile(flags, (len(six), 1)),
    )
