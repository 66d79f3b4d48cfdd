# SPDX-License-Identifier: GPL-3.0-or-later
"""Where strokes of the history run over a sphere, and which of them a place belongs to."""

import unittest

import numpy as np

from tests.interaction.support import module

TRACE = module("interaction.trace")
LIFT = module("interaction.ribbon").LIFT
Brush = module("stroke.brush").Brush
Stroke = module("stroke.stroke").Stroke


def sphere(points):
    """Of radius 0.6."""
    points = np.array(points, float).reshape(-1, 3)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    return 0.6 * normals, normals


def arc(latitude: float, **given: object) -> object:
    angle = np.linspace(0.2, 1.2, 9)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.cos(latitude)
    points = 0.6 * np.column_stack([around, np.full(9, np.sin(latitude))])
    return Stroke(points, Brush(0.1, 0.02), **given)


class Trace(unittest.TestCase):
    def test_a_line_runs_along_the_stroke_above_the_surface(self) -> None:
        (line,) = TRACE.trace(arc(0.3), 0.0, sphere)
        np.testing.assert_allclose(np.linalg.norm(line, axis=1), 0.6 + LIFT, atol=1e-4)
        np.testing.assert_allclose(np.arcsin(line[:, 2] / (0.6 + LIFT)), 0.3, atol=2e-3)
        angle = np.arctan2(line[:, 1], line[:, 0])
        np.testing.assert_allclose(angle[[0, -1]], (0.2, 1.2), atol=2e-3)
        self.assertTrue((np.diff(angle) > 0).all())

    def test_it_is_as_high_as_the_stroke_is_shown(self) -> None:
        """The strength falls evenly from 1 to 0 along the stroke."""
        linear = module("stroke.modulation").Modulation("linear")
        stroke = arc(0.3)
        stroke = type(stroke)(stroke.points, Brush(0.1, 0.02, modulation=linear))
        for share in (1.0, 0.5):
            (line,) = TRACE.trace(stroke, share, sphere)
            expected = 0.6 + LIFT + share * 0.02 * np.linspace(1, 0, len(line))
            np.testing.assert_allclose(np.linalg.norm(line, axis=1), expected, atol=1e-4)

    def test_each_mirror_image_has_one(self) -> None:
        lines = TRACE.trace(arc(0.3, mirror=frozenset("XZ")), 1.0, sphere)
        signs = {tuple(np.sign(line[40]).astype(int)) for line in lines}
        self.assertEqual(signs, {(1, 1, 1), (-1, 1, 1), (1, 1, -1), (-1, 1, -1)})

    def test_each_turned_image_has_one(self) -> None:
        turned = arc(0.3, radial=(1, 1, 3))
        lines = TRACE.trace(turned, 1.0, sphere)
        around = [np.arctan2(line[40, 1], line[40, 0]) % (2 * np.pi) for line in lines]
        np.testing.assert_allclose(np.diff(sorted(around)), 2 * np.pi / 3, atol=1e-9)
        for line in lines:
            self.assertEqual(TRACE.under(0.6 * line[40] / np.linalg.norm(line[40]), [turned]), 0)
        between = 0.6 * lines[0][40] * (-1, -1, 1) / np.linalg.norm(lines[0][40])
        self.assertIsNone(TRACE.under(between, [turned]))

    def test_a_dab_has_its_rim(self) -> None:
        (rim,) = TRACE.trace(Stroke(np.array([[0, 0, 0.6]]), Brush(0.1, 0.02)), 1.0, sphere)
        np.testing.assert_allclose(rim[0], rim[-1], atol=1e-3)
        around = np.hypot(rim[:, 0], rim[:, 1])
        np.testing.assert_allclose(around, 0.1, atol=1e-3)
        np.testing.assert_allclose(rim[:, 2], 0.6 + LIFT, atol=1e-3)

    def test_the_last_stroke_that_covers_a_place_is_meant(self) -> None:
        strokes = [arc(0.0), arc(0.1), arc(0.8, mirror=frozenset("Z"))]
        self.assertEqual(TRACE.under(sphere([0.5, 0.5, 0.0])[0][0], strokes), 1)
        self.assertEqual(TRACE.under(sphere([0.5, 0.5, -0.11])[0][0], strokes), 0)
        self.assertEqual(TRACE.under(sphere([0.5, 0.5, -0.7])[0][0], strokes), 2)
        self.assertIsNone(TRACE.under(sphere([0.5, 0.5, 0.35])[0][0], strokes))
        self.assertIsNone(TRACE.under(sphere([-0.5, -0.5, 0.0])[0][0], strokes))
        self.assertIsNone(TRACE.under(sphere([0.5, 0.5, 0.0])[0][0], []))
