# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pieces and hollows, as random coefficients of one level make them: those that a dense
lattice of the level's cells sees are in the refined mesh of that resolution, which exports write.
"""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import (
    Level,
    block,
    cells_of,
    centres,
    linear,
    quantised,
    spacing,
)
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.mesh.refinement.refine import refine
from tests.field.analytic import ball

COUNT = 40
APART = 12  # cells of the level between middles, and from the ball that all fields have
REACH = 4  # cells of the level around a middle, beyond which the ball is as it was
SIZES = 0.2, 2.0  # cells: the radii of the pieces


def with_pieces(field, level, radius, sign, random):
    """The field of a ball with balls beside it (sign 1) or hollows within (-1), and their middles.

    Each is a bump of the level's splines that takes f through zero within its radius, roughly.
    """
    h, middles = spacing(level), np.empty((0, 3))
    while len(middles) < COUNT:
        place = random.uniform(-0.9, 0.9, 3)
        off = sign * (np.linalg.norm(place) - radius)
        if off > APART * h and np.linalg.norm(middles - place, axis=1).min(initial=1) > APART * h:
            middles = np.concatenate([middles, place[None]])
    index, coefficients = [], []
    for middle in middles:
        nodes = (cells_of(middle[None], level) + block(-2, 3)).astype(np.int32)
        away = np.linalg.norm(centres(nodes, level) - middle, axis=1) / h
        size, height = random.uniform(*SIZES), values(field, middle[None])[0]
        bump = np.maximum(1 - (away / (size + 1)) ** 2, 0) * random.uniform(1.2, 4)
        index.append(linear(nodes, level))
        coefficients.append(quantised(-height * bump))
    order = np.argsort(index := np.concatenate(index))
    return field.plus({level: Level(index[order], np.concatenate(coefficients)[order])}), middles


def seen(field, middles, level, sign):
    """Which pieces have a point of the lattice within."""
    cells = 2 ** (level + 1)
    first = np.floor((middles + 1) * cells / 2).astype(int) - REACH
    place = first[:, None] + np.indices((2 * REACH + 2,) * 3).reshape(3, -1).T
    value = values(field, (place * 2 / cells - 1).reshape(-1, 3)).reshape(len(middles), -1)
    return (sign * value < 0).any(axis=1)


def check(level, sign, seed):
    random, radius = np.random.default_rng(seed), 0.4 if sign > 0 else 0.8
    field, middles = with_pieces(ball(radius), level, radius, sign, random)
    expected = seen(field, middles, level, sign)
    assert 0.2 * COUNT < expected.sum() < COUNT  # else it would say little
    mesh = refine(field, extract(field, 2 ** (level + 1)), 10**7)
    reach = np.sqrt(3) * REACH * spacing(level)
    off = np.abs(np.linalg.norm(mesh.vertices, axis=1) - radius)
    small = mesh.vertices[off > APART / 2 * spacing(level)]
    away, piece = KDTree(middles).query(small)
    assert away.max() < reach  # nothing else
    np.testing.assert_array_equal(np.isin(np.arange(COUNT), piece), expected)
    assert trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).is_watertight


@pytest.mark.parametrize("sign", [1, -1], ids=["pieces", "hollows"])
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_what_a_dense_lattice_of_the_finest_cells_sees_is_in_the_refined_mesh(sign, seed):
    check(6, sign, seed)


@pytest.mark.long
@pytest.mark.parametrize("level", [7, 8])
@pytest.mark.parametrize("sign", [1, -1], ids=["pieces", "hollows"])
def test_so_do_finer_ones(level, sign):
    check(level, sign, level)
