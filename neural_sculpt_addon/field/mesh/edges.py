# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges of a triangle mesh as Blender stores them.

Blender can find them itself, but on its main thread, where they are most of the time that a new
proxy takes.
"""

import numpy as np
from numpy.typing import NDArray


def find_edges(triangles: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The vertices (E, 2) of each edge, and for the corners (F, 3) the edge to the next corner."""
    following = triangles.take([1, 2, 0], axis=1)
    low, high = np.minimum(triangles, following), np.maximum(triangles, following)
    names = (low.astype(np.int64) << 32 | high).ravel()  # (3F,)
    order = np.argsort(names, kind="stable")  # quick, because a mesh is nearly sorted already
    names = names.take(order)
    first = np.append(True, names[1:] != names[:-1])[: len(names)]
    of_corners = np.empty(len(names), np.int32)
    of_corners[order] = np.cumsum(first, dtype=np.int32) - 1
    found = order.compress(first)  # (E,)
    vertices = np.stack([low.take(found), high.take(found)], axis=1)
    return vertices, of_corners.reshape(triangles.shape)
