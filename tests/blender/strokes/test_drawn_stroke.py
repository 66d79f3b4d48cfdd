# SPDX-License-Identifier: GPL-3.0-or-later
"""From a drawn line to a stroke: the brush, the pen's pressure, symmetry, ends, direction."""

from dataclasses import replace

import bpy
import numpy as np
from bpy.types import Object
from harness import SculptCase, brush_settings, module

BRUSH = module("blender.scene.brush.current_brush")
Line = module("interaction.recorder").StrokeRecorder
Stroke = module("stroke.stroke").Stroke

POINTS = [(0.0, 0.0, 0.5), (0.1, 0.0, 0.5), (0.2, 0.0, 0.5)]
PRESSURES = [0.0, 0.5, 1.0]


class DrawnStroke(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = bpy.data.objects.new("Field", bpy.data.meshes.new("Field"))
        self.brush = brush_settings()
        self.brush.radius, self.brush.intensity = 0.2, 0.04
        self.brush.pressure_radius = self.brush.pressure_intensity = False

    def drawn(self, inverted: bool = False, ob: Object | None = None) -> object:
        line = Line(0.1, list(POINTS), list(PRESSURES))
        return BRUSH.drawn_stroke(bpy.context, ob or self.ob, line, inverted)

    def set_curve(self, name: str, *points: tuple[float, float]) -> None:
        module("blender.presets.curve_store").set_curve(name, points)

    def test_without_pressure(self) -> None:
        stroke = self.drawn()
        np.testing.assert_allclose(stroke.points, POINTS)
        self.assertIsNone(stroke.radius_factors)
        self.assertIsNone(stroke.intensity_factors)
        self.assertAlmostEqual(stroke.brush.radius, 0.2, places=6)
        self.assertAlmostEqual(stroke.brush.intensity, 0.04, places=6)

    def test_redrawn_it_keeps_what_is_near(self) -> None:
        stroke = replace(self.drawn(), intensity_factors=np.array(PRESSURES), name="Brow")
        points = [(-0.1, 0.0, 0.5), (0.19, 0.1, 0.5), (0.12, 0.0, 0.4), (0.3, 0.0, 0.5)]
        again = BRUSH.redrawn_stroke(stroke, points)
        np.testing.assert_allclose(again.points, points)
        np.testing.assert_allclose(again.intensity_factors, [0.0, 1.0, 0.5, 1.0])
        self.assertIsNone(again.radius_factors)
        self.assertEqual((again.brush, again.name), (stroke.brush, "Brow"))
        np.testing.assert_allclose(BRUSH.strengths(stroke), PRESSURES)

    def test_inverted(self) -> None:
        self.assertAlmostEqual(self.drawn(inverted=True).brush.intensity, -0.04, places=6)

    def test_kinds(self) -> None:
        """The panel's kind with its strength; smoothing by a key leaves the panel alone."""
        self.brush.strength = 0.25
        line = Line(0.1, list(POINTS), list(PRESSURES))
        smooth = module("stroke.stroke").Kind.SMOOTH
        stroke = BRUSH.drawn_stroke(bpy.context, self.ob, line, False, smooth)
        self.assertEqual((stroke.kind, stroke.brush.intensity), ("smooth", 0.25))
        self.assertEqual(stroke.name, "Smooth")
        sharpened = BRUSH.drawn_stroke(bpy.context, self.ob, line, True, smooth)
        self.assertEqual(sharpened.brush.intensity, -0.25)
        drawn = self.drawn()
        self.assertEqual((drawn.kind, drawn.name), ("draw", ""))
        self.assertAlmostEqual(drawn.brush.intensity, 0.04, places=6)
        self.brush.kind = "PINCH"
        pinched = self.drawn()
        self.assertEqual((pinched.kind, pinched.brush.intensity), ("pinch", 0.25))
        self.assertEqual(BRUSH.seen(pinched.brush, pinched.kind).intensity, 0.0)

    def test_pressure_goes_through_its_curve(self) -> None:
        self.brush.pressure_intensity = True
        self.set_curve("pressure_intensity", (0.0, 1.0), (1.0, 0.0))
        stroke = self.drawn()
        np.testing.assert_allclose(stroke.intensity_factors, [1.0, 0.5, 0.0], atol=1e-3)
        self.assertIsNone(stroke.radius_factors)

    def test_the_lightest_touch_keeps_some_width(self) -> None:
        self.brush.pressure_radius = True
        self.set_curve("pressure_radius", (0.0, 0.0), (1.0, 1.0))
        stroke = self.drawn()
        expected = [BRUSH.NARROWEST_FACTOR, 0.5, 1.0]
        np.testing.assert_allclose(stroke.radius_factors, expected, atol=1e-3)

    def test_the_right_of_the_widget_is_the_right_of_the_stroke(self) -> None:
        """Seen from the front, a stroke upwards over the sphere has positive x at its right."""
        self.brush.profile = "CURVE"
        self.set_curve("profile", (-1.0, 0.0), (0.0, 0.0), (0.5, 1.0), (1.0, 0.0))
        angle = np.linspace(-0.3, 0.3, 9)
        points = 0.6 * np.stack([0 * angle, -np.cos(angle), np.sin(angle)], axis=1)
        line = Line(0.1, [tuple(p) for p in points], [1.0] * 9)
        stroke = BRUSH.drawn_stroke(bpy.context, self.ob, line, False)
        path = module("stroke.path").make_path(points, points / 0.6)
        sides = np.array([[0.1, -(0.35**0.5), 0.0], [-0.1, -(0.35**0.5), 0.0]])
        displace = module("stroke.displacement").displace
        right, left = displace(stroke, path, sides, sides / 0.6).amount
        self.assertAlmostEqual(right, stroke.brush.intensity, delta=2e-3)
        self.assertAlmostEqual(left, 0.0, delta=1e-3)

    def test_a_mouse_presses_fully(self) -> None:
        self.brush.pressure_radius = self.brush.pressure_intensity = True
        for name in ("pressure_radius", "pressure_intensity"):
            self.set_curve(name, (0.0, 0.0), (1.0, 1.0))
        line = Line(0.1, list(POINTS), [1.0, 1.0, 1.0])
        stroke = BRUSH.drawn_stroke(bpy.context, self.ob, line, False)
        self.assertIsNone(stroke.radius_factors)
        self.assertIsNone(stroke.intensity_factors)

    def test_symmetry_is_the_meshs_own(self) -> None:
        self.ob.data.use_mirror_x = self.ob.data.use_mirror_z = True
        stroke = self.drawn()
        self.assertEqual(stroke.mirror, frozenset("XZ"))
        corners = {tuple(np.sign(copy.points[-1, [0, 2]])) for copy in stroke.copies()}
        self.assertEqual(corners, {(x, z) for x in (-1, 1) for z in (-1, 1)})

    def test_ends_and_direction(self) -> None:
        self.brush.ends, self.brush.direction = "FLAT", "STROKE"
        stroke = self.drawn()
        self.assertEqual((stroke.ends, stroke.direction), ("flat", "stroke"))
        self.assertEqual(Stroke.from_json(stroke.to_json()), stroke)
