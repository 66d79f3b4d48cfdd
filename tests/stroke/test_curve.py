# SPDX-License-Identifier: GPL-3.0-or-later
"""The curve against scipy's splines and a finely measured arc length."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import CubicSpline

from neural_sculpt_addon.stroke.curve import fit_curve

steps = st.floats(-1, 1).filter(lambda x: abs(x) > 0.05)


@st.composite
def walks(draw, least=2, most=12):
    """Control points of which no two neighbours coincide."""
    count = draw(st.integers(least, most))
    return np.cumsum(draw(arrays(float, (count, 3), elements=steps)), axis=0)


def chord_length(points):
    return np.append(0, np.cumsum(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))))


def true_length(curve, t):
    """Arc length up to each of the parameters t, by Simpson's rule on |p'| between them."""
    spline = CubicSpline(curve.knots, curve.points, bc_type="not-a-knot")
    speed = spline.derivative()
    fine = np.linspace(t[:-1], t[1:], 201)  # (201, N - 1)
    weight = np.ones(201)
    weight[1:-1:2], weight[2:-1:2] = 4, 2
    norms = np.linalg.norm(speed(fine), axis=-1)
    return np.append(0, np.cumsum(weight @ norms * np.diff(t) / 600))


@given(walks())
def test_open_curves_are_not_a_knot_splines_by_chord_length(points):
    curve = fit_curve(points)
    knots = chord_length(points)
    expected = CubicSpline(knots, points, bc_type="not-a-knot")
    np.testing.assert_allclose(curve.knots, knots, atol=1e-12)
    t = np.linspace(0, knots[-1], 300)
    np.testing.assert_allclose(curve.evaluate(t), expected(t), atol=1e-8 * (1 + knots[-1]))


@given(walks(least=3))
def test_closed_curves_are_periodic_splines(points):
    if np.linalg.norm(points[0] - points[-1]) < 0.05:
        points = points[:-1]
    if len(points) < 3:
        return
    ring = np.vstack([points, points[0]])
    expected = CubicSpline(chord_length(ring), ring, bc_type="periodic")
    curve = fit_curve(points, closed=True)
    assert curve.closed
    t = np.linspace(0, curve.knots[-1], 300)
    np.testing.assert_allclose(curve.evaluate(t), expected(t), atol=1e-8 * (1 + t[-1]))


def test_two_points_are_a_line_and_three_a_parabola():
    line = fit_curve([[0, 0, 0], [3, 4, 0]])
    np.testing.assert_allclose(line.evaluate([0, 2.5, 5]), [[0, 0, 0], [1.5, 2, 0], [3, 4, 0]])
    # Equal chords 0, 1, 2 (in units of sqrt 2): y = t (2 - t), x = t.
    bow = fit_curve([[0, 0, 0], [1, 1, 0], [2, 0, 0]])
    t = np.array([0.5, 1.5]) * np.sqrt(2)
    np.testing.assert_allclose(bow.evaluate(t), [[0.5, 0.75, 0], [1.5, 0.75, 0]], atol=1e-12)


@settings(deadline=None)
@given(walks(least=4, most=8), st.integers(2, 60))
def test_resampling_is_uniform_by_arc_length(points, count):
    curve = fit_curve(points)
    samples, t = curve.resample(count)
    assert samples.shape == (count, 3)
    np.testing.assert_allclose(samples[[0, -1]], points[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(samples, curve.evaluate(t), atol=1e-12)
    length = true_length(curve, t)
    even = np.linspace(0, length[-1], count)
    np.testing.assert_allclose(length, even, atol=2e-3 * length[-1])


def test_a_circle_is_resampled_evenly_and_closes():
    angle = np.arange(8) * np.pi / 4
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    samples, _ = fit_curve(ring, closed=True).resample(65)
    np.testing.assert_allclose(samples[-1], samples[0], atol=1e-12)
    np.testing.assert_allclose(np.hypot(*samples.T[:2]), 1, atol=3e-3)
    turned = np.unwrap(np.arctan2(samples[:, 1], samples[:, 0]))
    np.testing.assert_allclose(turned, np.linspace(0, 2 * np.pi, 65), atol=5e-3)


@given(walks(least=1, most=6), st.lists(st.integers(1, 3), min_size=6, max_size=6))
def test_repeated_points_count_once(points, times):
    repeated = np.repeat(points, times[: len(points)], axis=0)
    once, again = fit_curve(points), fit_curve(repeated)
    np.testing.assert_array_equal(again.points, once.points)
    np.testing.assert_allclose(again.slopes, once.slopes)


def test_a_closed_curve_may_repeat_its_first_point():
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    plain, repeated = fit_curve(square, True), fit_curve([*square, square[0]], True)
    np.testing.assert_allclose(repeated.slopes, plain.slopes)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("times", [1, 5])
def test_one_point_is_a_curve_of_length_zero(closed, times):
    curve = fit_curve([[0.1, 0.2, 0.3]] * times, closed)
    assert curve.knots.tolist() == [0]
    samples, t = curve.resample(7)
    np.testing.assert_array_equal(samples, [[0.1, 0.2, 0.3]] * 7)
    np.testing.assert_array_equal(t, np.zeros(7))


def test_two_points_cannot_close():
    curve = fit_curve([[0, 0, 0], [1, 0, 0]], closed=True)
    assert not curve.closed
    np.testing.assert_allclose(curve.resample(3)[0][:, 0], [0, 0.5, 1])


@settings(deadline=None)
@given(walks(least=4, most=10), st.floats(1e-7, 1e-3))
def test_points_that_nearly_coincide_throw_the_curve_nowhere(points, gap):
    middle = len(points) // 2
    crowded = np.insert(points, middle, points[middle - 1] + gap, axis=0)
    samples, _ = fit_curve(crowded).resample(100)
    span = np.linalg.norm(np.ptp(points, axis=0))
    assert np.abs(samples - points.mean(axis=0)).max() < 3 * span


def test_a_curve_that_grows_keeps_its_points():
    """A step apart on a circle and on its longer part; the last step is what is left."""
    angle = np.linspace(0, 3, 61)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    longer, shorter = (fit_curve(points[:count]).every(0.07) for count in (61, 47))
    turned = np.unwrap(np.arctan2(longer[:, 1], longer[:, 0]))
    np.testing.assert_allclose(turned[:-1], 0.07 * np.arange(len(turned) - 1), atol=2e-4)
    assert turned[-1] == pytest.approx(3)
    assert 0.5 <= (turned[-1] - turned[-2]) / 0.07 < 1.5
    np.testing.assert_allclose(shorter[:20], longer[:20], atol=1e-7)


def test_a_curve_shorter_than_a_step_has_its_ends():
    np.testing.assert_allclose(fit_curve([[0, 0, 0], [0, 0.01, 0]]).every(1.0)[:, 1], [0, 0.01])
