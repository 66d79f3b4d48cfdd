# SPDX-License-Identifier: GPL-3.0-or-later
"""A subject of measurement: its cases, its constants, its measures."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from neural_sculpt_addon.field.levels import Coefficients


class Made(NamedTuple):
    """What came of a case.

    bits:    what tells it from all that is otherwise
    measure: how good it is; asked once the constants have their usual values again
    """

    bits: bytes
    measure: Callable[[], dict[str, float]]


Case = Callable[[], Made]
"""Something that is done with the constants as they are when it is called. SculptError refuses."""


@dataclass(frozen=True)
class Subject:
    """What is measured, and by what.

    cases:     so many of a seed, prepared; with `more`, the same ones with other random samples
    count:     how many cases are usual
    constants: of each module within neural_sculpt_addon.field, in the order of the table
    ratios:    measures that are told as the geometric mean of their ratio to the usual one
    highest:   measures of which the highest is told, in 1e-3
    sums:      measures that are added up
    """

    cases: Callable[[int, int, int], list[Case]]
    count: int
    constants: Mapping[str, Sequence[str]]
    ratios: Sequence[str]
    highest: Sequence[str] = ()
    sums: Sequence[str] = ()

    @property
    def names(self) -> list[str]:
        """Its constants, as `solve.local.GAP`."""
        return [f"{module}.{name}" for module, names in self.constants.items() for name in names]


def layer_bits(layer: Coefficients) -> bytes:
    """What tells layers apart."""
    return array_bits(
        *(part for level in sorted(layer) for part in (layer[level].index, layer[level].values))
    )


def array_bits(*arrays: NDArray[np.generic]) -> bytes:
    """What tells arrays apart."""
    total = hashlib.sha256()
    for array in arrays:
        total.update(np.ascontiguousarray(array).tobytes())
    return total.digest()
