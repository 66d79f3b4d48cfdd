# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry of many points, vectors and triangles: the nearest points, lengths, angles, areas."""

from functools import reduce

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

LEAF = 64  # points of a leaf: surface samples are found twice as fast as with SciPy's 10


def search_tree(points: NDArray) -> KDTree:
    """A tree of points (N, 3), for `query`."""
    return KDTree(points, LEAF)


def lengths(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Euclidean norms (N, 1) of vectors (N, 3)."""
    return np.sqrt(np.einsum("na,na->n", vectors, vectors))[:, None]


def unit(vectors: NDArray) -> NDArray:
    """The vectors (N, 3) of length 1; those of length 0 stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def face_normals(corners: NDArray) -> NDArray:
    """Normals (..., 3) of triangles with `corners` (..., 3, 3), as long as twice the area."""
    a, b, c = np.moveaxis(corners, -2, 0)
    return np.cross(b - a, c - a)


def areas(corners: NDArray) -> NDArray:
    """Areas (...) of triangles with `corners` (..., 3, 3)."""
    return 0.5 * np.linalg.norm(face_normals(corners), axis=-1)


def all_true(flags: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which rows (N,) of `flags` (N, 3) are true throughout, eight times as fast as NumPy's `all`
    along so short an axis."""
    return reduce(np.logical_and, flags.T)


def any_true(flags: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which rows (N,) of `flags` (N, 3) are true somewhere, as fast."""
    return reduce(np.logical_or, flags.T)


def angles(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    """Angles (N,) between vectors a and b (N, 3), degrees: 90 where one of them is 0.

    Of unit vectors the angle is 2 atan2(|a - b|, |a + b|) (Kahan 2006), here in double precision,
    and as exact near 0 and 180 degrees as elsewhere. The arc cosine is not: of a cosine in single
    precision it is off by 0.02 degrees near 0.
    """
    a, b = unit(np.asarray(a, float)), unit(np.asarray(b, float))
    apart, together = np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)
    return np.degrees(2 * np.arctan2(apart, together))
