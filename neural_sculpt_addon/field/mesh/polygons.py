# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons as triangles: a fan for each, which covers more than a concave one."""

import numpy as np
from numpy.typing import NDArray


def fans(starts: NDArray[np.int64], counts: NDArray[np.int64], size: int = 1) -> NDArray[np.int64]:
    """Where in a file or an array the corners (T, 3) of the triangles lie of polygons whose own
    begin at `starts` (F,), `counts` (F,) of them, each of which takes `size`. Polygons with fewer
    than three have no triangles."""
    each = np.maximum(counts - 2, 0)
    face = np.repeat(np.arange(len(counts)), each)
    turn = np.arange(len(face)) - np.repeat(np.cumsum(each) - each, each)
    corners = np.stack([np.zeros_like(turn), turn + 1, turn + 2], axis=1)  # (T, 3)
    return starts[face, None] + size * corners
