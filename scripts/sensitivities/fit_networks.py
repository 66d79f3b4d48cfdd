# SPDX-License-Identifier: GPL-3.0-or-later
"""The network beneath a fit's detail (docs/method.md, section 5): what it learns from, how long.

It is measured by itself, and by the detail that it then leaves to be fitted.
"""

from functools import partial

import numpy as np

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.fit.fit import TOLERANCES, Quality
from neural_sculpt_addon.field.fit.fit_detail import refine

from . import fits
from .shapes import SHAPES
from .subject import Case, Made, Subject, array_bits

RATIOS = (*fits.ERRORS, "coefficients", "detailed_error")


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Meshes, with random samples of the seed."""
    names = list(SHAPES)
    numbers = ((names[number % len(names)], seed + 100 * number + more) for number in range(count))
    return [partial(_learned, name, number) for name, number in numbers]


def _learned(name: str, seed: int) -> Made:
    wanted = fits.target(name)
    field = fits.learn(wanted.distance, seed)
    bits = array_bits(*(tensor.numpy() for tensor in field.network.parameters))
    return Made(bits, partial(_measured, field, wanted, seed))


def _measured(field: Field, wanted: fits.Target, seed: int) -> dict[str, float]:
    rng, tolerance = np.random.default_rng(seed), TOLERANCES[Quality.DRAFT]
    detailed = fits.measured(refine(field, wanted.distance, tolerance, rng), wanted)
    return {
        **fits.measured(field, wanted),
        "coefficients": detailed["coefficients"],
        "detailed_error": detailed["error_mean"],
    }


SUBJECT = Subject(
    cases=cases,
    count=3,
    constants={
        "fit.fit": (
            *(f"BENEATH_DETAIL.{part}" for part in ("steps", "batch", "samples", "rate", "omega")),
            "OMEGA",
        ),
        "fit.fit_distance": (
            *("NEAR_DEVIATION", "AROUND_DEVIATION", "NEAR_SHARE", "AROUND_SHARE", "SAMPLED_BOX"),
            *("SOFTNESS", "GRADIENT_WEIGHT"),
        ),
    },
    ratios=RATIOS,
    sums=("wrong_sides", "pieces"),
)
