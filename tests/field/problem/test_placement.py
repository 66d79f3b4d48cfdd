# SPDX-License-Identifier: GPL-3.0-or-later
"""Laying strokes: great circles, paths on networks, and what cannot be placed."""

import json

import numpy as np
import pytest
import torch
from scipy.interpolate import CubicSpline

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.problem.placement import MOST_PATH_POINTS, PATH_POINTS, place_stroke
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball, eight_balls, ellipsoid, plane
from tests.field.networks import DATA, MODELS, network_of

BRUSH = Brush(0.08, 0.06)


def scored_cases():
    """Paths that others computed, where they lie beside the project."""
    path = DATA / "cases/cases.json"
    return json.loads(path.read_text())["cases"] if path.exists() else []


def equator(start, stop, count):
    angle = np.linspace(start, stop, count)
    return 0.5 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)


def test_a_great_circle():
    path = place_stroke(ball(0.5), Stroke(equator(0, 2, 7), BRUSH))
    assert len(path.points) == PATH_POINTS
    assert path.length == pytest.approx(1.0, rel=1e-4)
    np.testing.assert_allclose(path.points, equator(0, 2, PATH_POINTS), atol=1e-4)
    np.testing.assert_allclose(path.normals, 2 * equator(0, 2, PATH_POINTS), atol=3e-4)
    np.testing.assert_allclose(path.laterals, np.tile([0, 0, 1], (PATH_POINTS, 1)), atol=3e-4)
    np.testing.assert_allclose(path.u, np.linspace(0, 1, PATH_POINTS), atol=1e-4)


def test_a_closed_great_circle():
    path = place_stroke(ball(0.5), Stroke(equator(0, 2 * np.pi, 13)[:-1], BRUSH, closed=True))
    assert path.closed
    assert path.length == pytest.approx(np.pi, rel=1e-3)
    np.testing.assert_allclose(np.linalg.norm(path.points, axis=1), 0.5, atol=1e-5)
    np.testing.assert_allclose(path.points[-1], path.points[0], atol=1e-6)
    gaps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    np.testing.assert_allclose(gaps, gaps.mean(), rtol=0.01)


@pytest.mark.parametrize("times", [1, 4])
def test_a_dab(times):
    path = place_stroke(ball(0.5), Stroke(np.tile([0, 0.3, 0.41], (times, 1)), BRUSH))
    assert len(path.points) == 1
    direction = np.array([[0, 0.3, 0.41]]) / np.hypot(0.3, 0.41)
    np.testing.assert_allclose(path.points, 0.5 * direction, atol=1e-5)
    np.testing.assert_allclose(path.normals, direction, atol=1e-5)


@pytest.mark.parametrize("gap", [1e-9, 1e-7, 2e-6, 1e-4])
def test_points_that_hardly_differ_make_a_dab_or_a_very_short_stroke(gap):
    path = place_stroke(ball(0.5), Stroke(np.array([[0.5, 0, 0], [0.5, gap, 0]]), BRUSH))
    assert np.isfinite(path.laterals).all()
    assert len(path.points) == 1 or path.length > 0
    assert path.length <= 2 * gap


@pytest.mark.parametrize("away", [-0.15, -0.03, 0.03, 0.15])
def test_control_points_need_not_be_quite_on_the_surface(away):
    """They may have been drawn on a stroke that is no longer there, wider than this one."""
    points = equator(0, 1, 6) * (1 + away / 0.5)
    path = place_stroke(ball(0.5), Stroke(points, Brush(0.02, 0.01)))
    np.testing.assert_allclose(path.points, equator(0, 1, PATH_POINTS), atol=1e-3)


def test_spacing_is_uniform_on_the_surface_not_on_the_spline():
    """Two points across the tip of a long ellipsoid: the straight spline runs inside it."""
    axes = np.array([0.8, 0.3, 0.3])
    angle = np.array([-1.0, -0.5, 0.5, 1.0])
    points = np.stack([axes[0] * np.cos(angle), axes[1] * np.sin(angle), 0 * angle], axis=1)
    path = place_stroke(ellipsoid(axes), Stroke(points, BRUSH))
    gaps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    assert gaps.max() < 1.05 * gaps.min()
    np.testing.assert_allclose(((path.points / axes) ** 2).sum(axis=1), 1, atol=1e-4)


@pytest.mark.parametrize("away", [-0.4, 0.25, 0.4])
def test_a_stroke_off_the_surface_is_refused(away):
    stroke = Stroke(equator(0, 1, 5) * (1 + away / 0.5), Brush(0.01, 0.01))
    with pytest.raises(SculptError, match=r"off the surface"):
        place_stroke(ball(0.5), stroke)


def test_a_single_stray_point_is_refused():
    points = equator(0, 1, 5)
    points[2] *= 1.5
    with pytest.raises(SculptError, match=r"off the surface"):
        place_stroke(ball(0.5), Stroke(points, BRUSH))


def test_the_middle_of_a_ball_is_off_its_surface():
    with pytest.raises(SculptError):
        place_stroke(ball(0.5), Stroke(np.zeros((1, 3)), BRUSH))


def test_a_gap_that_is_wide_for_its_brush_is_leapt_over():
    """Newton steps lead from a chord between two balls to either of them, and to nothing between:
    a brush that spans the gap reaches over it."""
    field = eight_balls()
    ends = project(field, [[-0.3, 0.5, 0.5], [0.3, 0.5, 0.5]], steps=20).points.astype(float)
    path = place_stroke(field, Stroke(ends, Brush(0.6, 0.01)))
    assert path.length == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("radius", [0.08, 0.4])
def test_a_stroke_from_one_piece_to_another_is_refused(radius):
    field = eight_balls()
    ends = project(field, [[-0.3, 0.5, 0.5], [0.3, 0.5, 0.5]], steps=20).points.astype(float)
    np.testing.assert_allclose(ends[:, 0], [-1 / 4, 1 / 4], atol=1e-3)  # cos(2 pi x) = 0
    with pytest.raises(SculptError, match="leaves the surface between"):
        place_stroke(field, Stroke(ends, Brush(radius, 0.01)))


def test_a_straight_stroke_on_a_plane():
    path = place_stroke(
        plane(offset=0.2), Stroke(np.array([[-0.5, 0.1, 0.2], [0.5, 0.1, 0.2]]), BRUSH)
    )
    np.testing.assert_allclose(path.points[:, 0], np.linspace(-0.5, 0.5, PATH_POINTS), atol=1e-6)
    np.testing.assert_allclose(path.points[:, 1:], np.tile([0.1, 0.2], (PATH_POINTS, 1)), atol=1e-6)
    np.testing.assert_allclose(path.tangents, np.tile([1, 0, 0], (PATH_POINTS, 1)), atol=1e-5)


def on_network(model, points):
    """Where Newton steps in double precision lead from points (N, 3), and the normals there."""
    network = network_of(model).network
    network = network.with_parameters([p.double() for p in network.parameters])
    x = torch.tensor(points, dtype=torch.float64)
    for _ in range(20):
        value, gradient = network.value_and_gradient(x)
        x = x - (value / gradient.square().sum(dim=1))[:, None] * gradient
    return x.numpy(), gradient.numpy() / np.linalg.norm(gradient, axis=1, keepdims=True)


def made_case(model):
    """A stroke on a network of a shape about the origin, its path by scipy from 20,000 points."""
    turn = np.linspace(0.4, 1.2, 5)
    along = np.stack([0.78 * np.cos(turn), 0.78 * np.sin(turn), np.full(5, 0.62)], axis=1)
    vertices = extract(network_of(model), 64).vertices
    cosine = along @ vertices.T / np.linalg.norm(vertices, axis=1)
    control, _ = on_network(model, vertices[cosine.argmax(axis=1)])
    chord = np.append(0, np.linalg.norm(np.diff(control, axis=0), axis=1).cumsum())
    spline = CubicSpline(chord, control)  # not-a-knot
    dense, _ = on_network(model, spline(np.linspace(0, chord[-1], 20_000)))
    length = np.append(0, np.linalg.norm(np.diff(dense, axis=0), axis=1).cumsum())
    even = np.linspace(0, length[-1], PATH_POINTS)
    path = np.stack([np.interp(even, length, axis) for axis in dense.T], axis=1)
    path, normals = on_network(model, path)
    return {"control_points": control, "path_points": path, "path_normals": normals}


@pytest.mark.parametrize("model", MODELS)
def test_paths_on_networks(model):
    """Control points to path: chord-length not-a-knot spline, projected, uniform."""
    found = [case for case in scored_cases() if case["model"] == model] or [made_case(model)]
    for case in found:
        expected = np.array(case["path_points"])
        path = place_stroke(network_of(model), Stroke(np.array(case["control_points"]), BRUSH))
        np.testing.assert_allclose(path.points, expected, atol=2e-3)
        # As curves they agree better than point by point.
        away = np.linalg.norm(path.points[:, None] - expected, axis=2).min(axis=1)
        spacing = np.linalg.norm(np.diff(expected, axis=0), axis=1).mean()
        assert np.sqrt(np.maximum(away**2 - (spacing / 2) ** 2, 0)).max() < 2e-4
        cosine = (path.normals * case["path_normals"]).sum(axis=1)
        assert np.median(cosine) > 0.9999


def test_a_long_path_has_four_points_to_a_radius():
    """A spiral of many turns around a ball, as when an area is filled by scribbling."""
    turn, height = np.linspace(0, 40 * np.pi, 600), np.linspace(-0.4, 0.4, 600)
    flat = np.sqrt(0.25 - height**2)
    spiral = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)
    path = place_stroke(ball(0.5), Stroke(spiral, Brush(0.2, 0.01)))
    assert np.linalg.norm(np.diff(path.points, axis=0), axis=1).max() < 1.1 * 0.2 / 4
    middle = (path.points[1:] + path.points[:-1]) / 2
    assert 0.5 - np.linalg.norm(middle, axis=1).min() < 1e-3  # a chord stays that close
    assert (
        len(place_stroke(ball(0.5), Stroke(spiral, Brush(0.005, 0.01))).points) == MOST_PATH_POINTS
    )
