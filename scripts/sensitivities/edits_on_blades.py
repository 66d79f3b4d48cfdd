# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes by the local solver, each across blades of several widths that others raised
(docs/method.md, sections 2 and 4.1)."""

from functools import partial

import numpy as np
from benchmarking import random_strokes
from numpy.typing import NDArray

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import normals
from neural_sculpt_addon.field.problem.prepare import Preparation
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke

from .edits import RATIOS, solved
from .strokes import SHAPES, packed
from .subject import Case, Subject

BLADES = [Brush(radius, 2 * radius) for radius in (0.01, 0.02, 0.04)]
APART = 0.1
RADIUS, HEIGHT = 0.05, 0.06  # of what crosses them
LENGTH, POINTS = 0.3, 9


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Strokes across the middle of blades, in turns raised and carved."""
    return [_case(packed(SHAPES[n % len(SHAPES)]), seed, n, more) for n in range(count)]


def _case(on: Preparation, seed: int, number: int, more: int) -> Case:
    random = np.random.default_rng([seed, number])
    along = random_strokes.walk(on.field, on.surface, LENGTH, 0.0, POINTS, random)
    middle, ahead = along[POINTS // 2], along[-1] - along[0]
    side = np.cross(normals(on.field, middle[None].astype(np.float32))[0], ahead)
    side /= np.linalg.norm(side)
    away = np.linspace(-LENGTH / 2, LENGTH / 2, POINTS)[:, None]
    across = _on_surface(on, middle + away * side)
    brush = Brush(RADIUS, HEIGHT if number % 2 else -HEIGHT)
    bladed = on
    for place, blade in enumerate(BLADES, start=-1):
        bladed = sculpt(
            bladed, Stroke(_on_surface(on, along + place * APART * side), blade)
        ).preparation
    return partial(solved, bladed, Stroke(across, brush, seed=number + more))


def _on_surface(on: Preparation, points: NDArray[np.floating]) -> NDArray[np.float64]:
    return project(on.field, points).points.astype(float)


SUBJECT = Subject(
    cases=cases,
    count=6,
    constants={"solve.resolution": ("LEFT_FINER",), "problem.problem": ("GUIDED", "STEEP")},
    ratios=RATIOS,
    highest=("tube_p95",),
    sums=("met", "pieces"),
)
