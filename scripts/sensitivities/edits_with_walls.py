# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes by the local solver with a plateau between steep walls, each on an unedited field
(docs/method.md, section 4.1)."""

from dataclasses import replace
from functools import partial

import numpy as np

from neural_sculpt_addon.stroke.profile import Profile

from .edits import RATIOS, solved
from .strokes import SHAPES, drawn, packed
from .subject import Case, Subject

WALLS = 0.3, 0.15, 0.08, 0.04
"""Their widths, radii."""


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Mixed strokes with the profile of a plateau."""
    return [_case(seed, number, more) for number in range(count)]


def _case(seed: int, number: int, more: int) -> Case:
    on = packed(SHAPES[number % len(SHAPES)])
    stroke = drawn(on, seed, number, more)
    wall = WALLS[number % len(WALLS)]
    profile = Profile(points=((-1, 0), (wall - 1, 1), (1 - wall, 1), (1, 0)))
    radius, intensity = stroke.brush.radius, stroke.brush.intensity
    brush = replace(
        stroke.brush, profile=profile, intensity=float(np.clip(intensity, -radius, radius))
    )
    return partial(solved, on, replace(stroke, brush=brush))


SUBJECT = Subject(
    cases=cases,
    count=8,
    constants={"solve.resolution": ("WALL", "LEAST_WITH_WALLS", "NARROWEST_WALL", "LEAST_RISE")},
    ratios=RATIOS,
    highest=("tube_p95",),
    sums=("met", "pieces"),
)
