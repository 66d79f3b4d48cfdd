# SPDX-License-Identifier: GPL-3.0-or-later
"""The detail of a fit (docs/method.md, section 5).

Each case begins with the same network, which has learned with the constants as they are.
"""

from functools import partial

import numpy as np

from neural_sculpt_addon.field.fit.fit import TOLERANCES, Quality
from neural_sculpt_addon.field.fit.fit_detail import refine
from neural_sculpt_addon.field.fit.fit_repair import repaired

from . import fits
from .shapes import SHAPES
from .subject import Case, Made, Subject, layer_bits

PRESET = TOLERANCES[Quality.DRAFT]


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Meshes, with random samples of the seed."""
    names = list(SHAPES)
    some = [(names[number % len(names)], seed + 100 * number) for number in range(count)]
    for name, number in some:
        fits.learned(name, number)
    return [partial(_detailed, name, number, more) for name, number in some]


def _detailed(name: str, seed: int, more: int) -> Made:
    wanted, rng = fits.target(name), np.random.default_rng([seed, more])
    field = refine(fits.learned(name, seed), wanted.distance, PRESET, rng)
    field = repaired(field, wanted.distance, 4 * 2**PRESET.finest, rng).field
    return Made(layer_bits(field.detail.coefficients), partial(fits.measured, field, wanted))


SUBJECT = Subject(
    cases=cases,
    count=3,
    constants={
        "fit.fit_detail": (
            *("FIT_COARSEST", "MISSED_SHARE", "DENSITY", "PROBE_DENSITY", "SIDE_DENSITY"),
            *("SIDE_FROM", "SIDE_TO", "SIDE_WEIGHT", "EMPTY_WEIGHT", "SLOPE_WEIGHT", "MISS_SHARE"),
            *("DOUBTED_SAMPLES", "BELIEVED", "NO_BOUND", "DOUBTED", "ROW_REACH"),
            *("SIDE_CLEARANCE", "HEAVIER", "HEAVIER_RINGS", "GROSS", "ITERATIONS", "DAMPED"),
            "LEFT_OUT",
        ),
    },
    ratios=(*fits.ERRORS, "coefficients"),
    sums=("wrong_sides", "pieces"),
)
