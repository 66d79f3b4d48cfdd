# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes for any field: drawn, as an artist would, on what the camera sees of it.

A stroke is a curve over the picture, pulled onto the surface by rays. Lengths are in model space.
"""

from collections.abc import Iterable

import numpy as np
from bpy.types import Object
from mathutils import Vector
from numpy.typing import NDArray

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke

from . import studio

Array = NDArray[np.float64]

RADIUS = 0.08
RAYS = 96  # along a row of the picture that looks for the surface
THINNING = 3  # of the rays that hit, for control points
SWAY = 0.15  # of half the picture's height, how far a bow rises in its middle
APART = 0.35  # of half the picture's height, between the two strokes
SMOOTH = 0.96  # cosine between the normals of two rays that hit the same smooth part

GROOVE = Profile(points=((-1, 0), (-0.55, 0.45), (0, -1), (0.55, 0.45), (1, 0)))


def draw(ob: Object, camera: Object) -> tuple[Stroke, ...]:
    """A ridge where the surface in the picture is widest, and a groove where it is next widest."""
    bows = {height: _bow(ob, camera, height) for height in np.linspace(-0.8, 0.8, 33)}

    def widest(heights: Iterable[float]) -> float:
        return max(heights, key=lambda height: len(bows[height]))

    upper = widest(bows)
    lower = widest(height for height in bows if abs(height - upper) > APART)
    if min(len(bows[upper]), len(bows[lower])) < 4:
        raise SculptError("The camera sees too little of the field for a stroke; use --strokes.")
    ridge = Brush(RADIUS, 0.05, Profile("quintic"), Modulation("identity"))
    groove = Brush(1.2 * RADIUS, 0.07, GROOVE, Modulation("central"))
    return Stroke(bows[upper], ridge, name="Ridge"), Stroke(bows[lower], groove, name="Groove")


def _bow(ob: Object, camera: Object, height: float) -> Array:
    """Points (K, 3) of the longest unbroken stretch of a bow from left to right over the picture.

    `height` goes from -1 at the lower to 1 at the upper edge of the picture.
    """
    x = np.linspace(-1, 1, RAYS)
    y = height + SWAY * (0.5 - x**2)
    width, depth = studio.SIZE[1] / studio.SIZE[0], studio.LENS / 18
    to_model = ob.matrix_world.inverted() @ camera.matrix_world
    hits = []
    for ray in zip(x, y * width, [-depth] * RAYS, strict=True):
        direction = to_model.to_3x3() @ Vector(ray)
        hit, point, normal, _ = ob.ray_cast(to_model.translation, direction)
        hits.append((point, normal) if hit else None)
    run = _longest_run(hits)
    margin = len(run) // 10  # keep off the silhouette
    return np.array(run[margin : len(run) - margin : THINNING])


def _longest_run(hits: list[tuple[Vector, Vector] | None]) -> list[Vector]:
    """The points of the longest stretch without an edge or a gap."""
    longest: list[Vector] = []
    run: list[Vector] = []
    before = None
    for hit in hits:
        if hit is None or before is None or hit[1].dot(before[1]) < SMOOTH:
            run = []
        run = run if hit is None else [*run, hit[0]]
        longest = max(longest, run, key=len)
        before = hit
    return longest
