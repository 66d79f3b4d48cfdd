# SPDX-License-Identifier: GPL-3.0-or-later
"""What is left of a displaced surface that runs through itself, against curves in the plane."""

import numpy as np
import pytest

from neural_sculpt_addon.common.progress import go_on
from neural_sculpt_addon.field.evaluate import normals, values
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.problem.fold import SweptVolume, bounding, crossings, passes
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.problem.tube import sample_tube
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Direction, Stroke
from tests.field.analytic import ball, ellipsoid, plane

AXES = (0.5, 0.5, 0.2)  # its meridian has a radius of curvature of 0.08 at the equator


def meridian(brush, count=3_000):
    """The displaced ellipse (count, 2) when the whole equator is stroked: from the axis, and z."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ellipse = np.stack([AXES[0] * np.cos(angle), AXES[2] * np.sin(angle)], axis=1)
    normals = ellipse / np.square([AXES[0], AXES[2]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    way = np.abs(ellipse[:, 0])  # both halves are displaced alike
    away = np.hypot(way - AXES[0], ellipse[:, 1]) / brush.radius
    return ellipse + (brush.intensity * brush.profile(np.minimum(away, 2)))[:, None] * normals


def winding(curve, points):
    """How often a closed polygon (K, 2) runs around each of `points` (N, 2)."""
    numbers = []
    for point in points:
        x, y = (curve - point).T
        angle = np.arctan2(y, x)
        turns = np.diff(angle, append=angle[0])
        numbers.append(np.round((turns - 2 * np.pi * np.round(turns / 2 / np.pi)).sum()))
    return np.array(numbers) / (2 * np.pi)


@pytest.fixture(scope="module")
def preparation():
    return prepare(ellipsoid(AXES))


def equator(brush):
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    points = AXES[0] * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return Stroke(points, brush, closed=True)


def whole_tube(problem, rows=99, columns=101):
    """With what bounds nothing."""
    (placed,) = problem.placed
    return sample_tube(problem.field, *placed, rows, columns)


def in_plane(samples, beside=0.0):
    x, y, z = (samples.points + beside * samples.normals).astype(float).T
    return np.stack([np.hypot(x, y), z], axis=1)


@pytest.mark.parametrize("depth", [0.06, 0.1, 0.16])
def test_of_a_carved_edge_is_left_what_bounds_the_shape(preparation, depth):
    """Carved deeper than 0.08, the edge folds over: its two sides cross and leave a loop."""
    brush = Brush(0.15, -depth)
    problem = pose(preparation, equator(brush))
    whole, (tube,) = whole_tube(problem), problem.tubes()
    beside = in_plane(whole.target, 2e-3)
    bounds = np.abs(winding(meridian(brush), beside)) < 0.5
    left = np.isin(whole.surface.points[:, 2], tube.surface.points[:, 2])
    assert (left == bounds).mean() > 0.97
    assert left.all() == (depth < 0.08)


def test_displaced_samples_are_lost_with_the_tube_around_them(preparation):
    brush = Brush(0.15, -0.16)
    problem = pose(preparation, equator(brush))
    moved, stretch = problem.displaced(preparation.surface)
    under = ~problem.copies.untouched(preparation.surface)
    bounds = np.abs(winding(meridian(brush), in_plane(moved, 2e-3)[under])) < 0.5
    assert ((stretch[under] > 0) == bounds).mean() > 0.97
    assert (stretch[~under] == 1).all()
    assert 0.1 < bounds.mean() < 0.9


def swept(problem, check=go_on):
    """The surface of the proxy, where it is displaced to, and what it sweeps over."""
    proxy = problem.preparation.proxy
    before = Samples(proxy.vertices, normals(problem.field, proxy.vertices))
    after, _ = problem.copies.move(before)
    triangles, radius = proxy.triangles.astype(np.int64), problem.stroke.brush.radius
    return before, after, SweptVolume(problem.field, before, after, triangles, radius, check)


def test_a_cancel_is_heard_between_the_winding_numbers_of_some_samples(preparation):
    """Each takes 0.02 ms, and 0.1 ms where a stroke lies many times upon itself."""
    problem, heard = pose(preparation, equator(Brush(0.15, -0.16))), []
    before, after, volume = swept(problem, lambda: heard.append(None))
    heard.clear()
    bounding(problem.field, volume, before, after, go_on)
    assert len(heard) > np.count_nonzero(volume.near(after.points)) / 2500 > 1


def corrugated(height, length):
    """Samples of z = height sin(2 pi x / length), 0.2 in square, and the curvature there."""
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 400), np.linspace(-0.1, 0.1, 20))
    k = 2 * np.pi / length
    slope = (height * k * np.cos(k * x)).ravel()
    points = np.stack([x.ravel(), y.ravel(), (height * np.sin(k * x)).ravel()], axis=1)
    upright = np.stack([-slope, 0 * slope, 0 * slope + 1], axis=1)
    steepness = np.linalg.norm(upright, axis=1, keepdims=True)
    curvature = (-height * k**2 * np.sin(k * x)).ravel() / steepness[:, 0] ** 3
    return Samples(points, upright / steepness), curvature


def moved(surface, way):
    return Samples(surface.points + way, surface.normals)


def shell(height):
    """A field that is `height` everywhere."""
    return plane((0.0, 0.0, 0.0), -height)


def test_relief_that_is_carried_along_passes_nothing():
    """Walls of 57 degrees, moved by three times the radius of their troughs: most of them come
    closer to where they were than they are moved, and stay as far from each other as before."""
    relief, curvature = corrugated(0.02, 0.08)
    assert curvature.max() > 2 / 0.03
    after = moved(relief, (0, 0, 0.03))
    row = after.points[:400, None] - relief.points[None, :400]
    assert np.median(np.linalg.norm(row, axis=2).min(axis=1)) < 0.8 * 0.03
    assert not passes(shell(0.03), relief, after, go_on)


def test_relief_that_is_moved_along_its_normals_meets_in_its_troughs():
    """There normals meet, at the radius of curvature: 0.008 in the troughs."""
    relief, curvature = corrugated(0.02, 0.08)
    assert 1 / curvature.max() == pytest.approx(0.0081, abs=1e-4)
    for height, meets in (0.004, False), (0.03, True):
        after = moved(relief, height * relief.normals)
        assert passes(shell(height), relief, after, go_on) == meets


@pytest.mark.parametrize(("way", "meets"), [(0.04, False), (0.06, True)])
def test_walls_that_face_each_other_meet_when_both_move_half_of_the_gap(way, meets):
    y, z = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-0.1, 0.1, 60)]))
    sides = np.repeat([-1, 1], len(y))
    points = np.stack([0.05 * sides, np.tile(y, 2), np.tile(z, 2)], axis=1)
    walls = Samples(points, np.stack([-sides, 0 * sides, 0 * sides], axis=1).astype(float))
    assert passes(shell(0.04), walls, moved(walls, way * walls.normals), go_on) == meets


def test_a_steep_wall_that_slips_along_the_surface_tells_nothing():
    """It comes out on the other side where the surface bends; what is moved straight on does so
    where it meets another part."""
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (200, 3)) * (0, 1, 1)
    wall = Samples(points, np.tile([1.0, 0.0, 0.0], (200, 1)))
    assert passes(shell(-0.01), wall, moved(wall, (0.1, 0, 0)), go_on)
    assert not passes(shell(-0.01), wall, moved(wall, (0.01, 0, 0.1)), go_on)


def test_near_a_fold_is_what_lies_beside_the_ways_of_those_that_cross(preparation):
    problem = pose(preparation, equator(Brush(0.15, -0.16)))
    before, after, volume = swept(problem)
    crossed = crossings(problem.field, before, after, go_on)
    share = np.random.default_rng(1).uniform(size=(np.count_nonzero(crossed), 1))
    ways = (before.points + share.max() * (after.points - before.points))[crossed]
    assert volume.near(ways.astype(np.float32)).all()
    height = np.abs(before.points[crossed, 2]).max()
    far = before.points[np.abs(before.points[:, 2]) > height + 0.5 * 0.15]
    assert len(far) > 100
    assert not volume.near(far).any()


def test_a_steep_side_that_was_displaced_sideways_is_kept():
    """Along one direction a surface that is a height over the plane stays one, however steep."""
    problem = pose(
        prepare(ball(0.5)),
        Stroke(
            np.array([[0, 0, 0.5]]),
            Brush(
                0.45,
                -0.2,
                Profile(points=((-1, 0), (-0.9, 0), (-0.8, 1), (0.8, 1), (0.9, 0), (1, 0))),
            ),
            direction=Direction.STROKE,
        ),
    )
    whole, (tube,) = whole_tube(problem), problem.tubes()
    cosine = (whole.surface.normals * whole.target.normals).sum(axis=1)
    assert cosine.min() < -0.1
    assert len(tube.target.points) > 0.99 * len(whole.target.points)


@pytest.mark.parametrize("intensity", [0.06, -0.06])
def test_the_swept_volume_lies_between_both_surfaces(intensity):
    """A flat-topped dab on a ball: at its pole the volume reaches from 0.5 to 0.5 + intensity."""
    flat = Profile(points=((-1, 0), (-0.8, 1), (0.8, 1), (1, 0)))
    stroke = Stroke(np.array([[0, 0, 0.5]]), Brush(0.2, intensity, flat))
    *_, volume = swept(pose(prepare(ball(0.5)), stroke))
    heights = 0.5 + intensity * np.array([-0.5, 0.2, 0.5, 0.8, 1.5])
    points = np.stack([0 * heights, 0 * heights, heights], axis=1)
    wound = np.sign(intensity) * np.array([0, 1, 1, 1, 0])
    np.testing.assert_allclose(volume.winding(points), wound, atol=0.05)


def test_a_carve_through_a_thin_part_swallows_its_far_side():
    """A flat-bottomed hole of radius 0.12 to 0.15 through a lens 0.1 thick: its lower sheet is gone
    within that, and is there beyond it."""
    flat = Profile(points=((-1, 0), (-0.8, 1), (0.8, 1), (1, 0)))
    stroke = Stroke(np.array([[0, 0, 0.05]]), Brush(0.15, -0.2, flat))
    *_, volume = swept(pose(prepare(ellipsoid((0.5, 0.5, 0.05))), stroke))
    away = np.array([0, 0.05, 0.1, 0.17, 0.3])
    lower = np.stack([away, 0 * away, -0.05 * np.sqrt(1 - 4 * away**2)], axis=1)
    np.testing.assert_array_equal(volume.swallows(np.float32(lower)), away < 0.12)


def test_inside_is_where_the_displaced_curve_runs_around(preparation):
    """Also far from what crosses, and within what the curve runs around twice or backwards."""
    brush = Brush(0.15, -0.16)
    problem = pose(preparation, equator(brush))
    random = np.random.default_rng(3)
    away, height, turn = random.uniform((0.2, -0.25, 0), (0.6, 0.25, 2 * np.pi), (400, 3)).T
    points = np.stack([away * np.cos(turn), away * np.sin(turn), height], axis=1)
    plane, curve = np.stack([away, height], axis=1), meridian(brush)
    clear = np.linalg.norm(plane[:, None] - curve, axis=2).min(axis=1) > 3e-3
    points = points[clear].astype(np.float32)
    inside = problem.folded.inside(points, values(problem.field, points))
    np.testing.assert_array_equal(inside, winding(curve, plane[clear]) > 0.5)
    assert 0.1 < inside.mean() < 0.9


def test_walls_get_samples_where_the_displacement_jumps():
    """A flat dab without sides: around its pole a frustum of height 0.1 joins rim and ball."""
    stroke = Stroke(np.array([[0, 0, 0.5]]), Brush(0.2, 0.1, Profile(table=(1, 1))))
    folded = pose(prepare(ball(0.5)), stroke).folded
    before, after = folded.walls(0.01, np.random.default_rng(0))
    angle = 2 * np.arcsin(0.2)  # of a chord of 0.2 in a circle of radius 0.5
    area = 2 * np.pi * 0.55 * np.sin(angle) * 0.1
    assert len(after.points) == pytest.approx(area / 0.01**2, rel=0.2)  # it has a jagged rim
    height = np.linalg.norm(after.points, axis=1)
    assert np.ptp(height) > 0.09 and height.min() > 0.495 and height.max() < 0.605
    across = np.hypot(*after.points[:, :2].T) / height
    np.testing.assert_allclose(across, np.sin(angle), atol=0.01)
    assert np.abs((after.normals * after.points).sum(axis=1) / height).max() < 0.3
    np.testing.assert_allclose(np.linalg.norm(before.points, axis=1), 0.5, atol=1e-3)
