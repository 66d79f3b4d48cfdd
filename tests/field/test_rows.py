# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver asks for beside the displaced surface, against a surface in closed form."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from neural_sculpt_addon.field.problem import pose
from neural_sculpt_addon.field.solvers.gauss_newton import FIRST, REFINE
from neural_sculpt_addon.field.solvers.rows import Sampler, _around
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
    found, distance = _around(problem, tube.target, tube.displacement.amount, rim, 3000, random)

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


def sampler(preparation, points, radius, mix):
    stroke = Stroke(np.array(points), Brush(radius, 0.02))
    return Sampler(pose(preparation, stroke), mix)


@pytest.mark.parametrize("course", [FIRST, REFINE])
def test_every_stroke_has_as_many_rows(preparation, course):
    """What is compiled for one stroke is of use to all others."""
    strokes = [
        ([[0.5, 0, 0]], 0.02),
        ([[0.5, 0, 0], [0.48, 0.14, 0]], 0.01),
        ([[0.5, 0, 0], [0, 0.5, 0], [-0.5, 0, 0]], 0.4),
    ]
    for part in {share for share, _ in course.steps}:
        drawn = [sampler(preparation, *stroke, course.mix).draw(part) for stroke in strokes]
        assert len({(len(rows.points), rows.values, rows.near) for rows in drawn}) == 1


def test_the_error_is_that_of_samples_that_are_never_trained_on(preparation):
    found = sampler(preparation, [[0.5, 0, 0], [0, 0.5, 0]], 0.1, FIRST.mix)
    held_out = {tuple(point) for point in found._held_out.tolist()}
    drawn = {tuple(point) for _ in range(20) for point in found.draw(1.0).points.tolist()}
    assert len(held_out) > 100
    assert not held_out & drawn
    asked = {tuple(point) for point in found.asked.displaced.tolist()}
    assert held_out < asked
