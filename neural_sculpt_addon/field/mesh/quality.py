# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality of triangles: which are thin, or look the other way than the surface. Model space."""

import numpy as np
from numpy.typing import NDArray

from ..evaluate import values_and_gradients
from ..field import Field
from ..geometry import lengths

POOR = 0.25
"""Quality below which a triangle is poor: angles of some 8 degrees. 1 is equilateral."""

LEANS = 0.9
"""Cosine between a triangle and the surface at a corner, 26 degrees, below which the field is asked
which way the triangle looks. Of a hundred that are turned over one leans less at most; to ask about
all takes ten times as many questions."""

TINY = np.float32(1e-30)


def shapes(
    a: NDArray[np.float32], b: NDArray[np.float32], c: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Vectors (F, 3) across triangles by their corners (F, 3), twice as long as they have area, and
    their qualities (F,), 1 of an equilateral one and 0 of one without area."""
    across = np.cross(b - a, c - a)
    squares = sum(np.einsum("fa,fa->f", edge, edge) for edge in (b - a, c - b, a - c))
    return across, 2 * np.sqrt(np.float32(3)) * lengths(across)[:, 0] / np.maximum(squares, TINY)


def facing(
    field: Field,
    a: NDArray[np.float32],
    b: NDArray[np.float32],
    c: NDArray[np.float32],
    across: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Cosines (F,) between triangles and the field in their middles: below 0 one is turned over.

    across: (F, 3), see `shapes`
    """
    _, gradient = values_and_gradients(field, (a + b + c) / 3)
    size = np.maximum(lengths(across) * lengths(gradient), TINY)[:, 0]
    return np.einsum("fa,fa->f", across, gradient) / size


def find_poor(
    field: Field,
    triangles: NDArray[np.int32],
    vertices: NDArray[np.float32],
    normals: NDArray[np.float32],
) -> NDArray[np.bool_]:
    """Which triangles (F,) are thin or turned over: against the normals of their corners, or
    against the field in their middle.

    vertices, normals: (V, 3)
    """
    a, b, c = (vertices.take(corner, axis=0) for corner in triangles.T)
    across, quality = shapes(a, b, c)
    sides = [np.einsum("fa,fa->f", across, normals.take(each, axis=0)) for each in triangles.T]
    poor = (quality < POOR) | (sides[0] + sides[1] + sides[2] <= 0)
    leaning = np.minimum.reduce(sides) < LEANS * lengths(across)[:, 0]
    asked = np.flatnonzero(leaning & ~poor)
    a, b, c, across = (each.take(asked, axis=0) for each in (a, b, c, across))
    poor[asked] = facing(field, a, b, c, across) < 0
    return poor
