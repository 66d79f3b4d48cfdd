# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes over a rough surface, whose normals turn within less than the way that they go."""

import numpy as np
import pytest

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.levels import Level, cells_of, dilated, distinct, quantised
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.solve.resolution import resolution
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball

LEVEL, ROUGHNESS = 7, 6e-3  # of bumps some 0.02 wide


@pytest.fixture(scope="module")
def rough():
    """A ball that is rough where x > 0.3."""
    smooth = prepare(ball(0.5))
    points = smooth.surface.points
    cells = dilated(distinct(cells_of(points[points[:, 0] > 0.3], LEVEL), LEVEL), LEVEL)
    values = np.random.default_rng(7).uniform(-ROUGHNESS, ROUGHNESS, len(cells))
    return prepare(smooth.field.plus({LEVEL: Level(cells, quantised(values))}))


def meridian(height):
    angle = np.linspace(-0.5, 0.5, 7)
    points = 0.5 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    return Stroke(points, Brush(0.06, height))


@pytest.mark.parametrize("height", [0.06, -0.06])
@pytest.mark.long
def test_a_high_stroke_over_bumps_comes_out_whole(rough, height):
    edit = sculpt(rough, meridian(height))
    assert components(extract(edit.field, 256)) == 1
    report = edit.report()
    assert report["tube_p95"] < 1e-3
    assert report["reverse_p95"] < 1e-3


def test_it_goes_along_normals_without_the_bumps(rough):
    """Those of the ball: the bumps are carried along as they are."""
    problem = pose(rough, meridian(0.06))
    assert problem.guide is not rough.field
    (tube,) = problem.tubes()
    way = tube.target.points - tube.surface.points
    some = np.abs(tube.displacement.amount) > 0.01
    outward = tube.surface.points / np.linalg.norm(tube.surface.points, axis=1, keepdims=True)
    cosine = (way * outward).sum(axis=1) / np.linalg.norm(way, axis=1).clip(1e-9)
    assert np.count_nonzero(some) > 1000
    assert cosine[some].min() > 0.99


def test_a_low_stroke_goes_along_the_normals_of_the_surface(rough):
    assert pose(rough, meridian(0.002)).guide is rough.field


def test_it_is_solved_as_finely_as_the_bumps_where_it_would_fold(rough):
    """Its own features ask for cells of 1/64, the bumps have cells of 1/128."""
    high = resolution(pose(rough, meridian(0.06)))
    assert (high.level, high.wanted) == (LEVEL, 6)
    assert not high.is_limited
    assert resolution(pose(rough, meridian(0.002))).level == 6


@pytest.mark.long
def test_what_is_carved_through_a_blade_leaves_no_crumbs_of_it():
    """The blade is thinner than the cells that the carving brush asks for by itself."""
    turn = np.linspace(-0.4, 0.4, 7)
    along = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    across = 0.5 * np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    blade = sculpt(prepare(ball(0.5)), Stroke(along, Brush(0.02, 0.06)))
    edit = sculpt(blade.preparation, Stroke(across, Brush(0.08, -0.06)))
    assert components(extract(edit.field, 384)) == 1
    report = edit.report()
    assert report["tolerance_met"]
    assert report["tube_p95"] < 1.5e-4
    assert report["reverse_p95"] < 4e-4
