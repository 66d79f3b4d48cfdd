# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality of triangles: which are thin, or look the other way than the surface. Model space."""

import numpy as np
from numpy.typing import NDArray

from ...evaluate import values_and_gradients
from ...field import Field
from ...geometry import lengths

POOR = 0.25
"""Quality below which a triangle is poor: angles of some 8 degrees. 1 is equilateral."""

LEANS = 0.6
"""Cosine between a triangle and the surface at a corner, 53 degrees, below which the field is asked
which way the triangle looks. That of each would be asked for nothing: all others look outward."""


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
    across = np.cross(b - a, c - a)  # (F, 3)
    squares = sum(np.einsum("fa,fa->f", edge, edge) for edge in (b - a, c - b, a - c))
    area = lengths(across)[:, 0]
    sides = [np.einsum("fa,fa->f", across, normals.take(each, axis=0)) for each in triangles.T]
    poor = 2 * np.sqrt(3) * area < POOR * squares
    poor |= sides[0] + sides[1] + sides[2] <= 0
    leaning = np.minimum.reduce(sides) < LEANS * area
    asked = np.flatnonzero(leaning & ~poor)
    middles = (a.take(asked, axis=0) + b.take(asked, axis=0) + c.take(asked, axis=0)) / 3
    _, gradient = values_and_gradients(field, middles)
    poor[asked] = np.einsum("fa,fa->f", across.take(asked, axis=0), gradient) < 0
    return poor
