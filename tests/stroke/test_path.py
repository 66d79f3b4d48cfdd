# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames along paths on shapes known in closed form, and the place of points in a stroke."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.stroke.path import locate, make_path


def plane(a, b):
    return np.stack([a, b, 0 * a], axis=-1), np.tile([0.0, 0, 1], (len(a), 1))


def sphere(a, b):
    n = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=-1)
    return 0.5 * n, n


def torus(a, b):
    n = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=-1)
    return np.stack([0.5 * np.cos(a), 0.5 * np.sin(a), 0 * a], axis=-1) + 0.15 * n, n


SURFACES = {"plane": plane, "sphere": sphere, "torus": torus}


def assert_frames(path):
    """Unit, orthogonal, right-handed: v = n x u, so u x v = n."""
    for vectors in (path.tangents, path.laterals, path.normals):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(np.cross(path.normals, path.tangents), path.laterals, atol=1e-9)
    np.testing.assert_allclose(np.sum(path.normals * path.tangents, axis=1), 0, atol=1e-9)


def assert_no_flips(path):
    assert (np.sum(path.laterals[1:] * path.laterals[:-1], axis=1) > 0).all()


@pytest.mark.parametrize("name", SURFACES)
def test_frames_along_smooth_strokes(name):
    t = np.linspace(0, 1, 257)
    points, normals = SURFACES[name](2 * t, 0.7 * np.sin(5 * t))
    path = make_path(points, normals)
    assert_frames(path)
    assert_no_flips(path)
    ahead = np.sum(path.tangents[:-1] * np.diff(points, axis=0), axis=1)
    assert (ahead > 0).all()
    steps = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    assert path.length == pytest.approx(steps.sum())
    np.testing.assert_allclose(path.u, np.append(0, np.cumsum(steps)) / steps.sum(), atol=1e-12)


def test_v_is_left_of_an_artist_who_sees_n_pointing_at_them():
    points, normals = plane(np.linspace(0, 1, 5), np.zeros(5))  # along +x, seen from +z
    path = make_path(points, normals)
    np.testing.assert_allclose(path.tangents, [[1, 0, 0]] * 5)
    np.testing.assert_allclose(path.laterals, [[0, 1, 0]] * 5)


def test_frames_on_the_equator():
    angle = np.linspace(0, np.pi / 2, 91)
    path = make_path(*sphere(angle, 0 * angle))
    expected = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    np.testing.assert_allclose(path.tangents, expected, atol=1e-3)
    np.testing.assert_allclose(path.laterals, [[0, 0, 1]] * 91, atol=1e-9)
    assert path.length == pytest.approx(np.pi / 4, rel=1e-4)


@settings(deadline=None)
@given(
    st.sampled_from(sorted(SURFACES)),
    st.integers(0, 2**32 - 1),
    st.floats(0, 0.4),
    st.floats(-3, 3),
    st.floats(-1, 1),
)
def test_noise_flips_no_frame(name, seed, noise, start, slope):
    """Points shaken sideways by less than their spacing: the direction of travel stays."""
    random = np.random.default_rng(seed)
    t = np.linspace(0, 1, 60)
    shake = noise * t[1] * random.uniform(-1, 1, (2, 60))
    points, normals = SURFACES[name](start + t + shake[0], slope * t + shake[1])
    tilted = normals + 0.3 * random.uniform(-1, 1, normals.shape)
    path = make_path(points, tilted)
    assert_frames(path)
    assert_no_flips(path)


def test_a_point_where_the_stroke_stands_still_takes_its_neighbours_frame():
    x = np.array([0, 0.1, 0.2, 0.2, 0.2, 0.3, 0.4])
    path = make_path(*plane(x, 0 * x))
    assert_frames(path)
    np.testing.assert_allclose(path.laterals, [[0, 1, 0]] * 7, atol=1e-12)


def test_a_point_where_the_stroke_runs_along_the_normal_takes_its_neighbours_frame():
    x = np.linspace(0, 1, 11)
    points, normals = plane(x, 0 * x)
    normals[5] = [1, 0, 0]
    path = make_path(points, normals)
    assert_frames(path)
    np.testing.assert_allclose(path.laterals, [[0, 1, 0]] * 11, atol=1e-9)


def test_closed_frames_join():
    angle = np.linspace(0, 2 * np.pi, 129)
    points, normals = torus(angle, 0.5 + 0 * angle)
    points[-1], normals[-1] = points[0], normals[0]
    path = make_path(points, normals, closed=True)
    assert path.closed
    assert_frames(path)
    assert_no_flips(path)
    np.testing.assert_allclose(path.laterals[-1], path.laterals[0], atol=1e-9)
    np.testing.assert_allclose(path.tangents[0], [0, 1, 0], atol=1e-9)
    assert not locate(path, points + 0.01).beyond.any()


@pytest.mark.parametrize("normal", [[0, 0, 1], [1, 0, 0], [0.6, -0.64, 0.48], [-0.1, 0.7, 0.7]])
def test_a_dab_has_a_frame_and_is_beyond_everywhere(normal):
    path = make_path([[0.1, 0.2, 0.3]], [normal])
    assert_frames(path)
    assert (path.length, path.u.tolist()) == (0, [0])
    around = path.points + 0.05 * np.vstack([path.laterals, -path.laterals, path.tangents])
    place = locate(path, around)
    assert place.beyond.all()
    np.testing.assert_allclose(place.distance, 0.05)
    np.testing.assert_allclose(place.sine, [1, -1, 0], atol=1e-9)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("normal", [[0.1, 0.7, 0.71], [-0.6, 0.64, 0.48], [0.5, -0.1, -0.86]])
def test_mirrored_dabs_have_mirrored_frames(axis, normal):
    """As of any stroke: u is mirrored, so v = n x u is mirrored and turned round."""
    mirror = np.ones(3)
    mirror[axis] = -1
    one, other = make_path([[0.1, 0.2, 0.3]], [normal]), make_path([[0, 0, 0]], [mirror * normal])
    np.testing.assert_allclose(other.tangents, mirror * one.tangents, atol=1e-12)
    np.testing.assert_allclose(other.laterals, -mirror * one.laterals, atol=1e-12)


def brute_force(points, x):
    """Distance of each x (M, 3) from a polyline, by all of its segments."""
    a, chord = points[:-1], np.diff(points, axis=0)
    t = ((x[:, None] - a) * chord).sum(axis=2) / (chord**2).sum(axis=1)  # (M, N - 1)
    nearest = a + np.clip(t, 0, 1)[..., None] * chord
    return np.linalg.norm(x[:, None] - nearest, axis=2).min(axis=1)


@settings(deadline=None, max_examples=60)
@given(st.sampled_from(sorted(SURFACES)), st.integers(0, 2**32 - 1), st.floats(0.5, 9))
def test_locate_finds_the_nearest_point(name, seed, bend):
    random = np.random.default_rng(seed)
    t = np.linspace(0, 1, 65)
    path = make_path(*SURFACES[name](np.sin(bend * t), np.cos(1.3 * bend * t) - 1))
    x = path.points[random.integers(0, 65, 30)] + 0.1 * random.uniform(-1, 1, (30, 3))
    place = locate(path, x)
    true = brute_force(path.points, x)
    spacing = np.linalg.norm(np.diff(path.points, axis=0), axis=1).max()
    assert (place.distance >= true - 1e-9).all()
    # The nearest vertex decides the segment: where passes cross, that may miss by little.
    assert (place.distance**2 <= true**2 + (spacing / 2) ** 2 + 1e-9).all()
    assert np.mean(place.distance < true + 5e-4) > 0.7


def test_a_closed_path_has_no_seam():
    angle = np.linspace(0, 2 * np.pi, 33)
    points, normals = sphere(angle, 0 * angle)
    points[-1], normals[-1] = points[0], normals[0]
    path = make_path(points, normals, closed=True)
    beside = np.linspace(-0.15, 0.15, 61)
    x, _ = sphere(beside, 0.1 + 0 * beside)
    place = locate(path, x)
    np.testing.assert_allclose(place.distance, brute_force(path.points, x), atol=1e-6)
    # A place on a chord differs from the one on its arc by a little.
    ahead = place.u - beside / (2 * np.pi)
    np.testing.assert_allclose(ahead - np.round(ahead), 0, atol=1e-4)
    np.testing.assert_allclose(place.sine, 1)


@pytest.mark.parametrize("radius", [0.3, 0.6, 0.98, 1.1, 1.6])
def test_places_beside_a_bend_have_no_jumps(radius):
    """On a circle about the path's middle a place is its angle, inside of the bend and outside."""
    path = make_path(*plane(*circle(np.linspace(0, np.pi, 65))))
    angle = np.linspace(0.2, np.pi - 0.2, 5000)
    place = locate(path, plane(*(radius * xy for xy in circle(angle)))[0])
    np.testing.assert_allclose(place.u, angle / np.pi, atol=1e-5)
    np.testing.assert_allclose(np.diff(place.u), np.diff(angle / np.pi), rtol=0.01)
    np.testing.assert_allclose(place.distance, abs(1 - radius), atol=1e-3)


def circle(angle):
    """x and y at angles (N,) of the unit circle."""
    return np.cos(angle), np.sin(angle)


def test_places_beside_a_straight_stroke():
    t = np.linspace(0, 2, 21)
    path = make_path(*plane(t, 0 * t))
    x = [[0.5, 0.3, 0], [1.25, -0.4, 0], [2, 0.1, 0], [0.77, 0, 0]]
    place = locate(path, x)
    np.testing.assert_allclose(place.u, [0.25, 0.625, 1, 0.385])
    np.testing.assert_allclose(place.distance, [0.3, 0.4, 0.1, 0], atol=1e-12)
    np.testing.assert_allclose(place.sine[:3], [1, -1, 1])
    assert not place.beyond.any()
    np.testing.assert_allclose(place.normals, [[0, 0, 1]] * 4)


def test_places_around_the_ends():
    t = np.linspace(0, 2, 21)
    path = make_path(*plane(t, 0 * t))
    angle = np.radians([-90, -60, 0, 30, 90])
    x = 0.1 * np.stack([-np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    for points, u in ((x, 0.0), ([2, 0, 0] + x * [-1, 1, 1], 1.0)):
        place = locate(path, points)
        np.testing.assert_allclose(place.u, u, atol=1e-9)
        np.testing.assert_allclose(place.distance, 0.1)
        np.testing.assert_allclose(place.sine, np.sin(angle), atol=1e-9)
        assert place.beyond[1:4].all()


def test_a_bend_is_left_along_the_tangent_of_its_own_end():
    """A quarter of a circle, whose tangents at the ends are across each other."""
    t = np.linspace(0, np.pi / 2, 65)
    path = make_path(*plane(np.cos(t), np.sin(t)))
    place = locate(path, [[1, -0.1, 0], [0.95, -0.1, 0], [-0.1, 1, 0], [-0.1, 0.95, 0]])
    assert place.beyond.all()
    np.testing.assert_allclose(place.u, [0, 0, 1, 1], atol=1e-9)
    np.testing.assert_allclose(place.cosine[[0, 2]], [-1, 1], atol=0.02)
    np.testing.assert_allclose(place.sine[[1, 3]], 1 / np.sqrt(5), atol=0.02)  # left: inward


def test_many_points_are_located_like_few():
    t = np.linspace(0, 1, 33)
    path = make_path(*sphere(3 * t, np.sin(4 * t)))
    x = np.random.default_rng(0).uniform(-1, 1, (20_001, 3))
    whole, part = locate(path, x), locate(path, x[8190:8195])
    np.testing.assert_allclose(whole.u[8190:8195], part.u)
    np.testing.assert_allclose(whole.distance[8190:8195], part.distance)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("mirrored", range(3))
def test_rounding_does_not_turn_a_dab_on_a_flat_face(axis, side, mirrored):
    """Normals as projection onto a fitted box leaves them; also those of mirror images."""
    upright = side * np.eye(3)[axis]
    image = np.eye(3)
    image[mirrored, mirrored] = -1
    exact, reflected = (
        make_path(np.zeros((1, 3)), [upright @ turned], image=turned).tangents[0]
        for turned in (np.eye(3), image)
    )
    np.testing.assert_allclose(reflected, exact @ image, atol=1e-9)
    noise = np.random.default_rng(0).normal(0, 1e-3, (50, 3))
    for each in upright + noise:
        normal = [each / np.linalg.norm(each)]
        found = make_path(np.zeros((1, 3)), normal).tangents[0]
        assert found @ exact > 0.99
