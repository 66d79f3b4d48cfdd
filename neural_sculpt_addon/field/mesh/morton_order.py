# SPDX-License-Identifier: GPL-3.0-or-later
"""Morton order: triangles that are near to each other are near in memory, and so are vertices.

Blender's main thread sorts the triangles into boxes for its brushes whenever the mesh has changed.
From this order that takes a quarter less than from the one in which a mesh was refined.
"""

import numpy as np
from numpy.typing import NDArray

ORDER_CELLS = 1024
"""Cells per axis in which middles of triangles are told apart: finer than triangles."""
_SPREAD = ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249))
"""Shifts and masks that put two free bits before each of a number's ten (Morton code)."""


def morton_order(
    vertices: NDArray[np.float32], triangles: NDArray[np.int32]
) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """The indices (V,) of the vertices in their new order, and the triangles (F, 3) in theirs, with
    the new numbers of their corners.

    Triangles are sorted by the Morton codes of their middles, vertices by the first triangle that
    has them.

    vertices:  (V, 3), model space; triangles: (F, 3)
    """
    middles = vertices[triangles].mean(axis=1)
    cells = ((middles + 1) * (ORDER_CELLS / 2)).clip(0, ORDER_CELLS - 1).astype(np.int64)  # (F, 3)
    for shift, mask in _SPREAD:
        cells = (cells | cells << shift) & mask
    code = cells[:, 0] | cells[:, 1] << 1 | cells[:, 2] << 2
    triangles = triangles[np.argsort(code, kind="stable")]
    corners = triangles.ravel()[::-1]
    first = np.full(len(vertices), corners.size)  # corner at which each vertex is met
    first[corners] = np.arange(corners.size)[::-1]
    order = np.argsort(first, kind="stable")
    place = np.empty(len(vertices), np.int32)
    place[order] = np.arange(len(vertices), dtype=np.int32)
    return order, place[triangles]
