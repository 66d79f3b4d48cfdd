# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles divided at the middles of some of their edges, so that no neighbour gets a crack."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Edges(NamedTuple):
    """The edges of triangles (T, 3), each once."""

    ends: NDArray[np.int64]  # (E, 2), vertices, the lower number first
    of_triangle: NDArray[np.int64]  # (T, 3), of each triangle those after its corners


def edges_of(triangles: NDArray[np.int64]) -> Edges:
    """The edges of triangles (T, 3)."""
    pairs = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    size = triangles.max(initial=0) + 1
    numbers, place = np.unique(pairs[..., 0] * size + pairs[..., 1], return_inverse=True)
    return Edges(np.stack(np.divmod(numbers, size), axis=1), place.reshape(triangles.shape))


def split(
    triangles: NDArray[np.int64], edges: Edges, chosen: NDArray[np.bool_], count: int
) -> NDArray[np.int64]:
    """Triangles (U, 3) of which the `chosen` (E,) edges are halved, wound as before.

    The middles are the vertices from number `count` on, in the order of the edges.
    """
    middles = np.where(chosen, count - 1 + np.cumsum(chosen), -1)[edges.of_triangle]  # (T, 3)
    halved = (middles >= 0).sum(axis=1)
    parts = [triangles[halved == 0]]
    for number, pieces in _PIECES.items():
        some = halved == number
        first = _FIRST[number](middles[some] >= 0)  # the corner that comes first in the pieces
        turn = (first[:, None] + np.arange(3)) % 3
        corners = np.take_along_axis(triangles[some], turn, axis=1)
        both = np.concatenate([corners, np.take_along_axis(middles[some], turn, axis=1)], axis=1)
        parts += [both[:, piece] for piece in pieces]
    return np.concatenate(parts)


_PIECES = {
    1: [(0, 3, 2), (3, 1, 2)],
    2: [(3, 1, 4), (0, 3, 4), (0, 4, 2)],
    3: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
}
"""Of a triangle with 1, 2 or 3 halved edges: corners are 0 to 2, 3 to 5 the middles after them."""

_FIRST = {
    1: lambda halved: halved.argmax(axis=1),  # before the halved edge
    2: lambda halved: (halved.argmin(axis=1) + 1) % 3,  # after the whole edge
    3: lambda halved: np.zeros(len(halved), int),
}
