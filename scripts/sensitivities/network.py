# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes by the solver on the network's weights (docs/method.md, section 10).

The networks have learned the shapes of the packed ones, and are as large as those of artists.
"""

from functools import cache, partial

from make_test_networks import SHAPES

from neural_sculpt_addon.field.edit.edit import Solver, sculpt
from neural_sculpt_addon.field.fit.fit import Quality, fit_mesh
from neural_sculpt_addon.field.problem.prepare import Preparation, prepare
from neural_sculpt_addon.stroke.stroke import Stroke

from .strokes import drawn, measured
from .subject import Case, Made, Subject, array_bits

DEEP = 0.1  # model units
RATIOS = ("tube_mean", "tube_p95", "normal_deg", "rim_mean", "drift_mean", "drift_p99")


@cache
def fitted(shape: str) -> Preparation:
    """The field of a network of usual width, ready for strokes."""
    return prepare(fit_mesh(*SHAPES[shape](), preset=Quality.DRAFT, detail=False).field)


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Strokes of any brush."""
    names = list(SHAPES)
    ready = [fitted(names[number % len(names)]) for number in range(count)]
    strokes = [drawn(on, seed, number, more, DEEP) for number, on in enumerate(ready)]
    return [partial(_solved, on, stroke) for on, stroke in zip(ready, strokes, strict=True)]


def _solved(on: Preparation, stroke: Stroke) -> Made:
    edit = sculpt(on, stroke, solver=Solver.NETWORK)
    weights = array_bits(*(tensor.numpy() for tensor in edit.field.network.parameters))
    return Made(weights, partial(measured, edit, RATIOS))


SUBJECT = Subject(
    cases=cases,
    count=5,
    constants={
        "solve.residuals": (
            *("TUBE", "SLOPE", "COPIES", "PRESERVE_ROWS", "AROUND_ROWS", "BOX_ROWS"),
            *("PRESERVE_WEIGHT", "AROUND_WEIGHT", "BOX_WEIGHT", "SLOPE_WEIGHT", "RIM_SHARE"),
            *("RIM_REACH", "SHELL_FROM", "BOX_FROM", "COLUMN"),
        ),
        "solve.gauss_newton": (
            "STEPS",
            "ITERATIONS",
            "LEAST_DAMPING",
            "MOST_DAMPING",
            "STEP_HALVINGS",
        ),
        "solve.least_squares": ("RIDGE",),
        "solve.unknowns": ("INPUTS",),
    },
    ratios=RATIOS,
    highest=("tube_p95",),
    sums=("met", "pieces"),
)
