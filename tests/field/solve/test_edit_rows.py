# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit asks for beside the displaced surface, against a surface in closed form."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import cells_of, children, dilated, distinct, spacing
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.solve.edit_rows import AROUND_WEIGHT, EditedSurface
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ellipsoid

EDGE = Profile("linear")
RADIUS, LEVEL = 0.1, 6


BLADE = Profile(table=(0, 1, 0, 1, 0))  # falls to both sides of the middle, where it is thin


def belt(latitude, brush):
    """How far a ball of radius 1/2 with a belt reaches at each latitude."""
    across = 2 * 0.5 * np.sin(latitude / 2) / brush.radius
    return 0.5 + brush.intensity * brush.profile(across)


def section(brush):
    """The meridian of that ball: (N, 2), distance from the axis and height."""
    latitude = np.linspace(-0.6, 0.6, 200_001)
    return belt(latitude, brush)[:, None] * np.stack([np.cos(latitude), np.sin(latitude)], axis=1)


def inside(points, brush):
    """Which points (N, 2) of that half plane are inside of it."""
    return np.hypot(*points.T) < belt(np.arctan2(*points.T[::-1]), brush)


def girdled(brush):
    """A stroke around the equator."""
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    circle = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return Stroke(circle, brush, closed=True)


def around(problem, displaced, near, level, random):
    """Middles (N, 2), in the half plane, of the cells around points `near` (M, 3), and what f shall
    be there (N,)."""
    active, nothing = (
        distinct(cells_of(near.astype(np.float32), level), level),
        np.empty(0, np.int32),
    )
    rows = EditedSurface(problem, displaced, active, nothing, nothing, level, random).rows
    some = rows.weights == np.float32(AROUND_WEIGHT)
    points = rows.points[some].astype(float)
    return np.stack([np.hypot(*points[:, :2].T), points[:, 2]], axis=1), rows.targets[some]


def distance(points, brush):
    """Signed distance (N,) of points (N, 2) of the half plane."""
    return KDTree(section(brush)).query(points)[0] * np.where(inside(points, brush), -1, 1)


@pytest.mark.parametrize("intensity", [-0.12, 0.12])
def test_beyond_a_crease_the_distance_is_that_from_the_crease(preparation, intensity):
    """Under the bottom of a groove and above a ridge, with sides of 50 degrees."""
    brush = Brush(RADIUS, intensity, EDGE)
    problem = pose(preparation, girdled(brush))
    random, h = np.random.default_rng(0), spacing(LEVEL)
    displaced = problem.displaced_surface(600, 60, random, RADIUS / 30, h, h)
    assert displaced.swept is None
    near = random.uniform(-3 * h, 3 * h, (30_000, 3))
    near[:, 0] += 0.5 + intensity
    half, targets = around(problem, displaced, near, LEVEL, random)
    true = distance(half, brush)
    beyond = np.abs(half[:, 1]) < (half[:, 0] - 0.5 - intensity) * np.sign(intensity) / 2
    assert beyond.sum() > 10
    assert (np.sign(targets) == np.sign(true))[beyond].all()
    np.testing.assert_allclose(targets[beyond], true[beyond], atol=0.5 * h)


@pytest.mark.long
@pytest.mark.parametrize("intensity", [-0.13, 0.13])
def test_beside_blades_and_slits_the_side_is_that_of_both_walls(preparation, intensity):
    """Two grooves of 80 degrees with a blade between them, or two ridges with a slit, also at their
    rims, where the nearest surface is one that stays."""
    brush, level = Brush(0.06, intensity, BLADE), 8
    problem = pose(preparation, girdled(brush))
    random, h = np.random.default_rng(0), spacing(level)
    displaced = problem.displaced_surface(2000, 90, random, h / 2.5, h, h)
    assert displaced.swept is None
    radius, height = random.uniform((0.5 - 0.15, -0.07), (0.5 + 0.15, 0.07), (100_000, 2)).T
    turn = random.uniform(-0.3, 0.3, len(radius))
    near = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    half, targets = around(problem, displaced, near, level, random)
    true = distance(half, brush)
    clear = (np.abs(true) > 0.3 * h) & (np.abs(true) < 3 * h)
    assert clear.sum() > 5_000
    assert (np.sign(targets) != np.sign(true))[clear].mean() < 6e-4


def test_finer_samples_of_a_carve_through_a_thin_part_are_none_behind_it():
    """A dab that carves a lens deeper than it is thick: its floor bounds nothing."""
    lens = prepare(ellipsoid((0.5, 0.5, 0.05)))
    problem = pose(lens, Stroke(np.array([[0, 0, 0.05]]), Brush(0.15, -0.2)))
    random, h = np.random.default_rng(0), spacing(LEVEL)
    displaced = problem.displaced_surface(60, 60, random, h / 3, h, h)
    assert displaced.swept is not None
    active = dilated(distinct(cells_of(displaced.after.points, LEVEL), LEVEL), LEVEL)
    nothing = np.empty(0, np.int32)
    surface = EditedSurface(problem, displaced, active, active[:0], nothing, LEVEL, random)
    rows, cells = surface.rows, children(active, LEVEL)
    finer = surface.finer(rows, cells, LEVEL + 1, lens.field, random)
    points = finer.points[len(rows.points) :][finer.targets[len(rows.points) :] == 0]
    assert len(points) > len(displaced.after.points)
    assert values(lens.field, points).max() < 2e-3


def around_a_hole():
    """As `around`, in space, for a hole with steep walls through a lens, with few samples."""
    lens = prepare(ellipsoid((0.5, 0.5, 0.05)))
    flat = Profile(points=((-1, 0), (-0.8, 1), (0.8, 1), (1, 0)))
    problem = pose(lens, Stroke(np.array([[0, 0, 0.05]]), Brush(0.15, -0.2, flat)))
    random, h = np.random.default_rng(0), spacing(LEVEL)
    displaced = problem.displaced_surface(60, 60, random, h / 3, h, h)
    assert displaced.swept is not None
    near = random.uniform(-0.35, 0.35, (60_000, 3)).astype(np.float32)
    active, nothing = distinct(cells_of(near, LEVEL), LEVEL), np.empty(0, np.int32)
    rows = EditedSurface(problem, displaced, active, nothing, nothing, LEVEL, random).rows
    some = rows.weights == np.float32(AROUND_WEIGHT)
    return rows.points[some], rows.targets[some]


def test_far_beside_the_wall_of_a_carve_the_side_is_that_of_the_shape():
    """Their planes reach beyond the lens, where all is outside."""
    points, targets = around_a_hole()
    beyond = np.abs(points[:, 2]) > 0.06
    assert beyond.sum() > 10_000
    assert targets[beyond].min() > 0


def test_in_a_hole_f_goes_on_rising_for_two_cells():
    """Where it stood still, a later stroke would have nothing to follow."""
    points, targets = around_a_hole()
    h, middle = spacing(LEVEL), np.abs(points[:, 2]) < 0.01
    away = 0.143 - np.hypot(*points[middle, :2].T)  # the walls' slope is 1 to 6
    within = (away > 0.5 * h) & (away < 1.8 * h)
    assert within.sum() > 50
    np.testing.assert_allclose(targets[middle][within], away[within], atol=0.35 * h)
