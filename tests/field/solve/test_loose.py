# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose parts, against the closed form of one spline in a ball and beside it."""

import numpy as np
import pytest

from neural_sculpt_addon.common.progress import go_on
from neural_sculpt_addon.field.levels import (
    Level,
    cells_of,
    centres,
    children,
    dilated,
    linear,
    places,
    spacing,
)
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.solve.loose import loose_parts
from tests.field.analytic import ball

LEVEL = 5
NONE = Samples(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32))


def spline(t):
    """The quadratic B-spline over three cells."""
    t = np.abs(t)
    return np.where(t < 0.5, 0.75 - t**2, np.where(t < 1.5, (1.5 - t) ** 2 / 2, 0))


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
    found = loose_parts(field, cells, LEVEL + 1, NONE, go_on)
    np.testing.assert_allclose(found.points, middles[turned], atol=1e-6)
    np.testing.assert_allclose(found.distance, np.sign(before[turned]) * spacing(LEVEL + 2))


def test_what_goes_on_beyond_the_cells_is_not_loose():
    """A dent in the surface, and half of a hollow."""
    field, _, cells = with_spot(0.5, 1.0)
    assert not len(loose_parts(field, cells, LEVEL + 1, NONE, go_on).points)
    field, node, cells = with_spot(0.25, 1.0)
    half = cells[centres(places(cells, LEVEL + 1), LEVEL + 1)[:, 0] < node[0]]
    assert not len(loose_parts(field, half, LEVEL + 1, NONE, go_on).points)


def test_a_part_with_untouched_surface_is_not_loose():
    """A sample of the wall of the hollow, whose outside is the hollow's inside."""
    field, _, cells = with_spot(0.25, 1.0)
    hollow = loose_parts(field, cells, LEVEL + 1, NONE, go_on).points
    top = hollow[hollow[:, 2].argmax()]
    wall = Samples(top[None] + np.float32([[0, 0, spacing(LEVEL + 2)]]), np.float32([[0, 0, -1]]))
    assert not len(loose_parts(field, cells, LEVEL + 1, wall, go_on).points)
