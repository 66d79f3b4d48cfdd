# SPDX-License-Identifier: GPL-3.0-or-later
"""The ribbon of a changed stroke, on roofs and cones over a plane, where all heights are known."""

import unittest
from dataclasses import replace

import numpy as np

from tests.interaction.support import module

CHANGED = module("interaction.changed_ribbon")
LIFT = module("interaction.ribbon").LIFT
Brush = module("stroke.brush").Brush
Profile = module("stroke.profile").Profile
STROKE = module("stroke.stroke")
Kind, Stroke = STROKE.Kind, STROKE.Stroke
LINEAR = Profile("linear")
LINE = np.array([[-0.5, 0.2, 0.0], [0.0, 0.2, 0.0], [0.5, 0.2, 0.0]])
RADIUS = 0.1


def nearest(across, up, height):
    """On the polyline of a tent of that height over the line up = 0, the points (N, 2) nearest to
    those at (N,), (N,), and its normals there."""
    corners = np.array([(-9.0, 0.0), (-RADIUS, 0.0), (0.0, height), (RADIUS, 0.0), (9.0, 0.0)])
    x, edges = np.stack([across, up], -1)[:, None], np.diff(corners, axis=0)
    share = np.clip(((x - corners[:-1]) * edges).sum(-1) / (edges**2).sum(-1), 0, 1)
    found = corners[:-1] + share[..., None] * edges  # (N, 4, 2)
    best = ((found - x) ** 2).sum(-1).argmin(1)
    normals = edges[:, ::-1] * (-1, 1) / np.linalg.norm(edges, axis=1, keepdims=True)
    return found[np.arange(len(x)), best], normals[best]


def roof(height):
    """The surface that LINE made with a linear profile, as `lay`; it has no ends."""

    def lay(points):
        x, y, z = np.array(points, float).reshape(-1, 3).T
        found, normals = nearest(y - 0.2, z, height)
        return (
            np.stack([x, found[:, 0] + 0.2, found[:, 1]], -1),
            np.stack([0 * x, *normals.T], -1),
        )

    return lay


def cone(height):
    """The surface that a dab at the origin made with a linear profile, as `lay`."""

    def lay(points):
        points = np.array(points, float).reshape(-1, 3)
        away = np.hypot(points[:, 0], points[:, 1])
        outward = points[:, :2] / np.maximum(away, 1e-12)[:, None]
        outward[away < 1e-12] = 1, 0
        found, normals = nearest(away, points[:, 2], height)
        return (
            np.column_stack([outward * found[:, :1], found[:, 1]]),
            np.column_stack([outward * normals[:, :1], normals[:, 1]]),
        )

    return lay


def sphere(points):
    """Of radius 0.6."""
    points = np.array(points, float).reshape(-1, 3)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    return 0.6 * normals, normals


def tent(distance, radius, height):
    """A linear profile."""
    return height * np.maximum(1 - np.abs(distance) / radius, 0)


class ChangedRibbons(unittest.TestCase):
    def assert_is(self, ribbon, expected) -> None:
        """Heights (R, C) above the plane, to a hundredth of the strokes' own."""
        np.testing.assert_allclose(ribbon.points[..., 2] - LIFT, expected, atol=6e-4)

    def test_lies_where_the_surface_will_be(self) -> None:
        """Lower, upside down, wider, narrower: whatever the old one has made of the surface."""
        for was in (0.06, -0.06):
            old = Stroke(LINE, Brush(RADIUS, was, LINEAR))
            for radius, height in ((0.1, 0.02), (0.1, -0.06), (0.2, 0.05), (0.05, 0.06)):
                new = replace(old, brush=Brush(radius, height, LINEAR))
                (ribbon,) = CHANGED.changed_ribbons(old, new, roof(was))
                across = ribbon.points[..., 1] - 0.2
                np.testing.assert_allclose(np.ptp(across, axis=1), 2 * radius, rtol=1e-6)
                self.assert_is(ribbon, tent(across, radius, height))
                np.testing.assert_allclose(ribbon.height, tent(across, radius, height), atol=1e-6)

    def test_through_other_points(self) -> None:
        """Beyond what the old ones have made, and on its flank, which will not be there: its slope
        tilts the ribbon, but the old height is not below the new one, which would make 0.09."""
        old = Stroke(LINE, Brush(RADIUS, 0.06, LINEAR))
        for beside, on, off in ((0.3, 0.0, 6e-4), (0.15, 0.0, 0.02), (0.05, 0.03, 0.02)):
            new = replace(old, points=LINE + np.array([0, beside, on]))
            (ribbon,) = CHANGED.changed_ribbons(old, new, roof(0.06))
            across, up = ribbon.points[..., 1] - 0.2 - beside, ribbon.points[..., 2] - LIFT
            np.testing.assert_allclose(up, tent(across, RADIUS, 0.06), atol=off)
            self.assertAlmostEqual(up.max(), 0.06, delta=0.007)

    def test_shares(self) -> None:
        """A muted one is not in the surface; a weak one is, and will be, in part."""
        old = Stroke(LINE, Brush(RADIUS, 0.06, LINEAR))
        new = replace(old, brush=Brush(RADIUS, 0.04, LINEAR))
        for surface, shown, strength in ((0.0, 0.0, 1.0), (0.03, 0.5, 0.5)):
            (ribbon,) = CHANGED.changed_ribbons(old, new, roof(surface), shown, strength)
            across = ribbon.points[..., 1] - 0.2
            self.assert_is(ribbon, tent(across, RADIUS, 0.04 * strength))

    def test_a_dab(self) -> None:
        """Its rows are diameters."""
        old = Stroke(np.zeros((1, 3)), Brush(RADIUS, 0.06, LINEAR))
        new = replace(old, brush=Brush(0.15, -0.03, LINEAR))
        (ribbon,) = CHANGED.changed_ribbons(old, new, cone(0.06))
        away = np.linalg.norm(ribbon.points[..., :2], axis=-1)
        np.testing.assert_allclose(away[:, [0, -1]], 0.15, rtol=1e-6)
        self.assert_is(ribbon, tent(away, 0.15, -0.03))
        self.assertLess(np.abs(ribbon.points[..., :2].mean(axis=(0, 1))).max(), 1e-9)

    def test_what_does_not_draw_lies_on_the_surface(self) -> None:
        old = Stroke(LINE, Brush(RADIUS, 0.5), kind=Kind.SMOOTH)
        (ribbon,) = CHANGED.changed_ribbons(old, replace(old, brush=Brush(0.2, 1.0)), roof(0.0))
        self.assert_is(ribbon, 0.0)
        self.assertAlmostEqual(np.ptp(ribbon.points[..., 1]), 0.4)

    def test_between_control_points_that_are_far_apart(self) -> None:
        """The spline of two dives 0.07 below the sphere."""
        ends = 0.6 * np.array([(-np.sin(0.5), -np.cos(0.5), 0), (np.sin(0.5), -np.cos(0.5), 0)])
        old = Stroke(ends, Brush(RADIUS, 0.06, LINEAR))
        new = replace(old, brush=Brush(RADIUS, 0.03, LINEAR))
        (ribbon,) = CHANGED.changed_ribbons(old, new, sphere, shown=0.0)
        height = np.linalg.norm(ribbon.points, axis=-1) - 0.6 - LIFT
        np.testing.assert_allclose(height[:, height.shape[1] // 2], 0.03, atol=6e-4)
        self.assertLess(np.abs(height[:, [0, -1]]).max(), 3e-3)

    def test_symmetry(self) -> None:
        """The new one's, whatever the old one's was."""
        old = Stroke(LINE, Brush(RADIUS, 0.06, LINEAR), mirror=frozenset("Z"))
        new = replace(old, mirror=frozenset("Y"), radial=(1, 1, 2))
        shown = CHANGED.changed_ribbons(old, new, roof(0.06))
        first = shown[0].points
        turned = [first * signs for signs in ((1, 1, 1), (1, -1, 1), (-1, -1, 1), (-1, 1, 1))]
        self.assertEqual(len(shown), 4)
        for expected in turned:
            off = min(np.abs(ribbon.points - expected).max() for ribbon in shown)
            self.assertLess(off, 1e-9)


if __name__ == "__main__":
    unittest.main()
