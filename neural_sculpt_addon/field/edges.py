# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges of a triangle mesh as Blender stores them.

Blender can find them itself, but on its main thread, where they are most of the time that a new
proxy takes.
"""

import numpy as np
from numpy.typing import NDArray


def find_edges(triangles: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The vertices (E, 2) of each edge, and for the corners (F, 3) the edge to the next corner."""
    following = triangles[:, [1, 2, 0]]
    low, high = np.minimum(triangles, following), np.maximum(triangles, following)
    names = (low.astype(np.int64) << 32 | high).ravel()  # (3F,)
    order = np.argsort(names, kind="stable")  # quick, because a mesh is nearly sorted already
    ordered = names[order]
    first = np.append(True, ordered[1:] != ordered[:-1])[: len(names)]
    of_corners = np.empty(len(names), np.int32)
    of_corners[order] = np.cumsum(first, dtype=np.int32) - 1
    edges = ordered[first]
    vertices = np.stack([edges >> 32, edges & 0xFFFFFFFF], axis=1)  # (E, 2)
    return vertices.astype(np.int32), of_corners.reshape(triangles.shape)
