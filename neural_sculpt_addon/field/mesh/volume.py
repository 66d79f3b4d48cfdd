# SPDX-License-Identifier: GPL-3.0-or-later
"""The field as a narrow band of values on a lattice, for formats that keep level sets. Model space.

The lattice spans the box [-1, 1]^3.
"""

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Progress, silent
from ..evaluate import values
from ..field import Field
from .proxy import check_cells

BAND = 3  # cells on each side of the surface; what lies beyond has the value of its border
SLABS = 1 << 17  # points, at least, between two looks at `progress`


def sample_band(field: Field, cells: int, progress: Progress = silent) -> NDArray[np.float32]:
    """f at all points (n, n, n), n = cells + 1, cut off BAND cells from the surface.

    SculptError when nobody could hold so many cells.
    """
    check_cells(cells)
    axis = np.linspace(-1, 1, cells + 1, dtype=np.float32)
    band = np.empty((len(axis),) * 3, np.float32)
    step = -(-SLABS // len(axis) ** 2)
    border = BAND * 2 / cells
    for start in range(0, len(axis), step):
        progress(start / len(axis), "Sampling the field")
        points = np.meshgrid(axis[start : start + step], axis, axis, indexing="ij")
        value = values(field, np.stack(points, axis=-1).reshape(-1, 3))
        band[start : start + step] = value.clip(-border, border).reshape(points[0].shape)
    return band
