# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes by the local solver, each on an unedited field (docs/method.md, sections 2 to 4)."""

from functools import partial

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.problem.prepare import Preparation
from neural_sculpt_addon.stroke.stroke import Stroke

from .strokes import SHAPES, drawn, measured, packed
from .subject import Case, Made, Subject, layer_bits

RATIOS = ("tube_mean", "tube_p95", "reverse_p95", "normal_deg", "rim_mean")


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Strokes of any brush."""
    ready = [packed(SHAPES[number % len(SHAPES)]) for number in range(count)]
    return [partial(solved, on, drawn(on, seed, number, more)) for number, on in enumerate(ready)]


def solved(on: Preparation, stroke: Stroke) -> Made:
    """What a stroke makes of a field."""
    edit = sculpt(on, stroke)
    return Made(layer_bits(edit.layer or {}), partial(measured, edit, RATIOS))


SUBJECT = Subject(
    cases=cases,
    count=9,
    constants={
        "solve.resolution": (
            *("CELLS_PER_FEATURE", "CELLS_OVER_RELIEF", "LEAST_FINEST", "DENSITY", "LAYERS"),
        ),
        "solve.local": (
            *("FEWEST", "ACTIVE_MARGIN", "GAP", "HIGH", "STRIDE", "REPAIRS", "CHANGED"),
            *("BESIDE", "SHARE"),
            *("FORBIDDEN_WEIGHT", "MISSED", "TILTED", "OF_HEIGHT", "FAMILY", "FINER_NODES"),
            *("FINER", "FINER_IN_FOLDS", "COMPANY", "FINER_ITERATIONS", "CLEARING", "CLEAR"),
        ),
        "solve.edit_rows": (
            *("PRESERVE_WEIGHT", "AROUND_WEIGHT", "SLOPE_WEIGHT", "NORMAL_BIAS", "NEAR"),
            *("STEEPEST", "TRIES", "MORE", "BEYOND", "CREASED", "NEAREST_SAMPLES", "FARTHEST"),
        ),
        "solve.spline_system": ("DAMPING", "LEAST_TOUCHED", "ITERATIONS", "CONVERGED"),
        "projection": ("ARRIVED", "ON_SURFACE"),
        "problem.problem": ("THINNED", "INNER", "MOST_STRETCH"),
        "problem.copies": ("STEP", "BEND"),
        "problem.fold": (
            *("WRONG_SIDE", "CLOSE", "FACING", "BESIDE", "NEAR_CROSSING", "CLIFF"),
            "ACCURACY_SCALE",
        ),
        "problem.folded": ("FINE_EDGE", "CUT", "SHORTEST", "MOST_VERTICES", "MOST_CUT"),
        "mesh.pieces": ("MATCHED", "LEAST", "CRUMB"),
        "edit.edit": ("REPAIRS",),
    },
    ratios=RATIOS,
    highest=("tube_p95",),
    sums=("met", "pieces"),
)
