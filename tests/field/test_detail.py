# SPDX-License-Identifier: GPL-3.0-or-later
"""Detail against SciPy's B-splines, sums of layers against whole numbers, supports by intervals."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from neural_sculpt_addon.field.detail import Detail
from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import (
    COARSEST,
    FINEST,
    LARGEST,
    MARGIN,
    SUPPORT,
    UNIT,
    Level,
    cells_of,
    cells_per_axis,
    centres,
    children,
    dilated,
    linear,
    merged,
    places,
    quantised,
    scaled,
    spacing,
    support,
)
from neural_sculpt_addon.field.network import Siren
from tests.field.splines import basis, nodes

LEVELS = range(COARSEST, FINEST + 1)
FRACTION = 2.0**-17  # of places: float32 holds them and their offsets in cells exactly
seeds = st.integers(0, 2**32 - 1)


@st.composite
def coefficients(draw, levels=LEVELS):
    """Some nodes on some levels, about corners of bricks, the faces of the box and of the grid."""
    chosen = draw(st.sets(st.sampled_from(levels), min_size=1, max_size=3))
    random = np.random.default_rng(draw(seeds))
    result = {}
    for level in sorted(chosen):
        last = cells_per_axis(level) - 2  # the outermost cells have no nodes
        some = (1, MARGIN, 2 * MARGIN, last // 2 + 1, last - MARGIN + 1, last)
        middle = draw(st.tuples(*[st.sampled_from(some)] * 3))
        cells = random.integers(-4, 4, (draw(st.integers(1, 60)), 3)) + middle
        index = np.unique(linear(np.clip(cells, 1, last).astype(np.int32), level))
        result[level] = Level(index, quantised(random.normal(0, 0.1, len(index))))
    return result


def points_about(terms, seed, count=300):
    """Points within and beside the supports, some on the faces of cells, and some anywhere."""
    random = np.random.default_rng(seed)
    clouds = [random.uniform(-1.1, 1.1, (count, 3))]
    for level, part in terms.items():
        start = nodes(random.choice(part.index, count), level)
        away = 2.5 * spacing(level) * random.uniform(-1, 1, (count, 3))
        away[::4] = spacing(level) / 2 * np.round(2 * away[::4] / spacing(level))
        clouds.append(start + away)
    return (np.round(np.concatenate(clouds) / FRACTION) * FRACTION).astype(np.float32)


def by_scipy(terms, points):
    """The detail and its gradient in double precision."""
    value, gradient = np.zeros(len(points)), np.zeros((len(points), 3))
    for level, part in terms.items():
        splines, slopes = basis(points, part.index, level)
        value += splines @ part.values
        gradient += np.einsum("nka,k->na", slopes, part.values)
    return value, gradient


def by_detail(detail, points):
    """The same by the detail, with the value alone, too."""
    x = torch.from_numpy(points)
    alone, value, gradient = torch.zeros(len(x)), torch.zeros(len(x)), torch.zeros(len(x), 3)
    detail.add_value(x, alone)
    detail.add_value_and_gradient(x, value, gradient)
    return alone.numpy(), value.numpy(), gradient.numpy()


def same(first, second):
    """Whether coefficients are the same to the bit."""
    return first.keys() == second.keys() and all(
        np.array_equal(first[k].index, second[k].index)
        and np.array_equal(first[k].values, second[k].values)
        for k in first
    )


@settings(max_examples=30)
@given(coefficients(), seeds)
def test_values_and_gradients_are_those_of_scipy(terms, seed):
    points = points_about(terms, seed)
    value, gradient = by_scipy(terms, points)
    alone, found, slopes = by_detail(Detail.of(terms), points)
    np.testing.assert_allclose(alone, value, atol=3e-7)
    np.testing.assert_allclose(found, value, atol=3e-7)
    np.testing.assert_allclose(slopes, gradient, atol=1e-6 / spacing(max(terms)))


@settings(max_examples=20)
@given(coefficients(), seeds)
def test_a_field_is_its_network_outside_of_every_support(terms, seed):
    """To the bit; a spline ends 1.5 cells from its node."""
    points = points_about(terms, seed)
    outside = np.ones(len(points), bool)
    for level, part in terms.items():
        away = np.abs(points[:, None] - nodes(part.index, level)).max(axis=2)
        outside &= (away >= 1.5 * spacing(level)).all(axis=1)
    field = Field(Siren.random((16, 16), 10.0, torch.Generator().manual_seed(seed)))
    before, after = (values_and_gradients(one, points) for one in (field, field.plus(terms)))
    assert outside.any() and not outside.all()
    np.testing.assert_array_equal(after[0][outside], before[0][outside])
    np.testing.assert_array_equal(after[1][outside], before[1][outside])
    np.testing.assert_array_equal(
        values(field.plus(terms), points)[outside], values(field, points)[outside]
    )
    value, gradient = by_scipy(terms, points)
    np.testing.assert_allclose(after[0] - before[0], value, atol=3e-6)
    np.testing.assert_allclose(
        after[1] - before[1], gradient, atol=2e-5 + 1e-6 / spacing(max(terms))
    )


@settings(max_examples=20)
@given(
    st.lists(coefficients((2, 5, 7)), min_size=2, max_size=5),
    st.randoms(use_true_random=False),
    seeds,
)
def test_sums_are_exact_in_any_order_and_leave_no_trace(terms, random, seed):
    totals = {}
    for layer in terms:
        for level, part in layer.items():
            for index, value in zip(part.index.tolist(), part.values.tolist(), strict=True):
                key = level, index
                totals[key] = totals.get(key, 0) + round(value / UNIT)
    whole = Detail.of(*terms)
    found = {
        (level, index): round(value / UNIT)
        for level, part in whole.coefficients.items()
        for index, value in zip(part.index.tolist(), part.values.tolist(), strict=True)
    }
    assert found == {key: value for key, value in totals.items() if value}
    shuffled = random.sample(terms, len(terms))
    points = points_about(terms[0], seed, 50)
    other = Detail.of(*shuffled)
    assert same(other.coefficients, whole.coefficients)
    for mine, theirs in zip(by_detail(other, points), by_detail(whole, points), strict=True):
        np.testing.assert_array_equal(mine, theirs)
    *rest, last = shuffled
    without = other.plus(last, -1)
    assert same(without.coefficients, Detail.of(*rest).coefficients)
    for mine, theirs in zip(
        by_detail(without, points), by_detail(Detail.of(*rest), points), strict=True
    ):
        np.testing.assert_array_equal(mine, theirs)
    for layer in rest:
        without = without.plus(layer, -1)
    assert not without.coefficients
    assert not any(part.any() for part in by_detail(without, points))


@settings(max_examples=20)
@given(coefficients())
def test_coefficients_go_in_and_come_out(terms):
    """But zeros, which are not stored."""
    zero = {level: Level(part.index, 0 * part.values) for level, part in terms.items()}
    left = {k: Level(p.index[p.values != 0], p.values[p.values != 0]) for k, p in terms.items()}
    left = {level: part for level, part in left.items() if len(part.index)}
    assert same(Detail.of(terms, zero).coefficients, left)
    assert not Detail.of(zero).coefficients
    assert Detail.of(terms).levels == tuple(sorted(terms))


@settings(max_examples=30)
@given(coefficients())
def test_a_support_is_all_cells_that_a_spline_meets(terms):
    edge, count = spacing(SUPPORT), cells_per_axis(SUPPORT)
    low = (np.arange(count) - MARGIN) * edge - 1
    met = np.zeros((count,) * 3, bool)
    for level, part in terms.items():
        for x, y, z in nodes(part.index, level):
            reach = 1.5 * spacing(level)
            touched = [(low < a + reach) & (low + edge > a - reach) for a in (x, y, z)]
            met[np.ix_(*touched)] = True
    np.testing.assert_array_equal(support(terms), np.flatnonzero(met))


def test_no_coefficients_reach_nowhere():
    assert len(support({})) == 0
    assert Detail().coefficients == {} and Detail().levels == ()


@pytest.mark.parametrize("level", LEVELS)
def test_cells_their_numbers_and_middles_belong_together(level):
    random = np.random.default_rng(level)
    cells = random.integers(0, cells_per_axis(level), (500, 3)).astype(np.int32)
    index = linear(cells, level)
    np.testing.assert_array_equal(
        index, np.ravel_multi_index(cells.T, (cells_per_axis(level),) * 3)
    )
    np.testing.assert_array_equal(places(index, level), cells)
    np.testing.assert_array_equal(centres(cells, level), nodes(index, level))
    inside = centres(cells, level) + 0.49 * spacing(level) * random.uniform(-1, 1, cells.shape)
    np.testing.assert_array_equal(cells_of(inside, level), cells)
    assert cells_of(np.array([[-1.0, -1.0, -1.0]]), level).tolist() == [[MARGIN] * 3]


def grid_of(index, level):
    """Which cells (n, n, n) of a level have the numbers `index`."""
    grid = np.zeros((cells_per_axis(level),) * 3, bool)
    grid.reshape(-1)[index] = True
    return grid


@pytest.mark.parametrize("count", [0, 1, 30, 2000])
def test_dilated_cells_are_all_that_touch_them_but_the_edge_of_the_grid(count):
    size = cells_per_axis(COARSEST) ** 3
    index = np.flatnonzero(np.random.default_rng(count).permutation(size) < count).astype(np.int32)
    wanted = ndimage.binary_dilation(grid_of(index, COARSEST), np.ones((3, 3, 3)))
    inner = np.pad(np.ones((cells_per_axis(COARSEST) - 2,) * 3, bool), 1)
    found = dilated(index, COARSEST)
    assert found.dtype == np.int32
    np.testing.assert_array_equal(found, np.flatnonzero(wanted & inner))


@pytest.mark.parametrize("count", [0, 1, 30, 2000])
def test_children_are_the_cells_whose_middles_lie_in_their_parents(count):
    size, finer = cells_per_axis(COARSEST), COARSEST + 1
    index = np.flatnonzero(np.random.default_rng(count).permutation(size**3) < count)
    within = np.indices((cells_per_axis(finer) - 2,) * 3).reshape(3, -1).T.astype(np.int32) + 1
    parents = linear(cells_of(centres(within, finer), COARSEST), COARSEST)
    found = children(index.astype(np.int32), COARSEST)
    np.testing.assert_array_equal(found, linear(within, finer)[np.isin(parents, index)])


@given(st.lists(st.lists(st.integers(-3, 12), max_size=8), max_size=4))
def test_merged_runs_have_each_number_once(runs):
    together = np.array([number for run in runs for number in sorted(run)], np.int32)
    assert merged(together).tolist() == sorted(set(together.tolist()))


@given(st.lists(st.floats(-3, 3, width=32), min_size=1, max_size=20))
def test_quantised_values_are_the_nearest_multiples(numbers):
    found = quantised(np.array(numbers))
    assert found.dtype == np.float32
    units = found.astype(float) / UNIT
    np.testing.assert_array_equal(units, np.round(units))
    np.testing.assert_allclose(found, np.clip(numbers, -LARGEST, LARGEST), atol=UNIT / 2, rtol=0)


@settings(max_examples=20)
@given(coefficients((3, 6, 8)), st.floats(0, 1))
def test_a_strength_scales_all_coefficients(terms, strength):
    found = scaled(terms, strength)
    assert found.keys() == terms.keys()
    for level, part in found.items():
        np.testing.assert_array_equal(part.index, terms[level].index)
        np.testing.assert_allclose(
            part.values, strength * terms[level].values, atol=0.51 * UNIT, rtol=0
        )
        np.testing.assert_array_equal(part.values, quantised(part.values))
    assert same(scaled(terms, 1.0), terms)
    assert not Detail.of(scaled(terms, 0.0)).coefficients


def test_what_is_taken_away_leaves_no_level():
    """Two of three nodes of level 6, in bricks of their own, and all of level 8."""
    corners = np.array([[20, 20, 20], [40, 40, 40], [60, 60, 60]], np.int32)
    ones = np.ones(3, np.float32)
    terms = {level: Level(linear(corners, level), ones) for level in (6, 8)}
    both = Detail.of(terms)
    some = {6: Level(terms[6].index[:2], ones[:2]), 8: terms[8]}
    assert both.plus(some, -1).levels == (6,)
    assert both.plus(some, -1).coefficients[6].index.tolist() == terms[6].index[2:].tolist()
    assert both.plus(terms, -1).levels == ()
    assert both.levels == both.plus(some, -1).plus(some).levels == (6, 8)


def test_the_finest_level_at_a_point_is_that_of_a_node_in_whose_cell_it_lies():
    """Nodes of three levels about one place, of which one is zero; beyond its cell none counts."""
    place = np.float32([[0.3, -0.2, 0.1]])
    terms = {}
    for level, value in (3, 0.5), (6, -0.25), (8, 0.0):
        index = linear(cells_of(place, level), level)
        terms[level] = Level(index, np.float32([value]))
    half = spacing(6) / 2
    middle = centres(cells_of(place, 6), 6)[0]
    steps = np.float32([0, 0.9, -0.9, 1.1, -1.1, 60])
    points = middle + half * steps[:, None] * np.float32([1, 0, 0])
    finest = Detail.of(terms).finest_at(points)
    assert finest.tolist() == [6, 6, 6, 3, 3, COARSEST - 1]
    assert Detail().finest_at(points).tolist() == [COARSEST - 1] * 6


def test_a_grid_says_where_its_nodes_reach():
    """A node reaches the 27 cells around its own; one whose coefficient is zero none."""
    level, random = 6, np.random.default_rng(4)
    cells = cells_of(random.uniform(-0.5, 0.5, (40, 3)), level)
    index = np.unique(linear(cells, level))
    units = np.where(np.arange(len(index)) % 3, 1.0, 0.0).astype(np.float32)
    (grid,) = Detail.of({level: Level(index, units)}).grids
    points = random.uniform(-1, 1, (20_000, 3)).astype(np.float32)
    points[::2] *= 0.5
    reaching = centres(places(index[units > 0], level), level)
    middles = centres(cells_of(points, level), level)
    away = np.abs(middles[:, None] - reaching).max(axis=2).min(axis=1)
    wanted = away < 1.5 * spacing(level)
    np.testing.assert_array_equal(grid.reaches(points), wanted)
    near = grid.has_brick(points)
    assert near[wanted].all() and not near.all()
    own = away < 0.5 * spacing(level)
    np.testing.assert_array_equal(grid.has_node(points), own)
    assert 0 < own.mean() < wanted.mean()
    beyond = np.float32([[5, 5, 5], [-5, 0, 0]])
    assert not grid.has_brick(beyond).any()
    assert 0.001 < wanted.mean() < 0.9
