# SPDX-License-Identifier: GPL-3.0-or-later
"""Projection of points onto the zero level set of a field, by Newton steps along the gradient.

    x <- x - f g / |g|^2,  the step no longer than `reach`

Fields are no exact distances (|grad f| reaches 2.2 on pretrained networks and falls below 0.1 near
medial axes), so the step is capped and repeated. Model space.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .evaluate import values_and_gradients
from .field import Field

ARRIVED = 1e-4  # length of a last Newton step that leaves a point off by no more than its square
ON_SURFACE = 1e-3  # length of one after which a point counts as on the surface; others are lost
SMALLEST_GRADIENT = 0.2  # |grad f| below which f / |grad f| is no distance: it takes its place


class Projection(NamedTuple):
    """Points that were brought to the surface, and the surface there."""

    points: NDArray[np.float32]  # (N, 3)
    normals: NDArray[np.float32]  # (N, 3), unit, outward
    distance: NDArray[np.float32]  # (N,), |f| / |grad f| before the last step, its length

    def where(self, chosen: NDArray[np.bool_]) -> "Projection":
        """The chosen points."""
        return Projection(self.points[chosen], self.normals[chosen], self.distance[chosen])


def project(
    field: Field, points: ArrayLike, steps: int = 5, reach: float = 0.1, tolerance: float = 1e-6
) -> Projection:
    """Bring `points` (N, 3) to f = 0 by at most `steps` Newton steps of at most `reach` each.

    Points that were within `tolerance` before a step are not moved again, nor evaluated again.
    """
    x = np.array(points, np.float32).reshape(-1, 3)
    normals = np.zeros_like(x)
    distance = np.full(len(x), np.inf, np.float32)
    moving = np.arange(len(x))
    for _ in range(steps):
        f, gradient = values_and_gradients(field, x[moving])
        slope = np.linalg.norm(gradient, axis=1)  # (n,)
        normals[moving] = gradient / np.maximum(slope, 1e-12)[:, None]
        step = f / np.maximum(slope, SMALLEST_GRADIENT)  # signed length along the normal
        distance[moving] = np.abs(step)
        x[moving] -= np.clip(step, -reach, reach)[:, None] * normals[moving]
        moving = moving[np.abs(step) > tolerance]
        if not len(moving):
            break
    return Projection(x, normals, distance)


class Found(NamedTuple):
    """The surface near points (N, 3)."""

    distance: NDArray[np.float32]  # (N,), from the points to the surface
    normals: NDArray[np.float32]  # (N, 3), unit, outward, at the nearest places found on it
    slope: NDArray[np.float32]  # (N,), |grad f| at the points themselves


def find_surface(field: Field, points: ArrayLike) -> Found:
    """The surface near `points` (N, 3): how far it is, and its normals.

    Where projection does not arrive, the distance is |f| / |grad f|, or the way gone if longer.
    """
    points = np.asarray(points, np.float32)
    value, gradient = values_and_gradients(field, points)
    slope = np.linalg.norm(gradient, axis=1)
    surface = project(field, points, steps=8)
    way = np.linalg.norm(surface.points - points, axis=1)
    estimate = np.abs(value) / np.maximum(slope, SMALLEST_GRADIENT)
    arrived = surface.distance < ARRIVED
    return Found(np.where(arrived, way, np.maximum(way, estimate)), surface.normals, slope)
