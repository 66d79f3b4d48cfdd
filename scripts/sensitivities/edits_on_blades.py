# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes by the local solver, each across a blade that another one raised (docs/method.md, section
4.1)."""

from functools import partial

import numpy as np
from benchmarking import random_strokes

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import normals
from neural_sculpt_addon.field.problem.prepare import Preparation
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke

from .edits import RATIOS, solved
from .strokes import SHAPES, packed
from .subject import Case, Subject

BLADE = Brush(0.02, 0.06)
RADIUS, HEIGHT = 0.08, 0.06  # of what crosses it
LENGTH, POINTS = 0.3, 9


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Strokes across the middle of a blade, in turns raised and carved."""
    return [_case(packed(SHAPES[n % len(SHAPES)]), seed, n, more) for n in range(count)]


def _case(on: Preparation, seed: int, number: int, more: int) -> Case:
    random = np.random.default_rng([seed, number])
    along = random_strokes.walk(on.field, on.surface, LENGTH, 0.0, POINTS, random)
    middle, ahead = along[POINTS // 2], along[-1] - along[0]
    side = np.cross(normals(on.field, middle[None].astype(np.float32))[0], ahead)
    away = np.linspace(-LENGTH / 2, LENGTH / 2, POINTS)[:, None]
    across = project(on.field, middle + away * side / np.linalg.norm(side)).points.astype(float)
    brush = Brush(RADIUS, HEIGHT if number % 2 else -HEIGHT)
    bladed = sculpt(on, Stroke(along, BLADE)).preparation
    return partial(solved, bladed, Stroke(across, brush, seed=number + more))


SUBJECT = Subject(
    cases=cases,
    count=6,
    constants={"solve.resolution": ("LEFT_FINER",), "problem.pose": ("GUIDED",)},
    ratios=RATIOS,
    highest=("tube_p95",),
    sums=("met", "pieces"),
)
