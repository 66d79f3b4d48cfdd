# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a field itself, without a mesh between: rays that march along its values.

Parallel rays, clay under a light that grazes the surface, so that a relief of a thousandth shows.
Model space.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.network import Siren

Array = NDArray[np.float64]

STEPS = 60
CAUTION = 0.8  # of the way that the field's value allows: a neural field is nearly a distance
DEPTH = 1.6
LONGEST = 0.15  # of a step; far from the surface the values are not to be trusted
CLOSE = 5e-4
GRAZING = 1e-2  # counts as a hit for rays that creep along the surface until the steps are used up
BOX = 0.95  # half its width; beyond, a network that was fitted without it has surfaces, too
CLAY = np.array([0.86, 0.62, 0.48])
BACKGROUND = np.array([1.0, 1.0, 1.0])
LIGHTS = (  # right, up, towards the viewer; color
    ((-1.0, 0.9, 0.35), (0.95, 0.92, 0.86)),
    ((1.0, -0.1, 0.7), (0.26, 0.3, 0.36)),
    ((0.2, 1.0, -0.2), (0.2, 0.22, 0.25)),
)
AMBIENT = 0.16


@dataclass(frozen=True)
class Camera:
    """Looks at `target` from the direction `seen_from`; the picture is 2 `half` high and wide."""

    seen_from: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    half: float = 0.9

    @property
    def axes(self) -> Array:
        """Right, up, and towards the viewer, as rows (3, 3)."""
        toward = np.array(self.seen_from) / np.linalg.norm(self.seen_from)
        right = np.cross(self.up, toward)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(toward, right), toward])


def trace(network: Siren, camera: Camera, places: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """Where rays meet the field (N, 3), and whether they do (N,).

    places: (N, 2) on the picture, -1 to 1 to the right and up
    """
    right, up, toward = camera.axes
    flat = camera.half * np.asarray(places, float)
    points = camera.target + flat[:, :1] * right + flat[:, 1:] * up + DEPTH * toward  # (N, 3)
    hit = np.zeros(len(points), bool)
    going = np.arange(len(points))
    for _ in range(STEPS):
        value = np.maximum(values(network, points[going]), np.abs(points[going]).max(1) - BOX)
        points[going] -= CAUTION * np.clip(value, -LONGEST, LONGEST)[:, None] * toward
        hit[going] = np.abs(value) < CLOSE
        behind = points[going] @ toward < -DEPTH
        going = going[~hit[going] & ~behind]
        if not len(going):
            break
    hit[going] = np.abs(values(network, points[going])) < GRAZING
    return points, hit


def picture(network: Siren, camera: Camera, size: int) -> NDArray[np.uint8]:
    """The field as (size, size, 3), smooth at its outlines."""
    fine = 2 * size
    axis = (np.arange(fine) + 0.5) / fine * 2 - 1
    x, y = np.meshgrid(axis, -axis)
    points, hit = trace(network, camera, np.stack([x.ravel(), y.ravel()], 1))
    colors = np.tile(BACKGROUND, (len(points), 1))
    _, gradients = values_and_gradients(network, points[hit])
    normals = gradients / np.linalg.norm(gradients, axis=1, keepdims=True)
    seen = normals @ camera.axes.T  # (N, 3): right, up, toward
    light = np.full((len(seen), 3), AMBIENT)
    for direction, color in LIGHTS:
        unit = np.array(direction) / np.linalg.norm(direction)
        light += np.clip(seen @ unit, 0, None)[:, None] * color
    colors[hit] = CLAY * light
    colors = np.clip(colors, 0, 1).reshape(size, 2, size, 2, 3).mean((1, 3)) ** (1 / 1.6)
    return (255 * colors + 0.5).astype(np.uint8)
