# SPDX-License-Identifier: GPL-3.0-or-later
"""The strokes of the tables: radius 0.08, intensity 0.06, quintic (paper, table 2).

The paper does not say how long its random edits are and how they turn. Ours are 0.5 long, six
radii, and turn by up to a quarter on their way; one that leaves the surface is drawn again. Model
space.
"""

import numpy as np
from benchmarking import random_strokes

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.problem.placement import place_stroke
from neural_sculpt_addon.field.problem.prepare import Preparation
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke

RADIUS, INTENSITY = 0.08, 0.06
POINTS, LENGTH, TURNS = 12, 0.5, 0.25
TRIES = 50


def random_edit(preparation: Preparation, number: int, seed: int, points: int = POINTS) -> Stroke:
    """The stroke of this number on a shape, with so many points evenly along the same way."""
    field, surface = preparation.field, preparation.surface
    random = np.random.default_rng((seed, number))
    for _ in range(TRIES):
        turns = random.uniform(-TURNS, TURNS)
        way = random_strokes.walk(field, surface, LENGTH, turns, POINTS, random)
        stroke = Stroke(way, Brush(RADIUS, INTENSITY), seed=number)
        try:
            path = place_stroke(field, stroke)
        except SculptError:
            continue
        if points == POINTS:
            return stroke
        u = np.linspace(0, 1, points)
        even = np.stack([np.interp(u, path.u, axis) for axis in path.points.T], axis=1)
        return Stroke(even, stroke.brush, seed=number)
    raise SculptError("No random stroke stays on this surface.")
