# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a field itself: rays that start a little above its proxy and march along its values.

Parallel rays; clay under a light that grazes the surface, so that a relief of a thousandth shows.
Far from the surface the values are not to be trusted, and thin relief would be jumped over: so the
proxy says where the rays start. Model space.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter

from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import extract

Array = NDArray[np.float64]

CELLS = 256  # of the proxy
START = 0.005  # above the proxy
STEPS = 120
CAUTION = 0.8  # of the way that the value allows; half of it after each passage of the surface
LONGEST = 0.02  # of a step
DEPTH = 1.6  # behind which there is nothing
CLOSE = 2e-4
GRAZING = 1e-2  # counts as a hit for rays that creep along the surface until the steps are used up
CLAY = np.array([0.86, 0.62, 0.48])
BACKGROUND = np.array([1.0, 1.0, 1.0])


AMBIENT = 0.16
LAMPS = (  # right, up, towards the viewer; color
    ((-1.0, 0.9, 0.35), (0.95, 0.92, 0.86)),
    ((1.0, -0.1, 0.7), (0.26, 0.3, 0.36)),
    ((0.2, 1.0, -0.2), (0.2, 0.22, 0.25)),
)


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


def trace(field: Field, camera: Camera, places: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """Where rays meet the field (N, 3), and whether they do (N,).

    places: (N, 2) on the picture, -1 to 1 to the right and up
    """
    right, up, toward = camera.axes
    flat = np.asarray(places, float)
    heights = _heights(field, camera)
    height = heights[_tiles(flat, len(heights))] + START
    going = np.flatnonzero(np.isfinite(height))
    hit = np.zeros(len(flat), bool)
    points = camera.target + camera.half * (flat[:, :1] * right + flat[:, 1:] * up)  # (N, 3)
    points[going] += height[going, None] * toward
    caution, last = np.full(len(flat), CAUTION), np.ones(len(flat))
    for _ in range(STEPS):
        value = values(field, points[going])
        caution[going] *= np.where(value * last[going] < 0, 0.5, 1.0)
        last[going] = value
        step = caution[going] * np.clip(value, -LONGEST, LONGEST)
        points[going] -= step[:, None] * toward
        hit[going] = np.abs(value) < CLOSE
        behind = (points[going] - camera.target) @ toward < -DEPTH
        going = going[~hit[going] & ~behind]
        if not len(going):
            break
    hit[going] = np.abs(values(field, points[going])) < GRAZING
    return points, hit & (np.abs(points) <= 1).all(axis=1)  # beyond, networks have other zeros


def _heights(field: Field, camera: Camera) -> Array:
    """How far the proxy reaches towards the viewer in each tile (T, T) of the picture or beside it.

    Tiles are as large as the proxy's cells, so each that shows some of it has a vertex near.
    """
    right, up, toward = camera.axes
    seen = extract(field, CELLS).vertices - np.array(camera.target)
    places = np.stack([seen @ right, seen @ up], axis=1) / camera.half
    size = max(int(camera.half * CELLS), 1)
    heights = np.full((size, size), -np.inf)
    inside = (np.abs(places) < 1).all(axis=1)
    np.maximum.at(heights, _tiles(places[inside], size), (seen @ toward)[inside])
    return maximum_filter(heights, 3)


def _tiles(places: Array, size: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The tiles, of (size, size), in which places (N, 2) of the picture lie."""
    x, y = ((places + 1) / 2 * size).astype(np.intp).T
    return x, y


def picture(field: Field, camera: Camera, size: int) -> NDArray[np.uint8]:
    """The field as (size, size, 3), smooth at its outlines."""
    fine = 2 * size
    axis = (np.arange(fine) + 0.5) / fine * 2 - 1
    x, y = np.meshgrid(axis, -axis)
    points, hit = trace(field, camera, np.stack([x.ravel(), y.ravel()], 1))
    colors = np.tile(BACKGROUND, (len(points), 1))
    _, gradients = values_and_gradients(field, points[hit])
    normals = gradients / np.linalg.norm(gradients, axis=1, keepdims=True)
    seen = normals @ camera.axes.T  # (N, 3): right, up, toward
    bright = np.full((len(seen), 3), AMBIENT)
    for direction, color in LAMPS:
        unit = np.array(direction) / np.linalg.norm(direction)
        bright += np.clip(seen @ unit, 0, None)[:, None] * color
    colors[hit] = CLAY * bright
    colors = np.clip(colors, 0, 1).reshape(size, 2, size, 2, 3).mean((1, 3)) ** (1 / 1.6)
    return (255 * colors + 0.5).astype(np.uint8)
