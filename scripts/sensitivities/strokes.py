# SPDX-License-Identifier: GPL-3.0-or-later
"""Held-out strokes: drawn by walking over fields that no benchmark uses.

Every second one of them is carved so deep that many fold.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from benchmarking import random_strokes
from workshop import ROOT

from neural_sculpt_addon.field.checkpoint import load
from neural_sculpt_addon.field.problem.prepare import Preparation, prepare
from neural_sculpt_addon.stroke.stroke import Stroke

PACKED = ROOT / "tests" / "field" / "packed"
SHAPES = ("blob", "gear", "star")
FOLDED, DEEP = 2, 0.25  # every which stroke is carved how deep, model units


@cache
def packed(shape: str) -> Preparation:
    """The field of a packed network, ready for strokes."""
    return prepare(load(PACKED / f"{shape}.pth"))


def drawn(on: Preparation, seed: int, number: int, more: int, deep: float = DEEP) -> Stroke:
    """The stroke of that number, with the samples of `more`."""
    stroke = random_strokes.mixed(on.field, on.surface, np.random.default_rng([seed, number]))
    if number % FOLDED == FOLDED - 1:
        stroke = replace(stroke, brush=replace(stroke.brush, intensity=-deep))
    return replace(stroke, seed=stroke.seed + more)
