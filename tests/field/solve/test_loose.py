# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose parts, against the closed form of one spline in a ball and beside it, and what a stroke
leaves of them."""

import numpy as np
import pytest
from scipy import ndimage

from neural_sculpt_addon.common.progress import go_on
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import (
    Level,
    cells_of,
    centres,
    children,
    dilated,
    distinct,
    linear,
    places,
    spacing,
)
from neural_sculpt_addon.field.mesh.pieces import Islands
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.solve.loose import loose_parts
from neural_sculpt_addon.field.threads import join
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball

LEVEL = 5
NONE = Samples(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32))


def spline(t):
    """The quadratic B-spline over three cells."""
    t = np.abs(t)
    return np.where(t < 0.5, 0.75 - t**2, np.where(t < 1.5, (1.5 - t) ** 2 / 2, 0))


def loose(field, cells, level=LEVEL + 1, held=NONE):
    """Loose parts of all levels together."""
    return join(
        [
            Islands(np.zeros((0, 3), np.float32), np.zeros(0, np.float32)),
            *loose_parts(field, cells, level, lambda: held, go_on, cells).values(),
        ]
    )


def with_spot(away, height):
    """A ball with one spline at a distance from its middle, and cells around that."""
    node = linear(cells_of(np.array([[away, 0.01, 0.01]]), LEVEL), LEVEL)
    spot = {LEVEL: Level(node, np.float32([height]))}
    around = dilated(dilated(node, LEVEL), LEVEL)
    return ball(0.5).plus(spot), centres(places(node, LEVEL), LEVEL)[0], children(around, LEVEL)


@pytest.mark.parametrize(("away", "height"), [(0.25, 1.0), (0.8, -1.5)])
def test_a_hollow_and_a_crumb_are_found(away, height):
    """Where (|x|^2 - 1/4) + c B((x - x_i) / h) has the other sign than the ball."""
    field, node, cells = with_spot(away, height)
    middles = centres(places(cells, LEVEL + 1), LEVEL + 1).astype(float)
    before = (middles**2).sum(axis=1) - 0.25
    added = height * spline((middles - node) / spacing(LEVEL)).prod(axis=1)
    turned = before * (before + added) < 0
    assert turned.sum() >= 8
    found = loose(field, cells)
    np.testing.assert_allclose(found.points, middles[turned], atol=1e-6)
    np.testing.assert_allclose(found.distance, np.sign(before[turned]) * spacing(LEVEL + 2))


def test_a_crumb_among_cells_that_the_surface_does_not_pass():
    """Two splines: a dip of f beside the ball to just above 0, and in its middle a finer one, the
    crumb. Already in the cells beside it f is more than the length of a cell."""
    node = linear(cells_of(np.array([[0.52, 0.01, 0.01]]), LEVEL), LEVEL)
    middle = centres(places(node, LEVEL), LEVEL)[0].astype(float)
    fine = linear(cells_of((middle + 1e-3)[None], LEVEL + 2), LEVEL + 2)
    crumb = centres(places(fine, LEVEL + 2), LEVEL + 2)[0].astype(float)
    deep = (0.01 - ((middle**2).sum() - 0.25)) / spline(0) ** 3
    spot = {LEVEL: Level(node, np.float32([deep])), LEVEL + 2: Level(fine, np.float32([-0.08]))}
    around = dilated(dilated(node, LEVEL), LEVEL)
    found = loose(ball(0.5).plus(spot), around, LEVEL)
    finest = children(children(around, LEVEL), LEVEL + 1)
    points = centres(places(finest, LEVEL + 2), LEVEL + 2)
    f = (points.astype(float) ** 2).sum(axis=1) - 0.25
    f += deep * spline((points - middle) / spacing(LEVEL)).prod(axis=1)
    added = 0.08 * spline((points - crumb) / spacing(LEVEL + 2)).prod(axis=1)
    turned = (f > 0) & (f < added)
    assert turned.any()
    np.testing.assert_allclose(found.points, points[turned], atol=1e-6)


def test_parts_of_two_sizes_are_found_at_once():
    """A hollow in the ball, and a crumb close to its surface that only finer cells show."""
    spots = np.array([[0.25, 0.01, 0.01], [0.001, 0.001, 0.512]])
    node = linear(cells_of(spots[:1], LEVEL), LEVEL)
    fine = linear(cells_of(spots[1:], LEVEL + 2), LEVEL + 2)
    field = ball(0.5).plus(
        {LEVEL: Level(node, np.float32([1])), LEVEL + 2: Level(fine, np.float32([-0.05]))}
    )
    around = dilated(dilated(distinct(cells_of(spots, LEVEL), LEVEL), LEVEL), LEVEL)
    found = loose_parts(field, around, LEVEL, lambda: NONE, go_on, around)
    assert (found[LEVEL].distance < 0).all()
    hollow = centres(places(node, LEVEL), LEVEL)
    assert np.abs(found[LEVEL].points - hollow).max() < 2 * spacing(LEVEL)
    assert (found[LEVEL + 2].distance > 0).any()
    crumb = centres(places(fine, LEVEL + 2), LEVEL + 2)
    near = found[LEVEL + 2].points[found[LEVEL + 2].distance > 0]
    assert np.abs(near - crumb).max() < 2 * spacing(LEVEL + 2)


def test_what_goes_on_beyond_the_cells_is_not_loose():
    """A dent in the surface, and half of a hollow."""
    field, _, cells = with_spot(0.5, 1.0)
    assert not len(loose(field, cells).points)
    field, node, cells = with_spot(0.25, 1.0)
    half = cells[centres(places(cells, LEVEL + 1), LEVEL + 1)[:, 0] < node[0]]
    assert not len(loose(field, half).points)


def test_a_part_with_untouched_surface_is_not_loose():
    """A sample of the wall of the hollow, whose outside is the hollow's inside."""
    field, _, cells = with_spot(0.25, 1.0)
    hollow = loose(field, cells).points
    top = hollow[hollow[:, 2].argmax()]
    wall = Samples(top[None] + np.float32([[0, 0, spacing(LEVEL + 2)]]), np.float32([[0, 0, -1]]))
    assert not len(loose(field, cells, held=wall).points)


def test_where_nothing_is_looked_at_nothing_is_loose():
    """As near a fold that samples show and the mesh does not."""
    assert (
        loose_parts(ball(0.5), np.empty(0, np.int32), LEVEL, lambda: NONE, go_on, np.empty(0, int))
        == {}
    )


STEEP = np.array(
    [
        [-0.598, -0.04, -0.015],
        [-0.599, -0.023, -0.035],
        [-0.598, -0.001, -0.048],
        [-0.597, 0.024, -0.052],
        [-0.596, 0.049, -0.048],
        [-0.595, 0.072, -0.035],
        [-0.593, 0.088, -0.016],
        [-0.592, 0.097, 0.008],
    ]
)


def test_a_steep_crest_leaves_no_bubble_beside_it():
    """2.3 radii high, over a hand's crooked line on a sphere: what is inside hangs
    together, and what is outside, as a lattice of 2e-3 sees them. Three parts were outside."""
    linear = Profile(points=((-1, 0), (0, 1), (1, 0)))
    field = sculpt(prepare(primitive("sphere")), Stroke(STEEP, Brush(0.03, 0.069, linear))).field
    axes = map(np.arange, STEEP.min(axis=0) - 0.1, STEEP.max(axis=0) + 0.1, (2e-3,) * 3)
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).astype(np.float32)
    inside = values(field, lattice.reshape(-1, 3)).reshape(lattice.shape[:3]) < 0
    assert (ndimage.label(inside)[1], ndimage.label(~inside)[1]) == (1, 1)
