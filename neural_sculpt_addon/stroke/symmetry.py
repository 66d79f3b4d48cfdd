# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetry: where a stroke is repeated, as Blender's Sculpt Mode repeats a brush.

Each reflection across the mirror planes, and each of these turned about one of the axes: turns
about different axes are not chained. Model space.
"""

from collections.abc import Iterable
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Counts = tuple[int, int, int]

AXES = "XYZ"
ONCE: Counts = (1, 1, 1)
MOST_TURNS = 64  # about one axis, as Blender has it


@lru_cache
def images(mirror: frozenset[str], radial: Counts = ONCE) -> Array:
    """Orthogonal matrices (M, 3, 3), each once, the identity first: x' = image @ x.

    mirror: the axes across whose planes (x = 0, ...) there are reflections
    radial: how many times a whole turn about the axes X, Y and Z brings what is turned back
    """
    found = np.array(
        [turned for flip in _reflections(mirror) for turned in _turned(flip, radial)]
    )  # (N, 3, 3)
    _, first = np.unique(found.round(9).reshape(-1, 9), axis=0, return_index=True)
    distinct = found[np.sort(first)]
    distinct.flags.writeable = False  # it is kept
    return distinct


def _reflections(mirror: frozenset[str]) -> Iterable[Array]:
    axes = sorted(mirror)
    for chosen in (c for size in range(len(axes) + 1) for c in combinations(axes, size)):
        yield np.diag([-1.0 if axis in chosen else 1.0 for axis in AXES])


def _turned(flip: Array, radial: Counts) -> Iterable[Array]:
    yield flip
    for axis, count in enumerate(radial):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for angle in 2 * np.pi * np.arange(1, count) / count:
            turn = np.eye(3)
            turn[[b, c, b, c], [b, c, c, b]] = (
                *(np.cos(angle), np.cos(angle)),
                *(-np.sin(angle), np.sin(angle)),
            )
            yield turn.round(15) @ flip + 0.0  # quarter turns are exact, and no zero is negative
