# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that smooth, flatten and pinch."""

from dataclasses import replace

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.checkpoint import load
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.edit.fairing import PINCHED, faired, goals
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import Level, cells_of, dilated, distinct, quantised, support
from neural_sculpt_addon.field.levels import linear as number
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.path import make_path
from neural_sculpt_addon.stroke.stroke import Kind, Stroke
from tests.field.analytic import ball
from tests.field.networks import PACKED

RADIUS = 0.5
ROUGHNESS, LEVEL = 4e-3, 6


@pytest.fixture(scope="module")
def smooth():
    return prepare(ball(RADIUS))


@pytest.fixture(scope="module")
def rough(smooth):
    """The ball with random bumps, two cells of level 6 wide and more."""
    points = smooth.surface.points
    cells = dilated(distinct(cells_of(points, LEVEL), LEVEL), LEVEL)
    height = np.random.default_rng(11).uniform(-ROUGHNESS, ROUGHNESS, len(cells))
    return prepare(smooth.field.plus({LEVEL: Level(cells, quantised(height))}))


def meridian(kind, strength=1.0, radius=0.1, **given):
    angle = np.linspace(-0.4, 0.4, 9)
    points = RADIUS * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    return Stroke(points, Brush(radius, strength), kind=kind, **given)


def grid(size, step):
    """A square of points (N, 3) in the plane z = 0 around the origin, and its triangles."""
    axis = step * (np.arange(size) - (size - 1) / 2)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    place = np.arange(size * size).reshape(size, size)
    a, b, c, d = place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return points, triangles.astype(np.int64)


def band(height=0.25):
    """Directions (N, 3) around the middle of the meridian, well within the stroke."""
    random = np.random.default_rng(3)
    angle, away = random.uniform(-height, height, 400), random.uniform(-0.05, 0.05, 400)
    points = np.stack([np.cos(angle), away, np.sin(angle)], axis=1)
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def relief(field):
    """Deviation of the surface from the ball within the stroke, root mean square."""
    found = project(field, (RADIUS * band()).astype(np.float32)).points
    return float(np.sqrt(np.mean((np.linalg.norm(found, axis=1) - RADIUS) ** 2)))


@pytest.mark.parametrize("waves", [0.5, 1.0, 2.0])
def test_fairing_damps_waves_as_the_formula_says(waves):
    """Small waves z = a sin(k x) over a plane keep 1 / (1 + (s k)^4) of their height."""
    scale, height = 0.1, 1e-4
    points, triangles = grid(121, 0.02)
    k = waves / scale
    points[:, 2] = height * np.sin(k * points[:, 0])
    inner = np.abs(points[:, :2]).max(axis=1) < 0.5
    found = faired(points, triangles, scale)[inner, 2]
    expected = points[inner, 2] / (1 + (scale * k) ** 4)
    np.testing.assert_allclose(found, expected, atol=0.02 * height)


def test_fairing_does_not_shrink_a_ball(smooth):
    proxy = smooth.proxy
    points = faired(proxy.vertices.astype(float), proxy.triangles.astype(np.int64), 0.025)
    radius = np.linalg.norm(points, axis=1)
    assert abs(radius.mean() - RADIUS) < 1e-4
    assert radius.std() < 1e-4


def test_smoothing_takes_bumps_away_and_leaves_the_ball(rough):
    """Of the relief of other random bumps 18 to 29 % are left: their widest waves."""
    edit = sculpt(rough, meridian(Kind.SMOOTH))
    assert relief(rough.field) > 8e-4
    assert relief(edit.field) < 0.4 * relief(rough.field)
    assert components(extract(edit.field, 256)) == 1
    report = edit.report()
    assert report["tolerance_met"]
    assert report["tube_p95"] < 1e-4
    before = replace(edit, field=edit.problem.field, proxy=edit.problem.preparation.proxy)
    assert report["gain"] == pytest.approx(1, abs=0.03)
    assert before.report()["gain"] == pytest.approx(0, abs=0.01)


@pytest.mark.long
def test_weaker_smoothing_takes_a_part(rough):
    left = relief(sculpt(rough, meridian(Kind.SMOOTH, 0.5)).field) / relief(rough.field)
    assert 0.4 < left < 0.75


def test_a_negative_strength_enhances(rough):
    assert relief(sculpt(rough, meridian(Kind.SMOOTH, -0.5)).field) > 1.2 * relief(rough.field)


@pytest.mark.parametrize("kind", [Kind.SMOOTH, Kind.FLATTEN, Kind.PINCH])
def test_nothing_changes_outside_of_the_support(rough, kind):
    edit = sculpt(rough, meridian(kind))
    points = np.random.default_rng(5).uniform(-0.7, 0.7, (20_000, 3)).astype(np.float32)
    outside = points[~np.isin(number(cells_of(points, 5), 5), support(edit.layer))]
    assert len(outside) > 10_000
    np.testing.assert_array_equal(values(edit.field, outside), values(rough.field, outside))


def test_flattening_a_ball_makes_a_facet(smooth):
    """The middle of a dab goes to the plane, a ring around it the profile's share of the way."""
    dab = Stroke(np.array([[RADIUS, 0, 0]]), Brush(0.2, 1.0), kind=Kind.FLATTEN)
    edit = sculpt(smooth, dab)
    turn, away = np.linspace(0, 2 * np.pi, 32, endpoint=False), 0.05
    start = np.sqrt(RADIUS**2 - away**2)
    ring = np.stack([start + 0 * turn, away * np.cos(turn), away * np.sin(turn)], axis=1)
    plane, found = (
        project(edit.field, np.asarray(p, np.float32)).points[:, 0].mean()
        for p in ([[RADIUS, 0, 0]], ring)
    )
    share = 1 - 10 * 0.25**3 + 15 * 0.25**4 - 6 * 0.25**5  # quintic, at a quarter of the radius
    assert plane < start - 5e-3
    assert found == pytest.approx(start + share * (plane - start), abs=2e-4)


def test_pinching_goes_half_of_the_way_to_the_path():
    points, triangles = grid(41, 0.01)
    x = np.linspace(-0.3, 0.3, 31)
    path = make_path(np.stack([x, 0 * x, 0 * x], axis=1), np.tile([0.0, 0.0, 1.0], (31, 1)))
    surface = Samples(points.astype(np.float32), np.tile(np.float32([0, 0, 1]), (len(points), 1)))
    found = goals(Kind.PINCH, path, 0.1, surface, triangles)
    expected = points * [1, 1 - PINCHED, 1]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_mirror_images_are_smoothed_alike(rough, smooth):
    """On the ball, whose two sides are alike."""
    one = np.array([[0.3, 0.4, 0.0], [0.3, 0.38, 0.12], [0.3, 0.35, 0.2]])
    one *= RADIUS / np.linalg.norm(one, axis=1, keepdims=True)
    stroke = Stroke(one, Brush(0.08, 1.0), kind=Kind.FLATTEN, mirror=frozenset("X"))
    field = sculpt(smooth, stroke).field
    points = (one + np.random.default_rng(2).normal(0, 0.03, (50, 1, 3))).reshape(-1, 3)
    points = points.astype(np.float32)
    np.testing.assert_allclose(values(field, points), values(field, points * [-1, 1, 1]), atol=1e-3)
    assert np.abs(values(field, points) - values(smooth.field, points)).max() > 1e-3


def test_turned_images_are_smoothed_alike(smooth):
    one = np.array([[0.3, 0.4, 0.0], [0.3, 0.38, 0.12], [0.3, 0.35, 0.2]])
    one *= RADIUS / np.linalg.norm(one, axis=1, keepdims=True)
    stroke = Stroke(one, Brush(0.08, 1.0), kind=Kind.FLATTEN, radial=(1, 1, 3))
    field = sculpt(smooth, stroke).field
    points = (one + np.random.default_rng(2).normal(0, 0.03, (50, 1, 3))).reshape(-1, 3)
    cos, sin = -0.5, 3**0.5 / 2
    turned = points @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    np.testing.assert_allclose(values(field, points), values(field, turned), atol=1e-3)
    assert np.abs(values(field, points) - values(smooth.field, points)).max() > 1e-3


@pytest.mark.long
def test_the_same_stroke_gives_the_same_bits(rough):
    layers = [sculpt(rough, meridian(Kind.SMOOTH)).layer for _ in range(2)]
    assert layers[0].keys() == layers[1].keys()
    for level, part in layers[0].items():
        np.testing.assert_array_equal(part.index, layers[1][level].index)
        np.testing.assert_array_equal(part.values, layers[1][level].values)


def test_without_strength_it_is_refused(rough):
    with pytest.raises(SculptError, match="changes nothing"):
        sculpt(rough, meridian(Kind.SMOOTH, 0.0))


@pytest.mark.parametrize("solver", ["network", "paper"])
def test_other_solvers_refuse(smooth, solver):
    with pytest.raises(SculptError, match="Use the solver local"):
        sculpt(smooth, meridian(Kind.SMOOTH), solver=solver)


def test_beyond_a_sharp_edge_nothing_turns():
    preparation = prepare(load(PACKED / "gear.pth"))
    along = [[0.5, 0.38, 0.05], [0.47, 0.46, 0.02], [0.53, 0.52, -0.04], [0.58, 0.58, -0.11]]
    points = np.array([*along, [0.57, 0.62, -0.2], [0.53, 0.59, -0.26]])
    stroke = Stroke(points, Brush(0.13, 0.5), kind=Kind.SMOOTH)
    report = sculpt(preparation, stroke).report()
    assert report["untouched_normal_max"] < 6
