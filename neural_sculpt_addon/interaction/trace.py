# SPDX-License-Identifier: GPL-3.0-or-later
"""Where strokes of the history run over the surface: lines to be drawn, and which one is meant.

A stroke and each of its images has a line along its middle; a dab has its rim. `Lay` is as for
ribbons. NumPy alone; model space.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..stroke.curve import Array, fit_curve
from ..stroke.stroke import Kind, Stroke
from .ribbon import LIFT, RIM, Lay

LINE_POINTS, MEAN_OF = 80, 8
"""Points of a line, and of how many to each side the mean normal is."""


def trace(stroke: Stroke, share: float, lay: Lay) -> tuple[Array, ...]:
    """The lines (N, 3) of the stroke and of its images, a little above the surface.

    share: of its displacement that the surface shows

    A point on a ridge has no one nearest point of the surface, so the line where the stroke was
    drawn is displaced as its middle is, along normals that are the mean of those around it.
    """
    middle, brush = _middle(stroke), stroke.brush
    line = middle if len(middle) > 1 else _rim(middle[0], brush.radius, lay)
    raised = LIFT + np.zeros(len(line))
    if len(middle) > 1 and stroke.kind is Kind.DRAW:
        strength = brush.modulation(np.linspace(0, 1, len(line)))
        raised += share * brush.intensity * float(brush.profile(np.zeros(1))[0]) * strength
    above = line + raised[:, None] * _mean(lay(line)[1])
    return tuple(above @ image.T for image in stroke.images)


def under(point: ArrayLike, strokes: Sequence[Stroke]) -> int | None:
    """Which of the strokes covers the `point` (3,): the last one, which lies on top of the others.

    None when no one does.
    """
    point = np.asarray(point, float)
    for number in reversed(range(len(strokes))):
        stroke, middle = strokes[number], _middle(strokes[number])
        images = point @ stroke.images  # (M, 3), turned back
        reach = stroke.largest_radius + stroke.largest_intensity
        if np.linalg.norm(images[:, None] - middle, axis=2).min() <= reach:
            return number
    return None


def _middle(stroke: Stroke) -> Array:
    """Points (N, 3) along the stroke, where it was drawn; one of a dab."""
    curve = fit_curve(stroke.points, stroke.closed)
    return curve.resample(LINE_POINTS)[0] if len(curve.points) > 1 else curve.points[:1]


def _mean(normals: Array) -> Array:
    """Unit means (N, 3) of normals (N, 3), each with those within MEAN_OF places of it."""
    sums = np.cumsum(np.pad(normals, ((MEAN_OF + 1, MEAN_OF), (0, 0)), mode="edge"), axis=0)
    mean = sums[2 * MEAN_OF + 1 :] - sums[: -2 * MEAN_OF - 1]
    return mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)


def _rim(center: Array, radius: float, lay: Lay) -> Array:
    """A circle (RIM + 1, 3) around `center` (3,), in the tangent plane."""
    normal = lay(center)[1][0]
    aside = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    aside /= max(float(np.linalg.norm(aside)), 1e-12)
    angle = np.linspace(0, 2 * np.pi, RIM + 1)[:, None]
    return center + radius * (np.cos(angle) * aside + np.sin(angle) * np.cross(normal, aside))
