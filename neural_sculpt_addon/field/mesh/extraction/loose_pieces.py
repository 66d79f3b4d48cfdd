# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose pieces: small ones far from the others, found by the detail that makes them.

A coarse look at f does not tell of them. But the coefficients that make one have their greatest or
least in it or beside it, for around it f is far from zero. From such nodes Newton steps lead onto
it, however small it is. Model space.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...evaluate import values, values_and_gradients
from ...field import Field
from ...geometry import lengths
from ...levels import spacing
from ...projection import ARRIVED, SMALLEST_GRADIENT

LARGE = 0.1  # share of the edge of a cell; smaller coefficients make no piece
NEWTON_STEPS = 6  # to the surface; what has not come there is no piece
LONGEST_STEP = 0.5  # of Newton, in cells; the first twice that


def loose_places(
    field: Field, asked: Callable[[NDArray[np.float32]], NDArray[np.bool_]]
) -> NDArray[np.float32]:
    """Places (P, 3) of the surface near extremes of the detail.

    asked: which of points (N, 3) lie where the surface is not known yet
    """
    points, reach, near = (np.empty(shape, np.float32) for shape in ((0, 3), (0, 1), (0,)))
    for grid in field.detail.to("cpu").grids:
        h = np.float32(spacing(grid.level))
        middles, size = grid.extremes(LARGE * float(h))
        new = asked(middles)
        points = np.concatenate([points, middles[new]])
        near = np.append(near, np.maximum(h, size[new]))
        reach = np.concatenate([reach, np.full((new.sum(), 1), h)])
    left = np.abs(values(field, points)) < near
    points, reach = points[left], reach[left]
    step = np.empty((len(points), 1), np.float32)
    for number in range(NEWTON_STEPS):
        value, gradient = values_and_gradients(field, points)
        slope = np.maximum(lengths(gradient), SMALLEST_GRADIENT)
        longest = reach if number == 0 else LONGEST_STEP * reach
        step = np.clip(value[:, None] / slope, -longest, longest)
        points = points - step * gradient / slope
        left = asked(points)  # most come to what is known
        points, reach, step = points[left], reach[left], step[left]
    return points[np.abs(step[:, 0]) < ARRIVED]
