# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry of many points and vectors: the nearest points, lengths, unit vectors."""

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
