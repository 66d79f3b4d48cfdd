# SPDX-License-Identifier: GPL-3.0-or-later
"""What takes strays of fits away (docs/method.md, section 5).

Networks as they are leave hardly any. So these are rougher: one whose first layer has twice the
`omega` has surface in many places where the mesh has none. Detail is fitted to it as ever.
"""

from dataclasses import replace
from functools import cache, partial

import numpy as np

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.fit import fit
from neural_sculpt_addon.field.fit.fit_detail import refine
from neural_sculpt_addon.field.fit.fit_repair import Repaired, repaired

from . import fits
from .shapes import SHAPES
from .subject import Case, Made, Subject, layer_bits

PRESET = fit.TOLERANCES[fit.Quality.DRAFT]
ROUGH = replace(fit.BENEATH_DETAIL, omega=2 * fit.BENEATH_DETAIL.omega)


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Fields with strays, and random places of the seed."""
    names = list(reversed(SHAPES))  # those with the fewest strays first
    some = [(names[number % len(names)], seed + 100 * number) for number in range(count)]
    for name, number in some:
        strayed(name, number)
    return [partial(_repaired, name, number, more) for name, number in some]


@cache
def strayed(name: str, seed: int) -> Field:
    """A field that has strays of the mesh of that name in `shapes.SHAPES`."""
    distance = fits.target(name).distance
    network = fits.learn(distance, seed, ROUGH)
    return refine(network, distance, PRESET, np.random.default_rng(seed))


def _repaired(name: str, seed: int, more: int) -> Made:
    wanted, rng = fits.target(name), np.random.default_rng([seed, more])
    found = repaired(strayed(name, seed), wanted.distance, 4 * 2**PRESET.finest, rng)
    bits = layer_bits(found.field.detail.coefficients)
    return Made(bits, partial(_measured, found, wanted))


def _measured(found: Repaired, wanted: fits.Target) -> dict[str, float]:
    return {**fits.measured(found.field, wanted), "left": len(found.left.points)}


SUBJECT = Subject(
    cases=cases,
    count=3,
    constants={
        "fit.strays": (
            *("NEAR_MESH", "NO_PIECE", "FACING_ALIKE", "ASKED", "ASKED_OF_PIECE", "HIDDEN_LEVEL"),
            *("HIDDEN_RINGS", "HIDDEN_LOW", "LARGE_COEFFICIENT", "ON_ITS_SIDE"),
            *("PLACES_IN_BALL", "WRONG_SHARE", "TINY"),
        ),
        "fit.fit_repair": (
            *("REPAIR_COARSEST", "REPAIR_FINEST", "CELLS_TO_STRAY", "SPLINE_REACH"),
            *("ROWS_PER_CELL", "MOST_WRONG_CELLS", "REPAIRED_CELLS", "ROUNDS", "LOOKED"),
            *("FEW_STRAYS", "HELPED"),
        ),
    },
    ratios=(*fits.ERRORS, "coefficients"),
    sums=("wrong_sides", "pieces", "left"),
)
