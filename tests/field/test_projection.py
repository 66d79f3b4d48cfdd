# SPDX-License-Identifier: GPL-3.0-or-later
"""Projection onto planes, spheres and surfaces of networks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.projection import project
from tests.field.analytic import ball, ellipsoid, plane
from tests.field.networks import MODELS, network_of


def test_onto_a_plane():
    normal = np.array([0.6, 0, 0.8])
    x = np.random.default_rng(0).uniform(-0.2, 0.2, (500, 3))
    found = project(plane(normal, 0.1), x)
    way = x @ normal - 0.1
    np.testing.assert_allclose(found.points, x - way[:, None] * normal, atol=2e-6)
    np.testing.assert_allclose(found.normals, np.tile(normal, (500, 1)), atol=1e-6)
    assert found.distance.max() < 1e-3  # before the last step


@settings(deadline=None)
@given(st.floats(0.2, 0.7), st.floats(-0.1, 0.1), st.integers(0, 1000))
def test_onto_a_ball_along_its_radius(radius, away, seed):
    direction = np.random.default_rng(seed).normal(size=(50, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    found = project(ball(radius), (radius + away) * direction)
    np.testing.assert_allclose(found.points, radius * direction, atol=4e-5)
    np.testing.assert_allclose(found.normals, direction, atol=2e-4)
    assert found.points.dtype == np.float32


def test_the_step_is_capped():
    x = np.array([[0.9, 0, 0]])
    for steps, expected in ((1, 0.8), (2, 0.7), (6, 0.5)):
        found = project(ball(0.5), x, steps=steps, reach=0.1).points
        np.testing.assert_allclose(found, [[expected, 0, 0]], atol=2e-3)


def test_a_flat_field_gives_short_steps_not_huge_ones():
    """At the centre of a ball the gradient vanishes: Newton's step would be infinite."""
    found = project(ball(0.5), [[1e-4, 0, 0], [0, 0, 0]])
    assert np.isfinite(found.points).all()
    assert np.abs(found.points).max() < 1


def test_points_on_the_surface_stay():
    x = project(ball(0.5), np.random.default_rng(1).normal(size=(100, 3)) * 0.3, steps=12).points
    again = project(ball(0.5), x)
    np.testing.assert_allclose(again.points, x, atol=1e-5)
    np.testing.assert_allclose(again.normals, x / 0.5, atol=1e-4)


def test_onto_an_ellipsoid():
    axes = np.array([0.7, 0.4, 0.3])
    direction = np.random.default_rng(2).normal(size=(300, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    found = project(ellipsoid(axes), 1.05 * direction * axes)
    np.testing.assert_allclose(((found.points / axes) ** 2).sum(axis=1), 1, atol=2e-4)
    normals = found.points / axes**2
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(found.normals, normals, atol=5e-4)


def test_no_points():
    found = project(ball(), np.empty((0, 3)))
    assert [len(part) for part in found] == [0, 0, 0]


def test_the_given_points_are_left_as_they_are():
    x = np.full((3, 3), 0.35, np.float32)
    project(ball(), x)
    assert (x == np.float32(0.35)).all()


@pytest.mark.parametrize("model", MODELS)
def test_onto_surfaces_of_networks(model):
    """Points near the surface arrive where f = 0, by little more than |f| / |grad f|."""
    field = network_of(model)
    random = np.random.default_rng(4)
    x = random.uniform(-0.9, 0.9, (60_000, 3)).astype(np.float32)
    f, gradient = values_and_gradients(field, x)
    estimate = np.abs(f) / np.linalg.norm(gradient, axis=1)
    near = estimate < 0.02
    found = project(field, x[near])
    settled = found.distance < 1e-4
    assert settled.mean() > 0.99
    assert np.abs(values(field, found.points[settled])).max() < 2e-4
    way = np.linalg.norm(found.points - x[near], axis=1)[settled]
    assert np.median(np.abs(way - estimate[near][settled])) < 1e-3
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-5)
