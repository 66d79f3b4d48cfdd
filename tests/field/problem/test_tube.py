# SPDX-License-Identifier: GPL-3.0-or-later
"""Tubes against closed forms: a ridge on a plane, a band around a sphere."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from neural_sculpt_addon.field.problem.placement import place_stroke
from neural_sculpt_addon.field.problem.tube import COLUMNS, ROWS, sample_rim, sample_tube
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Direction, Ends, Stroke
from tests.field.analytic import ball, ellipsoid, plane

SKEW = Profile(points=((-1, 0), (-0.5, 1), (0.5, -1), (1, 0)))


def quintic(t):
    t = np.minimum(np.abs(t), 1)
    return 1 - 10 * t**3 + 15 * t**4 - 6 * t**5


def quintic_slope(t):
    return -30 * t**2 * (1 - np.abs(t)) ** 2 * np.sign(t)


def angle(a, b):
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=1), -1, 1)))


def ridge(**words):
    """A stroke of length 1 along x on the plane z = 0, and its tube."""
    brush = words.pop("brush", Brush(0.2, 0.1, modulation=Modulation("linear")))
    stroke = Stroke(np.array([[-0.5, 0, 0], [0.5, 0, 0]]), brush, **words)
    return stroke, place_stroke(plane(), stroke)


def belt(radius=0.2, intensity=0.05, **words):
    """A closed stroke around the equator of ball(0.5), eastwards."""
    turn = np.linspace(0, 2 * np.pi, 25)[:-1]
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    profile = words.pop("profile", Profile("quintic"))
    return Stroke(points, Brush(radius, intensity, profile), closed=True, **words)


def test_a_ridge_on_a_plane():
    """z = (1 - u) s b(y / r) between the ends, with its slopes."""
    stroke, path = ridge()
    tube = sample_tube(plane(), stroke, path)
    x, y, z = tube.surface.points.T.astype(float)
    np.testing.assert_allclose(z, 0, atol=1e-6)
    core = np.abs(x) < 0.49
    m, t = 0.5 - x, y / 0.2
    np.testing.assert_allclose(tube.target.points[:, :2], tube.surface.points[:, :2], atol=1e-6)
    np.testing.assert_allclose(tube.target.points[core, 2], (0.1 * m * quintic(t))[core], atol=1e-5)
    slopes = [0.1 * quintic(t), -0.1 * m * quintic_slope(t) / 0.2, np.ones_like(t)]
    normals = np.stack(slopes, axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert angle(tube.target.normals, normals)[core].max() < 0.5
    np.testing.assert_allclose(np.linalg.norm(tube.target.normals, axis=1), 1, atol=1e-5)


def test_the_grid_of_the_paper():
    stroke, path = ridge(ends=Ends.FLAT)
    tube = sample_tube(plane(), stroke, path)
    assert tube.grid.shape == (ROWS, COLUMNS) == (99, 101)
    assert sorted(tube.grid[tube.grid >= 0]) == list(range(len(tube.surface.points)))
    inner = tube.grid[1:-1, 1:-1]
    assert (inner >= 0).all()
    expected = np.meshgrid(np.linspace(-0.5, 0.5, 99)[1:-1], np.linspace(-0.2, 0.2, 101)[1:-1])
    np.testing.assert_allclose(
        tube.surface.points[inner][..., :2], np.stack(expected, axis=-1).swapaxes(0, 1), atol=1e-5
    )


def test_cells_of_a_very_long_tube_are_no_longer_than_ten_times_their_width():
    brush = Brush(0.005, 0.01)
    stroke, path = ridge(brush=brush, ends=Ends.FLAT)
    tube = sample_tube(plane(), stroke, path)
    rows, columns = tube.grid.shape
    assert rows * columns == pytest.approx(ROWS * COLUMNS, rel=0.05)
    assert (1 / rows) / (2 * 0.005 / columns) == pytest.approx(10, rel=0.05)


def test_round_ends_are_covered_and_flat_ends_are_not():
    stroke, path = ridge()
    points = sample_tube(plane(), stroke, path).surface.points
    assert np.hypot(np.maximum(np.abs(points[:, 0]) - 0.5, 0), points[:, 1]).max() <= 0.2 + 1e-5
    random = np.random.default_rng(0).uniform(-0.2, 0.2, (2000, 2))
    cap = random[(np.hypot(*random.T) < 0.195) & (random[:, 0] > 0)]
    where = np.column_stack([0.5 + cap[:, 0], cap[:, 1], 0 * cap[:, 0]])
    assert KDTree(points).query(where)[0].max() < 0.01
    stroke, path = ridge(ends=Ends.FLAT)
    assert np.abs(sample_tube(plane(), stroke, path).surface.points[:, 0]).max() <= 0.5 + 1e-5


def test_a_dab():
    stroke = Stroke(np.zeros((1, 3)), Brush(0.2, 0.1))
    tube = sample_tube(plane(), stroke, place_stroke(plane(), stroke))
    distance = np.hypot(*tube.surface.points[:, :2].T)
    assert distance.max() <= 0.2 + 1e-6
    share = len(distance) / (ROWS * COLUMNS)
    assert share == pytest.approx(np.pi / 4, abs=0.02)
    np.testing.assert_allclose(tube.target.points[:, 2], 0.1 * quintic(distance / 0.2), atol=1e-5)
    assert tube.displacement.beyond.all()


@pytest.mark.parametrize("direction", Direction)
def test_a_band_around_a_sphere(direction):
    """A surface of revolution; latitude b is 2 R sin(b / 2) away from the equator."""
    radius, intensity = 0.25, 0.06
    stroke = belt(radius, intensity, direction=direction)
    field = ball(0.5)
    tube = sample_tube(field, stroke, place_stroke(field, stroke))
    assert not tube.displacement.beyond.any()
    n = tube.surface.points.astype(float) / 0.5
    latitude = np.arcsin(n[:, 2])
    t = 2 * 0.5 * np.sin(latitude / 2) / radius
    height = intensity * quintic(t)
    growth = intensity * quintic_slope(t) / radius * 0.5 * np.cos(latitude / 2)  # by latitude
    east = np.stack([-n[:, 1], n[:, 0], 0 * latitude], axis=1)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    north = np.cross(n, east)
    way = n if direction is Direction.SURFACE else np.cross(east, [0, 0, 1])
    np.testing.assert_allclose(tube.target.points, 0.5 * n + height[:, None] * way, atol=2e-4)
    along = 0.5 * north + growth[:, None] * way
    if direction is Direction.SURFACE:
        along += height[:, None] * north
    normals = np.cross(east, along)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    wrong = angle(tube.target.normals, normals)
    assert np.percentile(wrong, 99) < 0.5
    assert wrong.max() < 3


def test_carving_and_lopsided_profiles_keep_outward_normals():
    field = ball(0.5)
    for profile, intensity in ((SKEW, 0.06), (Profile("quintic"), -0.06)):
        stroke = belt(0.25, intensity, profile=profile)
        tube = sample_tube(field, stroke, place_stroke(field, stroke))
        assert ((tube.target.normals * tube.surface.normals).sum(axis=1) > 0.3).all()
        # Positive v is north of the way east; SKEW carves there.
        north = tube.surface.points[:, 2] > 0.06
        amount = tube.displacement.amount[north & (tube.surface.points[:, 2] < 0.2)]
        assert (amount < 0).all()


def test_pressure_widens_the_tube():
    stroke, path = ridge(brush=Brush(0.1, 0.05), radius_factors=np.array([0.5, 2.0]))
    points = sample_tube(plane(), stroke, path).surface.points
    for x, width in ((-0.45, 0.0575), (0, 0.125), (0.45, 0.1925)):
        at = np.abs(points[:, 0] - x) < 0.02
        assert np.abs(points[at, 1]).max() == pytest.approx(width, rel=0.05)


def test_jitter_moves_samples_within_their_cells():
    stroke, path = ridge(ends=Ends.FLAT)
    regular = sample_tube(plane(), stroke, path)
    first, again, other = (
        sample_tube(plane(), stroke, path, jitter=np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.surface.points, again.surface.points)
    assert not np.array_equal(first.surface.points[:100], other.surface.points[:100])
    both = (first.grid >= 0) & (regular.grid >= 0)
    moved = first.surface.points[first.grid[both]] - regular.surface.points[regular.grid[both]]
    assert np.abs(moved[:, 0]).max() <= 0.5 / 98 + 1e-5
    assert moved[:, 0].std() == pytest.approx(1 / 98 / 12**0.5, rel=0.05)
    # across the stroke 101 equal cells, so that no more samples lie at the rim than elsewhere
    cell = (np.argwhere(both)[:, 1] - 50) * 0.4 / 101
    across = first.surface.points[first.grid[both]][:, 1]
    sign = np.sign(across @ cell)  # the path's lateral may point either way
    assert np.abs(sign * across - cell).max() <= 0.5 * 0.4 / 101 + 1e-5


def test_chosen_samples_keep_their_places_in_the_grid():
    stroke, path = ridge()
    tube = sample_tube(plane(), stroke, path, 20, 21)
    chosen = tube.surface.points[:, 1] > 0
    part = tube.where(chosen)
    assert len(part.surface.points) == chosen.sum()
    for row, column in np.argwhere(tube.grid >= 0):
        was, now = tube.grid[row, column], part.grid[row, column]
        assert (now >= 0) == chosen[was]
        if now >= 0:
            assert (part.target.points[now] == tube.target.points[was]).all()


def test_the_other_side_of_a_thin_part_is_no_part_of_the_tube():
    """A plate of thickness 0.06, a brush of radius 0.15: the stroke is on its upper side."""
    plate = ellipsoid((0.8, 0.8, 0.03))
    stroke = Stroke(np.array([[-0.2, 0, 0.029], [0.2, 0, 0.029]]), Brush(0.15, 0.05))
    tube = sample_tube(plate, stroke, place_stroke(plate, stroke))
    assert len(tube.surface.points) > 3000
    assert (tube.surface.points[:, 2] > 0).all()


def test_the_rim_lies_just_outside_of_the_tube():
    field = ball(0.5)
    stroke = belt(0.15)
    rim = sample_rim(
        field, stroke, place_stroke(field, stroke), 2.0, 2000, np.random.default_rng(0)
    )
    np.testing.assert_allclose(np.linalg.norm(rim.points, axis=1), 0.5, atol=1e-4)
    away = np.sin(np.abs(np.arcsin(rim.points[:, 2] / 0.5)) / 2) / 0.15
    assert away.min() > 1.0
    assert away.max() <= 2.0 + 1e-3
    assert 1000 < len(rim.points) < 3000


def test_inner_samples_have_neighbours_on_all_sides():
    """Of a flat strip all but the outermost rows and columns, of a dab all but its edge."""
    stroke, path = ridge(ends=Ends.FLAT)
    tube = sample_tube(plane(), stroke, path)
    x, y = np.abs(tube.surface.points[:, :2].T)
    assert tube.inner()[(x < 0.5 - 1.5 / 98) & (y < 0.2 - 2.5 * 0.004)].all()
    assert not tube.inner()[(x > 0.5 - 0.5 / 98) | (y > 0.2 - 0.5 * 0.004)].any()
    dab = Stroke(np.zeros((1, 3)), Brush(0.2, 0.1))
    tube = sample_tube(plane(), dab, place_stroke(plane(), dab))
    away = np.hypot(*tube.surface.points[:, :2].T)
    assert away[tube.inner()].max() < 0.2 - 0.0015
    assert away[~tube.inner()].min() > 0.2 - 1.5 * 0.4 / 98


def test_the_triangles_of_a_ridge_cover_its_rectangle_and_face_upward():
    stroke, path = ridge(ends=Ends.FLAT)
    tube = sample_tube(plane(), stroke, path)
    triangles = tube.triangles()
    first, second, third = tube.surface.points[triangles].swapaxes(0, 1).astype(float)
    across = np.cross(second - first, third - first)
    assert (across[:, 2] > 0).all()
    assert across[:, 2].sum() / 2 == pytest.approx(1 * 0.4, rel=2 / ROWS + 2 / COLUMNS)
    none = tube.where(np.zeros(len(tube.surface.points), bool))
    assert none.triangles().shape == (0, 3)
