# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes over a rough surface, whose normals turn within less than the way that they go."""

import igl
import numpy as np
import pytest

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import Level, cells_of, dilated, distinct, quantised
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.mesh.surface import Samples
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
    bumps = np.random.default_rng(7).uniform(-ROUGHNESS, ROUGHNESS, len(cells))
    return prepare(smooth.field.plus({LEVEL: Level(cells, quantised(bumps))}))


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


def test_over_bumps_there_are_more_cells_in_a_rise(rough):
    """2.5, not 2: a radius of 2.2 cells of level 6.5 has level 6 on the smooth ball."""
    low = Stroke(meridian(0).points, Brush(2.2 * 2**-6.5, 0.02))
    assert pose(rough, low).is_over_relief
    assert resolution(pose(rough, low)).wanted == 7
    assert resolution(pose(prepare(ball(0.5)), low)).wanted == 6


@pytest.fixture(scope="module")
def ridged():
    """A ball with five ridges, 0.05 wide, and 0.03 high."""
    preparation, angle = prepare(ball(0.5)), np.linspace(-0.5, 0.5, 9)
    for x in (-0.1, -0.05, 0.0, 0.05, 0.1):
        points = np.stack([x + 0 * angle, np.sin(angle) / 2, np.cos(angle) / 2], axis=1)
        points *= 0.5 / np.linalg.norm(points, axis=1, keepdims=True)
        preparation = sculpt(preparation, Stroke(points, Brush(0.025, 0.03))).preparation
    return preparation


def outermost(field, ways):
    """How far from the origin the surface is, along unit vectors (N, 3), by bisection."""
    inside, outside = np.full(len(ways), 0.4), np.full(len(ways), 0.7)
    for _ in range(20):
        middle = (inside + outside) / 2
        is_inside = values(field, np.float32(middle[:, None] * ways)) < 0
        inside, outside = np.where(is_inside, middle, inside), np.where(is_inside, outside, middle)
    return inside


@pytest.mark.parametrize("height", [0.04, -0.04])
def test_ridges_are_carried_along_where_nothing_folds(ridged, height):
    """Each ray from the middle of the ball meets the surface as much farther out as the stroke is
    high. No winding number is asked for, which would take as long again."""
    stroke = Stroke(
        np.array([[0, 0, outermost(ridged.field, np.eye(3)[2:])[0]]]), Brush(0.1, height)
    )
    edit = sculpt(ridged, stroke)
    assert edit.problem.is_guided
    assert edit.problem.displaced_tubes(40, 40, None).swept is None
    assert edit.report()["tolerance_met"]
    x = np.linspace(-0.05, 0.05, 201)
    ways = np.stack([x, 0 * x, 0.5 + 0 * x], axis=1)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    before, after = (outermost(field, ways) for field in (ridged.field, edit.field))
    assert np.ptp(before) > 0.025
    ridge = before[:, None] * ways
    from_middle = np.linalg.norm(ridge - ridge[100], axis=1)
    asked = height * stroke.brush.profile(from_middle / 0.1)
    off = np.abs(after - before - asked)
    assert off[100] < 3e-4
    assert np.quantile(off, 0.75) < 1e-3  # the rest are rays along the ridges' steep walls


@pytest.mark.parametrize("height", [0.004, 0.01])
def test_a_low_stroke_moves_the_steep_walls_of_ridges_too(ridged, height):
    """Without a guide, for nothing of it would fold. The surface asked for is a mesh of the old
    one, each vertex displaced by itself; without samples in the walls the result is 1.6e-3 to
    2.7e-3 from it."""
    top = outermost(ridged.field, np.eye(3)[2:])[0]
    edit = sculpt(ridged, Stroke(np.array([[0, 0, top]]), Brush(0.06, height)))
    assert not edit.problem.is_guided
    fine = extract(ridged.field, 384)
    moved, _ = edit.problem.copies.move(Samples(fine.vertices, fine.normals))
    result = extract(edit.field, 256).vertices
    result = result[np.linalg.norm(result - [0, 0, top], axis=1) < 0.08].astype(float)
    asked = moved.points.astype(float), fine.triangles.astype(np.int64)
    away = np.sqrt(igl.point_mesh_squared_distance(result, *asked)[0])
    assert np.quantile(away, 0.95) < 1e-3


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
