# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality of triangles: which are thin, or look the other way than the surface. Model space."""

import numpy as np
from numpy.typing import NDArray

POOR = 0.25
"""Quality below which a triangle is poor: angles of some 8 degrees. 1 is equilateral, below zero
the triangle looks the other way than the surface."""


def find_poor(
    triangles: NDArray[np.int32], vertices: NDArray[np.float32], normals: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """Which triangles (F,) are thin or turned over.

    vertices, normals: (V, 3)
    """
    return _quality(triangles, vertices, normals) < POOR


def _quality(
    triangles: NDArray[np.int32], vertices: NDArray[np.float32], normals: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Of triangles (N, 3): area by the squares of the edges, with the sign of its side."""
    a, b, c = (vertices.take(corner, axis=0).astype(float) for corner in triangles.T)
    along = np.cross(b - a, c - a)  # (N, 3)
    area = np.sqrt(np.einsum("na,na->n", along, along))
    squares = sum(np.einsum("na,na->n", edge, edge) for edge in (b - a, c - b, a - c))
    outward = sum(normals.take(corner, axis=0) for corner in triangles.T)
    side = np.where(np.einsum("na,na->n", along, outward) < 0, -1.0, 1.0)
    return 2 * np.sqrt(3) * side * area / np.maximum(squares, 1e-30)
