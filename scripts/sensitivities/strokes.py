# SPDX-License-Identifier: GPL-3.0-or-later
"""Held-out strokes: drawn by walking over fields that no benchmark uses.

Every second one of them is carved so deep that many fold.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from benchmarking import random_strokes
from workshop import ROOT

from neural_sculpt_addon.field.checkpoint import load
from neural_sculpt_addon.field.edit.edit import Edit
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


def measured(edit: Edit, ratios: Sequence[str]) -> dict[str, float]:
    """The measures `ratios` of an edit's report, whether the tolerance is met, and whether the
    number of pieces has changed."""
    report = edit.report()
    return {
        **{name: report[name] for name in ratios},
        "met": report["tolerance_met"],
        "pieces": report["components_after"] != report["components_before"],
    }
