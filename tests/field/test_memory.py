# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory across edits, on balls whose surface after a stroke is known, and at work."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from neural_sculpt_addon.field.edit import edit
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.memory import follow
from neural_sculpt_addon.field.pieces import components
from neural_sculpt_addon.field.problem import pose
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.field.proxy import extract
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball

RAISED = 0.1


@pytest.fixture(scope="module")
def belt(preparation):
    """A band of the ball of radius 1/2, raised by RAISED all over."""
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    stroke = Stroke(points, Brush(0.2, RAISED, Profile(table=(1, 1))), closed=True)
    return pose(preparation, stroke)


@pytest.fixture(scope="module")
def after(belt):
    edited = ball(0.49)  # whatever the network made of it
    return follow(belt, edited, extract(edited, 32))


@pytest.fixture(scope="module")
def old(preparation, after):
    """Which samples after the stroke there were before."""
    before = {point.tobytes() for point in preparation.surface.points}
    return np.array([point.tobytes() in before for point in after.surface.points])


def test_what_was_not_touched_stays_where_it_was(preparation, belt, after, old):
    kept = belt.untouched(preparation.surface)
    assert 0.3 < kept.mean() < 0.7
    for before, now in (
        (preparation.surface, after.surface),
        (preparation.shell, after.shell),
    ):
        for there, here in zip(before, now, strict=True):
            np.testing.assert_array_equal(here[old], there[kept])


def test_samples_are_in_spatial_order(after):
    """Every eighth one covers the surface nearly as well as eight times fewer would."""
    points = after.surface.points
    gap = KDTree(points[::8]).query(points)[0]
    even = np.sqrt(4 * np.pi * 0.6**2 / (len(points) / 8))
    assert gap.max() < 2.5 * even


def test_under_the_stroke_samples_are_displaced_and_as_dense_as_before(preparation, after, old):
    """A sphere that grows by a fifth has 1.44 times the area, and so many samples."""
    kept = old.sum()
    points, normals = after.surface.where(~old)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.5 + RAISED, atol=1e-4)
    inside = np.abs(points[:, 2]) < 0.2  # away from the step at the edge of the band
    radial = points / np.linalg.norm(points, axis=1, keepdims=True)
    assert (normals * radial).sum(axis=1)[inside].min() > 0.999
    moved = len(preparation.surface.points) - kept
    assert inside.sum() / moved == pytest.approx(1.44 * inside.mean(), rel=0.03)
    # Archimedes: heights on a sphere are uniform, also of the samples that were added
    heights = np.sort(points[inside][:, 2])
    even = np.linspace(heights[0], heights[-1], len(heights))
    assert np.abs(heights - even).max() < 0.01


def test_beside_displaced_samples_the_distance_is_that_of_the_displaced_surface(after, old):
    points, distance = after.shell.where(~old)
    inside = np.abs(points[:, 2]) < 0.15
    true = np.linalg.norm(points, axis=1) - (0.5 + RAISED)
    assert np.percentile(np.abs(distance - true)[inside], 99) < 1e-3


def test_the_box_keeps_its_values_but_near_the_stroke(preparation, belt, after):
    near = belt.distance(preparation.box.points) < 2
    now = values(after.network, preparation.box.points)
    np.testing.assert_allclose(after.box.values[near], now[near], atol=1e-5)
    np.testing.assert_array_equal(after.box.values[~near], preparation.box.values[~near])
    assert 0 < near.sum() < len(near)


def test_several_edits_do_not_wander_from_what_was_asked_for(ready):
    """Crossing strokes on a sphere; scripts/benchmark.py edit --sequence 20 draws more."""
    preparation = ready
    for seed, turn in enumerate((0.0, 0.8, 1.6, 2.4)):
        u = np.linspace(-0.4, 0.4, 9)
        across = np.array([-np.sin(turn), np.cos(turn), 0])
        points = np.cos(u)[:, None] * [0, 0, 0.6] + 0.6 * np.sin(u)[:, None] * across
        found = extract(preparation.network)  # the artist draws on what they see
        points = [found.vertices[np.argmin(((found.vertices - p) ** 2).sum(1))] for p in points]
        stroke = Stroke(np.array(points), Brush(0.12, 0.04 * (-1) ** seed), seed=seed)
        preparation = edit(
            preparation.network, [stroke], solver="quick", preparation=preparation
        ).preparation
    found = find_surface(preparation.network, preparation.surface.points)
    assert found.distance.mean() < 1e-3
    assert np.abs(found.slope - 1).mean() < 0.08
    assert components(preparation.proxy) == 1
