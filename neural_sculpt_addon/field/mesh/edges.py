# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges of a triangle mesh as Blender stores them.

Blender can find them itself, but on its main thread, where they are most of the time that a new
proxy takes.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array


def find_edges(triangles: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The vertices (E, 2) of each edge, and for the corners (F, 3) the edge to the next corner."""
    following = triangles.take([1, 2, 0], axis=1)
    low, high = np.minimum(triangles, following).ravel(), np.maximum(triangles, following).ravel()
    order = _order(high)
    order = order.take(_order(low.take(order)))
    low, high = low.take(order), high.take(order)  # (3F,)
    first = np.append(True, (low[1:] != low[:-1]) | (high[1:] != high[:-1]))[: len(low)]
    of_corners = np.empty(len(low), np.int32)
    of_corners[order] = np.cumsum(first, dtype=np.int32) - 1
    vertices = np.stack([low.compress(first), high.compress(first)], axis=1)
    return vertices, of_corners.reshape(triangles.shape)


def _order(numbers: NDArray[np.int32]) -> NDArray[np.int32]:
    """Where each of the numbers (N,), none of them negative, was before they were in order; equal
    ones stay in theirs. SciPy counts them when it turns columns into rows, in a tenth of the time
    that `argsort` takes to compare them."""
    count = len(numbers)
    ends = np.arange(count + 1, dtype=np.int32)
    shape = int(numbers.max(initial=-1)) + 1, count
    by_number = csc_array((np.ones(count, np.int8), numbers, ends), shape).tocsr()
    return by_number.indices.astype(np.int32, copy=False)
