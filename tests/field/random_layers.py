# SPDX-License-Identifier: GPL-3.0-or-later
"""Coefficients that no solver made: any levels, any nodes, any values."""

import numpy as np
from hypothesis import strategies as st

from neural_sculpt_addon.field.levels import COARSEST, FINEST, Level, cells_per_axis, linear

UNIT = 2.0**-22


def random_layer(seed, count=200, levels=(5, 6, 7)):
    """Nodes near each other around a random place."""
    random = np.random.default_rng(seed)
    layer = {}
    for level in levels:
        middle = random.integers(20, cells_per_axis(level) - 20, 3)
        cells = np.unique(middle + random.integers(-9, 10, (count, 3)), axis=0).astype(np.int32)
        units = random.integers(-(2**16), 2**16, len(cells))
        layer[level] = Level(linear(cells, level), (units * UNIT).astype(np.float32))
    return layer


@st.composite
def layers(draw):
    """Coefficients with up to 30 nodes on each level, at the grid's border and of any size, too."""
    layer = {}
    for level in sorted(draw(st.sets(st.integers(COARSEST, FINEST), max_size=4))):
        place = st.integers(1, cells_per_axis(level) - 2)
        cells = draw(st.lists(st.tuples(place, place, place), min_size=1, max_size=30, unique=True))
        index = np.sort(linear(np.array(cells, np.int32), level))
        unit = st.integers(-(2**23), 2**23)
        units = draw(st.lists(unit, min_size=len(index), max_size=len(index)))
        layer[level] = Level(index, (np.array(units) * UNIT).astype(np.float32))
    return layer


def same(a, b):
    """Whether two layers are alike to the bit."""
    return a.keys() == b.keys() and all(
        np.array_equal(a[k].index, b[k].index) and np.array_equal(a[k].values, b[k].values)
        for k in a
    )
