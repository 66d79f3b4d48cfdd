# SPDX-License-Identifier: GPL-3.0-or-later
"""What the overlay draws, on a plane and on a sphere where all heights are known."""

import unittest

import numpy as np

from tests.interaction.support import module

RIBBON = module("interaction.ribbon")
Brush = module("stroke.brush").Brush
Modulation = module("stroke.modulation").Modulation
Profile = module("stroke.profile").Profile
Stroke = module("stroke.stroke").Stroke
LINE = np.array([[-0.5, 0.2, 0.0], [0.0, 0.2, 0.0], [0.5, 0.2, 0.0]])


def plane(points):
    """z = 0, whose normal is +z."""
    points = np.array(points, float).reshape(-1, 3)
    return points * (1, 1, 0), np.tile((0.0, 0.0, 1.0), (len(points), 1))


def sphere(points):
    """Of radius 0.6."""
    points = np.array(points, float).reshape(-1, 3)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    return 0.6 * normals, normals


class Ribbons(unittest.TestCase):
    def test_shows_the_displacement(self) -> None:
        brush = Brush(0.1, 0.05, Profile("linear"), Modulation("linear"))
        (ribbon,) = RIBBON.ribbons(Stroke(LINE, brush), plane)
        x, y, z = np.moveaxis(ribbon.points, -1, 0)
        expected = 0.05 * (0.5 - x) * (1 - np.abs(y - 0.2) / 0.1)
        np.testing.assert_allclose(ribbon.height, expected, atol=1e-9)
        np.testing.assert_allclose(z, expected + RIBBON.LIFT, atol=1e-9)
        np.testing.assert_allclose(ribbon.strength, 0.5 - x[:, 0], atol=1e-9)

    def test_never_dives_below_the_surface(self) -> None:
        (ribbon,) = RIBBON.ribbons(Stroke(LINE, Brush(0.1, -0.05)), plane)
        self.assertLess(ribbon.height.min(), -0.04)
        np.testing.assert_allclose(ribbon.points[..., 2], RIBBON.LIFT)

    def test_mirror_images(self) -> None:
        stroke = Stroke(LINE, Brush(0.1, 0.05), mirror=frozenset("XY"))
        shown = RIBBON.ribbons(stroke, plane)
        signs = {tuple(np.round(ribbon.points[-1, 0] / shown[0].points[-1, 0])) for ribbon in shown}
        self.assertEqual(signs, {(x, y, 1) for x in (-1, 1) for y in (-1, 1)})

    def test_turned_images(self) -> None:
        shown = RIBBON.ribbons(Stroke(LINE, Brush(0.1, 0.05), radial=(1, 1, 4)), plane)
        x, y, z = np.moveaxis(shown[0].points, -1, 0)
        expected = [(x, y, z), (-y, x, z), (-x, -y, z), (y, -x, z)]
        self.assertEqual(len(shown), 4)
        for ribbon, turned in zip(shown, expected, strict=True):
            np.testing.assert_array_equal(ribbon.points, np.stack(turned, axis=-1))

    def test_pressure_narrows_it(self) -> None:
        factors = np.array([1.0, 0.5, 1.0])
        (ribbon,) = RIBBON.ribbons(Stroke(LINE, Brush(0.1, 0.05), radius_factors=factors), plane)
        width = np.ptp(ribbon.points[..., 1], axis=1)
        np.testing.assert_allclose(width[[0, -1]], 0.2)
        self.assertAlmostEqual(width.min(), 0.1, delta=0.005)

    def test_a_dab_has_none(self) -> None:
        self.assertEqual(RIBBON.ribbons(Stroke(LINE[:1], Brush(0.1, 0.05)), plane), ())

    def test_triangles_cover_it_once(self) -> None:
        (ribbon,) = RIBBON.ribbons(Stroke(LINE, Brush(0.1, 0.05)), plane)
        a, b, c = np.moveaxis(ribbon.points.reshape(-1, 3)[RIBBON.ribbon_triangles()], 1, 0)
        area = np.abs(np.cross((b - a)[:, :2], (c - a)[:, :2])).sum() / 2
        self.assertAlmostEqual(area, 1.0 * 0.2, places=6)


class Cursor(unittest.TestCase):
    def test_circle_lies_on_the_surface(self) -> None:
        brush = Brush(0.1, 0.05)
        shape = RIBBON.cursor(brush, (0, 0, 0.6), (0, 0, 1), np.eye(3), sphere)
        length = np.linalg.norm(shape.rim, axis=1)
        np.testing.assert_allclose(length, 0.6 + RIBBON.LIFT)
        np.testing.assert_allclose(shape.rim[0], shape.rim[-1])
        tilt = np.arccos(shape.rim[:, 2] / length)
        np.testing.assert_allclose(tilt, np.arctan(0.1 / 0.6), atol=1e-9)

    def test_profile_goes_up_the_screen_where_the_surface_faces_it(self) -> None:
        brush = Brush(0.1, 0.05, Profile("linear"))
        shape = RIBBON.cursor(brush, (0, 0, 0), (0, 0, 1), np.eye(3), plane)
        rise = shape.section - shape.base
        np.testing.assert_allclose(rise[:, 1], 0.05 * (1 - np.abs(shape.base[:, 0]) / 0.1))
        np.testing.assert_allclose(rise[:, [0, 2]], 0)

    def test_profile_follows_the_normal_where_that_is_seen(self) -> None:
        axes = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # from the front
        shape = RIBBON.cursor(Brush(0.1, 0.05), (0, 0, 0), (0, 0, 1), axes, plane)
        np.testing.assert_allclose(
            (shape.section - shape.base)[RIBBON.SECTION // 2], (0, 0, 0.05), atol=1e-12
        )

    def test_sides_are_those_of_a_stroke_up_the_screen(self) -> None:
        one_sided = Profile(points=((-1.0, 0.0), (0.0, 0.0), (0.5, 1.0), (1.0, 0.0)))
        shape = RIBBON.cursor(Brush(0.1, 0.05, one_sided), (0, 0, 0), (0, 0, 1), np.eye(3), plane)
        highest = shape.base[(shape.section - shape.base)[:, 1].argmax()]
        self.assertAlmostEqual(highest[0], -0.05, places=6)  # v = n x u grows to the left
