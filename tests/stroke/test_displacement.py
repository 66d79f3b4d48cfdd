# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement against closed forms on a plane and a sphere."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.stroke.alpha import Alpha
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.displacement import displace, local_radius
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.path import make_path
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Direction, Ends, Stroke

SKEW = Profile(points=((-1, 0), (-0.5, 1), (0.5, -1), (1, 0)))
UP = np.array([0.0, 0, 1])


def straight(start=-0.5, stop=0.5, **words):
    """A stroke along x on the plane z = 0, and its path."""
    brush = words.pop("brush", Brush(0.2, 0.1))
    stroke = Stroke(np.array([[start, 0, 0], [stop, 0, 0]]), brush, **words)
    x = np.linspace(start, stop, 257)
    points = np.stack([x, 0 * x, 0 * x], axis=1)
    return stroke, make_path(points, np.tile(UP, (257, 1)))


def on_plane(stroke, path, x, y):
    points = np.stack([*np.broadcast_arrays(np.asarray(x, float), y, 0.0)], axis=-1).reshape(-1, 3)
    return displace(stroke, path, points, np.tile(UP, (len(points), 1)))


def quintic(t):
    t = np.minimum(np.abs(t), 1)
    return 1 - 10 * t**3 + 15 * t**4 - 6 * t**5


def test_the_core_is_m_s_b():
    y = np.linspace(-0.3, 0.3, 61)
    stroke, path = straight(brush=Brush(0.2, -0.1, modulation=Modulation("linear")))
    found = on_plane(stroke, path, 0.25, y)
    np.testing.assert_allclose(found.amount, 0.25 * -0.1 * quintic(y / 0.2), atol=1e-9)
    np.testing.assert_allclose(found.relative_distance, np.abs(y) / 0.2, atol=1e-9)
    np.testing.assert_allclose(found.direction, np.tile(UP, (61, 1)))
    assert not found.beyond.any()


def test_v_is_positive_on_the_side_of_n_cross_u():
    stroke, path = straight(brush=Brush(0.2, 0.1, SKEW))
    # b(-0.5) = 1 and b(0.5) = -1: the stroke raises its right (-y) and carves its left (+y).
    np.testing.assert_allclose(on_plane(stroke, path, 0, [-0.1, 0.1]).amount, [0.1, -0.1])


@pytest.mark.parametrize("profile", [Profile("quintic"), SKEW, Profile(table=(0, 1, 0.5, 0))])
def test_round_caps_blend_both_sides_by_the_sine(profile):
    angle = np.linspace(-np.pi / 2, np.pi / 2, 37)[1:-1]
    stroke, path = straight(brush=Brush(0.2, 0.1, profile, Modulation("central")))
    for distance in (0.02, 0.1, 0.19):
        x, y = 0.5 + distance * np.cos(angle), distance * np.sin(angle)
        found = on_plane(stroke, path, x, y)
        left, right = profile(distance / 0.2), profile(-distance / 0.2)
        cap = left * (1 + np.sin(angle)) / 2 + right * (1 - np.sin(angle)) / 2
        np.testing.assert_allclose(found.amount, np.exp(-1.5) * 0.1 * cap, atol=1e-9)
        assert found.beyond.all() and found.core.all()


def test_the_cap_continues_the_sides():
    stroke, path = straight(brush=Brush(0.2, 0.1, SKEW))
    y = np.linspace(-0.19, 0.19, 39)
    beside, beyond = on_plane(stroke, path, 0.5 - 1e-7, y), on_plane(stroke, path, 0.5 + 1e-7, y)
    np.testing.assert_allclose(beside.amount, beyond.amount, atol=1e-6)


def test_nothing_lies_beyond_a_flat_end():
    stroke, path = straight(ends=Ends.FLAT)
    found = on_plane(stroke, path, [-0.6, -0.501, -0.499, 0.499, 0.501, 0.6], 0.05)
    edge = 0.1 * quintic(0.25)
    np.testing.assert_allclose(found.amount, [0, 0, edge, edge, 0, 0], atol=1e-9)
    assert found.beyond.tolist() == [True, True, False, False, True, True]
    assert found.core.tolist() == [False, False, True, True, False, False]


def test_a_flat_dab_is_still_a_dab():
    stroke = Stroke(np.zeros((1, 3)), Brush(0.2, 0.1), ends=Ends.FLAT)
    found = on_plane(stroke, make_path([[0, 0, 0]], [UP]), [0, 0.1, 0.3], 0)
    np.testing.assert_allclose(found.amount, [0.1, 0.05, 0], atol=1e-9)


def test_the_other_sheet_stays():
    stroke, path = straight()
    points = np.array([[0, 0.05, 0], [0, 0.05, -0.02]])
    found = displace(stroke, path, points, [UP, -UP])
    assert found.amount[0] > 0
    assert found.amount[1] == 0
    assert found.relative_distance[1] == np.inf


def test_around_an_edge_the_displacement_fades():
    """In full up to 60 degrees from the path's normal, then without a step or a kink to nothing."""
    stroke, path = straight(brush=Brush(0.2, 0.1))
    angle = np.sort(np.append(np.radians(np.linspace(0, 180, 721)), np.arccos(0.25)))
    normals = np.stack([0 * angle, np.sin(angle), np.cos(angle)], axis=1)
    points = np.tile([0.0, 0.05, 0], (len(angle), 1))
    found = displace(stroke, path, points, normals)
    part = found.amount / (0.1 * quintic(0.25))
    np.testing.assert_allclose(part[angle < np.pi / 3], 1)
    np.testing.assert_allclose(part[angle > np.pi / 2], 0)
    half = angle == np.arccos(0.25)  # half of the reach is left, 0.375 of a radius
    np.testing.assert_allclose(found.relative_distance[half], 1 - 0.375)
    np.testing.assert_allclose(found.amount[half], 0.1 * quintic(0.625))
    assert (np.diff(part) <= 1e-12).all()
    assert np.abs(np.diff(part)).max() < 0.03


THICKNESS = 0.04  # of a plate with a round rim along y, in front of x = 0


def around_the_rim():
    """A stroke over the upper side of the plate from x = -0.3, around its rim, and back on the
    lower side to x = -0.1."""
    half = THICKNESS / 2
    along = np.linspace(0, 0.4 + np.pi * half, 513)
    angle = np.clip((along - 0.3) / half, 0, np.pi)
    x = np.where(along < 0.3, along - 0.3, np.minimum(0.3 - along + np.pi * half, 0))
    normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    points = np.stack([x, 0 * x, 0 * x], axis=1) + half * normals
    return Stroke(points[::64], Brush(0.1, 0.05)), make_path(points, normals)


def on_the_lower_side(x, y):
    x, y = np.broadcast_arrays(np.asarray(x, float), y)
    points = np.stack([x, y, np.full(x.shape, -THICKNESS / 2)], axis=1)
    return points, np.tile(-UP, (len(points), 1))


def test_the_nearest_part_of_a_stroke_may_lie_on_the_other_side():
    """Above, the path goes on, 0.04 away; below, it ends 0.06 and more before these places."""
    stroke, path = around_the_rim()
    found = displace(stroke, path, *on_the_lower_side([-0.16, -0.19, -0.21], 0.0))
    np.testing.assert_allclose(found.relative_distance, [0.6, 0.9, np.inf], atol=0.01)
    np.testing.assert_allclose(found.amount, 0.05 * quintic([0.6, 0.9, 1]), atol=1e-3)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_around_a_rim_there_is_no_cliff(seed):
    """On any line over the rim of the plate: by no more than the slope of the fade on the rim."""
    stroke, path = around_the_rim()
    random = np.random.default_rng(seed)
    half, slant, start = THICKNESS / 2, random.uniform(-1, 1), random.uniform(-0.1, 0.1)
    along = np.linspace(-0.25, 0.25 + np.pi * half, 20_000)
    angle = np.clip(along / half, 0, np.pi)
    normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    x = np.where(along < 0, along, np.minimum(np.pi * half - along, 0))
    points = np.stack([x, start + slant * along, 0 * x], axis=1) + half * normals
    step = along[1] - along[0]
    steepest = 0.05 * 1.875 * (1.5 * 2 / half + (1 + abs(slant)) / 0.1)  # b' times those of reach
    assert np.abs(np.diff(displace(stroke, path, points, normals).amount)).max() < step * steepest


def test_places_beside_others_keep_their_vertices():
    """Differences of the displacement are its own also where a far vertex reaches a point."""
    stroke, path = around_the_rim()
    random = np.random.default_rng(5)
    angle = random.uniform(0, np.pi, 4000)
    normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    points = THICKNESS / 2 * normals
    points[:, 1] = random.uniform(-0.1, 0.1, 4000)
    points[:, 0] -= random.uniform(0, 0.2, 4000)
    found = displace(stroke, path, points, normals)
    assert np.count_nonzero(found.facing & (found.amount > 0.002)) > 100
    step = 1e-5 * random.normal(size=points.shape)
    kept = displace(stroke, path, points + step, normals, found)
    anew = displace(stroke, path, points + step, normals)
    np.testing.assert_allclose(kept.amount, anew.amount, atol=2e-6)


def test_factors_are_linear_between_control_points():
    stroke, path = straight(
        radius_factors=np.array([0.5, 1.5]), intensity_factors=np.array([2.0, 0.0])
    )
    np.testing.assert_allclose(local_radius(stroke, np.array([0, 0.25, 1])), [0.1, 0.15, 0.3])
    y = np.linspace(-0.3, 0.3, 31)
    for u in (0.0, 0.25, 0.75):
        found = on_plane(stroke, path, u - 0.5, y)
        expected = (2 - 2 * u) * 0.1 * quintic(y / (0.2 * (0.5 + u)))
        np.testing.assert_allclose(found.amount, expected, atol=1e-9)
        np.testing.assert_allclose(
            found.relative_distance, np.abs(y) / (0.2 * (0.5 + u)), atol=1e-6
        )


def test_factors_of_uneven_points_and_of_a_closed_stroke():
    stroke = Stroke(
        np.array([[0, 0, 0], [0.1, 0, 0], [0.4, 0, 0]]),
        Brush(1.0, 0.1),
        radius_factors=np.array([0.0, 0.8, 0.2]),
    )
    u = np.array([0, 0.125, 0.25, 0.625, 1])
    np.testing.assert_allclose(local_radius(stroke, u), [0, 0.4, 0.8, 0.5, 0.2], atol=1e-12)
    square = np.array([[0, 0, 0], [0.4, 0, 0], [0.4, 0.4, 0], [0, 0.4, 0]])
    ring = Stroke(square, Brush(1.0, 0.1), closed=True, radius_factors=np.array([1, 0, 0, 0.0]))
    u = np.array([0, 0.125, 0.5, 0.75, 0.875, 1])
    np.testing.assert_allclose(local_radius(ring, u), [1, 0.5, 0, 0, 0.5, 1], atol=1e-12)


@pytest.mark.parametrize("places", [[0, 1], [0, 1, 0], [0, 0, 1], [0, 0, 1, 1, 0]])
def test_factors_of_two_places_though_they_are_marked_closed(places):
    """The curve is open, from the first place to the second."""
    points = np.array([[0, 0, 0], [0.4, 0, 0]])[places]
    factors = np.array([1.0, 0.5])[places]
    stroke = Stroke(points, Brush(1.0, 0.1), closed=True, radius_factors=factors)
    u = np.array([0, 0.25, 0.5, 1])
    np.testing.assert_allclose(local_radius(stroke, u), [1, 0.875, 0.75, 0.5], atol=1e-12)


def test_a_radius_of_zero_displaces_nothing_but_divides_by_nothing():
    stroke, path = straight(radius_factors=np.array([0.0, 0.0]))
    found = on_plane(stroke, path, 0, [0.001, 0.1])
    assert np.isfinite(found.amount).all()
    np.testing.assert_array_equal(found.amount, 0)


def test_where_a_stroke_crosses_itself_the_nearest_pass_decides():
    """An X: the first pass raises with m = 1, the last does not, m = 0."""
    bent = np.array([[-0.4, -0.4, 0], [0.4, 0.4, 0], [0.4, -0.4, 0], [-0.4, 0.4, 0]])
    points = np.concatenate([np.linspace(a, b, 100) for a, b in pairwise(bent)])
    modulation = Modulation(table=(1, 1, 1, 0, 0, 0))
    stroke = Stroke(bent, Brush(0.1, 0.1, modulation=modulation))
    path = make_path(points, np.tile(UP, (len(points), 1)))
    on_first, on_last = on_plane(stroke, path, [0.05, 0.05], [0.05, -0.05]).amount
    assert on_first == pytest.approx(0.1, rel=1e-3)
    assert on_last == pytest.approx(0.0, abs=1e-6)


@settings(deadline=None)
@given(st.floats(0.05, 0.3), st.floats(-0.2, 0.2), st.floats(-0.4, 0.4), st.floats(0.3, 2.0))
def test_the_equator_of_a_sphere(radius, intensity, latitude, longitude):
    """Distance to the equator is the chord 2 R sin(latitude / 2); both directions are known."""
    angle = np.linspace(0, 2.5, 1025)
    normals = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    path = make_path(0.5 * normals, normals)
    stroke = Stroke(0.5 * normals[::128], Brush(radius, intensity, SKEW))
    n = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), 0])
    n[2] = np.sin(latitude)
    v = np.sin(latitude / 2)  # north is left of the way east
    expected = intensity * SKEW(v / radius)
    found = displace(stroke, path, [0.5 * n], [n])
    assert found.amount[0] == pytest.approx(expected, abs=2e-5)
    np.testing.assert_allclose(found.direction, [n])
    along = displace(replace(stroke, direction=Direction.STROKE), path, [0.5 * n], [n])
    assert along.amount[0] == pytest.approx(expected, abs=2e-5)
    np.testing.assert_allclose(
        along.direction, [[np.cos(longitude), np.sin(longitude), 0]], atol=2e-3
    )


def arc_and_around(count):
    """Unit vectors (count, 3) along an arc that no plane of symmetry holds, and 300 around it."""
    angle = np.linspace(0.2, 1.2, count)
    tilt = 0.3 + 0.5 * angle
    normals = np.stack(
        [np.cos(angle) * np.cos(tilt), np.sin(angle) * np.cos(tilt), np.sin(tilt)], axis=1
    )
    random = np.random.default_rng(1)
    n = normals[random.integers(0, count, 300)] + 0.2 * random.normal(size=(300, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return normals, n


@pytest.mark.parametrize("alpha", [None, Alpha("star", angle=25, spacing=1.3)])
@pytest.mark.parametrize("axes", ["X", "Y", "Z", "XY", "XYZ"])
@pytest.mark.parametrize("count", [1, 40])
def test_mirror_images_displace_mirrored_points_alike(alpha, axes, count):
    normals, n = arc_and_around(count)
    stroke = Stroke(0.5 * normals, Brush(0.2, 0.1, SKEW, alpha=alpha), mirror=frozenset(axes))
    original, *images = stroke.copies()
    expected = displace(original, make_path(0.5 * normals, normals), 0.5 * n, n)
    assert np.ptp(expected.amount) > 0.03
    assert len(images) == 2 ** len(axes) - 1
    for image in images:
        signs = np.sign(image.points[0]) * np.sign(original.points[0])
        found = displace(
            image, make_path(image.points, normals * signs), 0.5 * n * signs, n * signs
        )
        np.testing.assert_allclose(found.amount, expected.amount, atol=1e-9)
        np.testing.assert_allclose(found.direction, expected.direction * signs, atol=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("count", [1, 40])
def test_turned_images_displace_turned_points_alike(axis, count):
    """A dab, too, whose profile is one-sided."""
    normals, n = arc_and_around(count)
    counts = tuple(5 if k == axis else 1 for k in range(3))
    stroke = Stroke(0.5 * normals, Brush(0.2, 0.1, SKEW), radial=counts)
    original, *images = stroke.copies()
    expected = displace(original, make_path(0.5 * normals, normals), 0.5 * n, n)
    assert np.ptp(expected.amount) > 0.05
    assert len(images) == 4
    b, c = (axis + 1) % 3, (axis + 2) % 3
    for number, image in enumerate(images, 1):
        cos, sin = np.cos(2 * np.pi * number / 5), np.sin(2 * np.pi * number / 5)
        turn = np.eye(3)
        turn[b, b] = turn[c, c] = cos
        turn[b, c], turn[c, b] = -sin, sin
        path = make_path(image.points, normals @ turn.T, image=image.image)
        found = displace(image, path, 0.5 * n @ turn.T, n @ turn.T)
        np.testing.assert_allclose(found.amount, expected.amount, atol=1e-9)
        np.testing.assert_allclose(found.direction, expected.direction @ turn.T, atol=1e-9)


def test_chosen_points():
    stroke, path = straight()
    found = on_plane(stroke, path, 0, np.linspace(-0.3, 0.3, 7))
    chosen = found.relative_distance < 0.6
    part = found.where(chosen)
    np.testing.assert_array_equal(part.amount, found.amount[chosen])
    assert len(part.beyond) == len(part.direction) == chosen.sum()


GREYS = np.random.default_rng(3).integers(0, 256, (12, 12)).astype(np.uint8)
WHITE = Alpha(pixels=bytes([255]) * 16)


def rough(**words):
    return Alpha(pixels=GREYS.tobytes(), **words)


@pytest.mark.parametrize("ends", Ends)
@pytest.mark.parametrize("factors", [None, np.array([0.4, 1.0])])
def test_a_white_alpha_changes_nothing(ends, factors):
    stroke, path = straight(brush=Brush(0.2, 0.1, SKEW), ends=ends, radius_factors=factors)
    x, y = np.meshgrid(np.linspace(-0.75, 0.75, 61), np.linspace(-0.22, 0.22, 23))
    expected = on_plane(stroke, path, x, y).amount
    white = replace(stroke, brush=replace(stroke.brush, alpha=WHITE))
    np.testing.assert_allclose(on_plane(white, path, x, y).amount, expected, atol=1e-12)


def test_an_alpha_lies_in_the_stroke_with_its_top_ahead():
    """d = s b(v) alpha(u, v), also around the ends; lengths in radii of the stroke."""
    alpha = rough(spacing=2.5, angle=15)
    stroke, path = straight(brush=Brush(0.2, 0.1, SKEW, alpha=alpha))  # 5 radii: 3 images
    x, y = np.meshgrid(np.linspace(-0.7, 0.7, 57), np.linspace(-0.19, 0.19, 20))
    x, y = x.ravel(), y.ravel()
    plain = on_plane(replace(stroke, brush=Brush(0.2, 0.1, SKEW)), path, x, y).amount
    ahead, left = (x + 0.5) / 0.2, y / 0.2
    images = [alpha(ahead - 2.5 * number, left) for number in range(-1, 4)]
    expected = plain * np.maximum.reduce(images)
    np.testing.assert_allclose(on_plane(stroke, path, x, y).amount, expected, atol=1e-9)
    assert np.abs(expected - plain).max() > 0.02


def test_the_alpha_of_a_dab_lies_in_its_frame():
    alpha = rough()
    stroke = Stroke(np.zeros((1, 3)), Brush(0.2, 0.1, alpha=alpha))
    path = make_path([[0, 0, 0]], [UP])
    x, y = np.random.default_rng(1).uniform(-0.14, 0.14, (2, 200))
    ahead = (x * path.tangents[0, 0] + y * path.tangents[0, 1]) / 0.2
    left = (x * path.laterals[0, 0] + y * path.laterals[0, 1]) / 0.2
    expected = 0.1 * quintic(np.hypot(x, y) / 0.2) * alpha(ahead, left)
    np.testing.assert_allclose(on_plane(stroke, path, x, y).amount, expected, atol=1e-9)


def test_pressure_makes_images_narrower_and_leaves_them_as_far_apart():
    alpha = Alpha("rivet", spacing=2.5)
    half = np.array([0.5, 1.0])
    stroke, path = straight(brush=Brush(0.2, 0.1, alpha=alpha), radius_factors=half)
    middles = on_plane(stroke, path, [-0.5, 0.0, 0.5], 0).amount
    np.testing.assert_allclose(middles, 0.1, rtol=1e-6)
    assert on_plane(stroke, path, [-0.25, 0.25], 0).amount == pytest.approx(0, abs=1e-12)
    beside = on_plane(stroke, path, [-0.5, 0.5], [0.05, 0.1]).amount  # half of each radius
    np.testing.assert_allclose(beside[0], beside[1], rtol=1e-6)


def test_the_row_of_a_closed_stroke_joins():
    angle = np.linspace(0, 2 * np.pi, 513)
    ring = 0.5 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    path = make_path(ring, np.tile(UP, (513, 1)), closed=True)
    brush = Brush(0.1, 0.1, alpha=rough(spacing=2.0))  # 31.4 radii: 16 images
    stroke = Stroke(ring[:-1:32], brush, closed=True)
    turn = np.array([-1e-6, 1e-6, 0.1, 0.1 + 2 * np.pi / 16, 0.1 + 10 * np.pi / 16])
    for radius, corner in ((0.45, 2e-3), (0.5, 1e-5), (0.53, 1e-5)):  # of the path, on its inside
        found = on_plane(stroke, path, radius * np.cos(turn), radius * np.sin(turn)).amount
        assert found[0] == pytest.approx(found[1], abs=corner)
        assert found[3:] == pytest.approx(found[2], abs=2e-4)
