# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges of a triangle mesh as Blender stores them.

Blender can find them itself, but on its main thread, where they are most of the time that a new
proxy takes.
"""

import numpy as np
from numpy.typing import NDArray


def find_edges(triangles: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The vertices (E, 2) of each edge, and for the corners (F, 3) the edge to the next corner."""
    ends = np.stack([triangles, triangles[:, [1, 2, 0]]], axis=-1).astype(np.int64)  # (F, 3, 2)
    names = (ends.min(axis=-1) << 32) + ends.max(axis=-1)  # (F, 3)
    edges, of_corners = np.unique(names, return_inverse=True)
    vertices = np.stack([edges >> 32, edges & 0xFFFFFFFF], axis=1)  # (E, 2)
    return vertices.astype(np.int32), of_corners.reshape(triangles.shape).astype(np.int32)
