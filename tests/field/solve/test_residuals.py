# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver asks for beside the displaced surface, against a surface in closed form."""

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree

from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.solve import residuals
from neural_sculpt_addon.field.solve.residuals import draw, signed_distances
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke

RADIUS, INTENSITY = 0.25, 0.06
PEAKS = Profile(points=tuple((-1 + k / 7, k % 2) for k in range(15)))


@pytest.mark.parametrize("profile", [Profile("quintic"), PEAKS])
def test_values_beside_ridges_are_their_signed_distance(preparation, profile):
    """A belt around a sphere: a surface of revolution whose radius depends on the latitude."""
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    stroke = Stroke(points, Brush(RADIUS, INTENSITY, profile), closed=True)
    problem, random = pose(preparation, stroke), np.random.default_rng(0)
    (tube,) = problem.tubes(200, 120, random)
    rim = problem.rim(2.2, 5000, random)
    amount = tube.displacement.amount
    found, distance = signed_distances(problem, tube.target, amount, rim, 3000, random)

    def radius(latitude):
        return 0.5 + INTENSITY * profile(2 * 0.5 * np.sin(latitude / 2) / RADIUS)

    latitude = np.linspace(-1.5, 1.5, 100_000)
    curve = radius(latitude)[:, None] * np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    x, y, z = found.astype(float).T
    away = np.hypot(np.hypot(x, y), z)
    true = KDTree(curve).query(np.stack([np.hypot(x, y), z], axis=1))[0]
    true = np.copysign(true, away - radius(np.arcsin(z / away)))
    sure = np.abs(true) > 1e-3
    assert (np.sign(distance) == np.sign(true))[sure].mean() > 0.99
    assert np.abs(distance - true).mean() < 1e-3


def radius_after(points, stroke):
    """Of a belt around the ball of radius 1/2, at the latitudes of `points`."""
    latitude = np.arcsin(points[:, 2] / np.linalg.norm(points, axis=1))
    v = 2 * 0.5 * np.sin(latitude / 2) / stroke.brush.radius
    return 0.5 + stroke.brush.intensity * np.where(np.abs(v) < 1, stroke.brush.profile(v), 0)


def test_residuals_ask_for_the_displaced_surface_and_keep_the_rest(preparation, sculpted):
    """By the closed form of a ball with a belt, whose field is (|x|^2 - R^2) / (2 R)."""
    on_values, on_slopes = draw(sculpted.problem)
    points, targets, weights = (array.numpy() for array in on_values[:3])
    length = np.linalg.norm(points, axis=1)
    surface = np.abs(length - radius_after(points, sculpted.stroke)) < 2e-3
    before = length**2 - 0.25
    tube = weights == 1
    assert tube.sum() > 500 and np.abs(targets[tube]).max() == 0
    assert surface[tube].mean() > 0.98
    kept = weights == np.float32(residuals.PRESERVE_WEIGHT)
    assert kept.sum() == residuals.PRESERVE_ROWS
    assert np.abs(targets - before)[kept].max() < 2e-3
    far = (weights < 1) & (np.abs(length - 0.5) > 0.2)
    assert far.any()
    assert np.abs(targets - before)[far].max() < 2e-3
    assert on_slopes.directions is not None
    torch.testing.assert_close(on_slopes.directions.norm(dim=1), torch.ones(len(on_slopes.points)))
    at = on_slopes.points.numpy()
    assert (np.abs(np.linalg.norm(at, axis=1) - radius_after(at, sculpted.stroke)) < 2e-3).all()


def test_equal_seeds_draw_equal_residuals(preparation):
    points = np.array([[0.5, 0, 0], [0.48, 0.14, 0]])
    drawn = [
        draw(pose(preparation, Stroke(points, Brush(0.1, 0.02), seed=seed))) for seed in (1, 1, 2)
    ]
    first, again, other = (on_values.points for on_values, _ in drawn)
    assert torch.equal(first, again)
    assert first.shape != other.shape or not torch.equal(first, other)


def test_a_stroke_over_everything_has_nothing_to_preserve(preparation):
    """No rim, no untouched surface, no box far from it."""
    points = 0.5 * np.stack([np.cos(t := np.linspace(0, 6, 30)), np.sin(t), 0 * t], 1)
    on_values, on_slopes = draw(pose(preparation, Stroke(points, Brush(0.9, 0.02), closed=True)))
    assert len(on_values.points) >= 500 and len(on_slopes.points) >= 100
    assert all(torch.isfinite(array).all() for array in on_values[:3])
