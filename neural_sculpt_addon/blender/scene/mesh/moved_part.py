# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of a proxy that a brush moved, cut out with the two rings of triangles around it.

The worker needs no more of the mesh: what lies farther away is where the field has it. NumPy alone;
100,000 vertices take some 5 ms. Model space.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float32]

LEAST_MOVE = 1e-5
"""Least distance, model units, by which a vertex counts as moved: a tenth of the error that an
absorbed one may have."""


class MovedPart(NamedTuple):
    """Some vertices (P,) of a mesh, and the triangles between them."""

    vertices: NDArray[np.intp]  # (P,), rising
    before: Vectors  # (P, 3)
    after: Vectors  # (P, 3), the same where less than LEAST_MOVE
    triangles: NDArray[np.int32]  # (T, 3), of the P


def cut(before: Vectors, after: Vectors, corners: NDArray[np.int32]) -> MovedPart | None:
    """What differs between two states (V, 3) of a mesh; None when nothing does.

    corners: (3, F), each row contiguous: the first corners of all triangles, the second, the third
    """
    way = np.abs(after - before)
    changed = (way[:, 0] > LEAST_MOVE) | (way[:, 1] > LEAST_MOVE) | (way[:, 2] > LEAST_MOVE)
    if not changed.any():
        return None
    within = changed.copy()
    within[corners[:, _touching(changed, corners)]] = True
    chosen = corners[:, _touching(within, corners)]  # (3, T)
    used = np.zeros(len(before), bool)
    used[chosen] = True
    vertices = np.flatnonzero(used)
    number = np.empty(len(before), np.int32)
    number[vertices] = np.arange(len(vertices), dtype=np.int32)
    old = before[vertices]
    new = np.where(changed[vertices, None], after[vertices], old)
    return MovedPart(vertices, old, new, np.ascontiguousarray(number[chosen].T))


def _touching(vertices: NDArray[np.bool_], corners: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which triangles (F,) have one of the vertices (V,)."""
    a, b, c = (vertices.take(corner) for corner in corners)
    return a | b | c
