# SPDX-License-Identifier: GPL-3.0-or-later
"""Built-in images of alphas, as formulas of x, to the right, and y, up, arrays in [-1, 1].

Values are grey, clipped to [0, 1] by the caller. An image that is not black at its border has
period 2, so that a row of it along a stroke shows no seams.
"""

from collections.abc import Callable, Mapping
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Image = Callable[[Array, Array], Array]

PORES = 30  # pits of the image


def _scales(x: Array, y: Array) -> Array:
    """Round scales whose tips point back along the stroke, each row upon the one behind it."""
    high = np.zeros_like(x)
    for row, column in product(range(-3, 4), range(-2, 3)):
        aside, behind = x - column - row % 2 / 2, row / 2 - y
        rim = np.clip((0.56 - np.hypot(aside, behind)) / 0.18, 0, 1)
        high = np.maximum(high, rim * (0.62 + 0.9 * behind))
    return high


def _stitches(x: Array, y: Array) -> Array:
    """Two threads aslant across the stroke."""
    high = np.zeros_like(x)
    for middle in (-0.5, 0.5):
        aside, ahead = x - np.clip(x, -0.5, 0.5), y - middle - 0.4 * np.clip(x, -0.5, 0.5)
        high = np.maximum(high, 1 - (aside**2 + ahead**2) / 0.25**2)
    return high


def _pores(x: Array, y: Array) -> Array:
    """Round pits of different sizes, evenly strewn (a sequence of low discrepancy)."""
    high = np.ones_like(x)
    for number in range(PORES):
        middle = number * np.array([0.7548776662, 0.5698402910]) % 1 * 2 - 1
        size = 0.09 + 0.08 * (number * 0.6180339887 % 1)
        off = [(way - at + 1) % 2 - 1 for way, at in zip((x, y), middle, strict=True)]
        high = np.minimum(high, 1 - np.exp(-(((off[0] ** 2 + off[1] ** 2) / size**2) ** 1.5)))
    return high


def _rivet(x: Array, y: Array) -> Array:
    """A round head, flat in its middle."""
    inside = np.clip((0.8 - np.hypot(x, y)) / 0.45, 0, 1)
    return inside * (2 - inside)


def _star(x: Array, y: Array) -> Array:
    """Five points with ridges that meet in the middle; one points ahead."""
    sector = 2 * np.pi / 5
    angle = np.abs((np.arctan2(x, y) + sector / 2) % sector - sector / 2)  # from a tip
    tip, notch = 0.95, 0.4
    across = np.sin(sector / 2) * notch, tip - np.cos(sector / 2) * notch  # of the edge
    edge = tip * across[0] / (np.cos(angle) * across[0] + np.sin(angle) * across[1])
    return 1 - np.hypot(x, y) / edge


def _rope(x: Array, y: Array) -> Array:
    """Strands that wind around the stroke."""
    strand: Array = np.abs(np.sin(np.pi * (y + 0.7 * x)))
    return 1 - (1 - strand) ** 2


IMAGES: Mapping[str, Image] = {
    "scales": _scales,
    "stitches": _stitches,
    "pores": _pores,
    "rivet": _rivet,
    "star": _star,
    "rope": _rope,
}
"""By name. Add at the end: Blender files hold the number of a choice."""
