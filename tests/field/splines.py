# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadratic B-splines by SciPy, as dense matrices: what the detail is compared to."""

import numpy as np
from scipy.interpolate import BSpline

SPLINE = BSpline.basis_element([-1.5, -0.5, 0.5, 1.5], extrapolate=False)
MARGIN = 8  # cells of a level outside of the box, on each side


def nodes(index, level):
    """The places (K, 3) of the nodes that have the numbers `index` (K,) of a level."""
    count = 2 ** (level + 1) + 2 * MARGIN
    cells = np.stack(np.unravel_index(index, (count,) * 3), axis=1)
    return (cells + 0.5 - MARGIN) * 2.0**-level - 1


def basis(points, index, level):
    """The splines of the nodes `index` (K,) at `points` (N, 3), and their gradients: (N, K) and
    (N, K, 3)."""
    offset = (np.asarray(points, float)[:, None] - nodes(index, level)) * 2.0**level
    value = np.nan_to_num(SPLINE(offset))  # (N, K, 3)
    slope = np.nan_to_num(SPLINE.derivative()(offset)) * 2.0**level
    x, y, z = np.moveaxis(value, -1, 0)
    gradient = slope * np.stack([y * z, x * z, x * y], axis=-1)
    return x * y * z, gradient
