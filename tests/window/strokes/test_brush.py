# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush by hand: its keys, and the curve widgets in the sidebar."""

import numpy as np
from drawing import (
    INTENSITY,
    RADIUS,
    WindowCase,
    changed,
    corner,
    field,
    middle,
    still_picture,
)
from harness import brush_settings, module
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class Brush(WindowCase):
    def test_keys(self) -> Steps:
        """F and Shift F follow the mouse in model space; brackets step; Esc brings back."""
        yield from self.add()
        brush = brush_settings()
        x, y = hand.to_window([(0, -self.size, 0)])[0]
        pixels = hand.to_window([(1, -self.size, 0)])[0][0] - x
        for held, length in (((), "radius"), (("shift",), "intensity")):
            before = getattr(brush, length)
            for key in ("LEFTMOUSE", "ESC"):
                hand.move((x, y))
                yield hand.DRAWN
                hand.tap("F", (x, y), held)
                yield hand.DRAWN
                hand.move((x + 40, y))
                yield hand.DRAWN
                self.assertAlmostEqual(getattr(brush, length), before + 40 / pixels, delta=2e-3)
                hand.tap(key, (x + 40, y))
                yield hand.DRAWN
                if key == "LEFTMOUSE":
                    self.assertAlmostEqual(getattr(brush, length), before + 40 / pixels, delta=2e-3)
                    setattr(brush, length, before)
                else:
                    self.assertAlmostEqual(getattr(brush, length), before, places=6)
        hand.tap("LEFT_BRACKET", (x, y))
        yield hand.DRAWN
        self.assertLess(brush.radius, RADIUS - 0.01)
        hand.tap("RIGHT_BRACKET", (x, y))
        yield hand.DRAWN
        self.assertAlmostEqual(brush.radius, RADIUS, places=5)
        self.assertEqual(len(field().neural_sculpt.strokes), 0)

    def test_circle(self) -> Steps:
        """It is drawn around the mouse on the surface, as wide as the stroke, in any file."""
        yield from self.add()
        hand.move(corner())
        before = yield from still_picture()
        hand.move(middle())
        after = yield from still_picture()
        left, _, right, _ = changed(before, after, hand.region())
        one, other = hand.to_window([(-RADIUS, -self.size, 0), (RADIUS, -self.size, 0)])
        self.assertAlmostEqual(right - left, other[0] - one[0], delta=10)

    def test_curve_widget(self) -> Steps:
        """Half the strength is dragged into the curve, and the surface gets just that."""
        yield from self.add()
        brush = brush_settings()
        brush.modulation = "CURVE"
        yield from hand.show_tab("Neural Sculpt")
        left, bottom, right, top = yield from self.widget_of("modulation")
        for x in (left, right):
            path = np.linspace((x, top), (x, (top + bottom) / 2), 6)
            yield from hand.drag(map(tuple, path), pause=0.05)
        store = module("blender.presets.curve_store")
        values = np.array(store.table("modulation"))
        np.testing.assert_allclose(values, 0.5, atol=0.05)
        path = self.arc()
        yield from self.draw(path)
        self.assert_raised(path, by=INTENSITY * values.mean())

    def test_profile_widget(self) -> Steps:
        """The middle of a tent is dragged down to half its height."""
        yield from self.add()
        brush = brush_settings()
        brush.profile = "CURVE"
        yield from hand.show_tab("Neural Sculpt")
        left, bottom, right, top = yield from self.widget_of("profile")
        store = module("blender.presets.curve_store")
        store.set_curve("profile", ((-1, 0), (0, 1), (1, 0)))
        hand.region("UI").tag_redraw()
        yield from still_picture("UI")
        x = (left + right) / 2
        path = np.linspace((x, top), (x, bottom + 0.75 * (top - bottom)), 6)
        yield from hand.drag(map(tuple, path), pause=0.05)
        values = np.array(store.table("profile"))
        self.assertAlmostEqual(values.max(), 0.5, delta=0.05)
        self.assertAlmostEqual(np.abs(values[[0, -1]]).max(), 0.0, delta=0.01)
        path = self.arc()
        yield from self.draw(path)
        self.assert_raised(path, by=INTENSITY * values.max())

    def widget_of(self, curve: str) -> Steps:
        """Where the widget's plot is, as left, bottom, right, top in window pixels: what changes
        in the picture when the curve moves from its lower to its upper bound."""
        store = module("blender.presets.curve_store")
        low, high = store.BOUNDS[curve]
        pictures = []
        for y in (low, high):
            store.set_curve(curve, ((low, y), (high, y)))
            hand.region("UI").tag_redraw()
            hand.move(middle())
            pictures.append((yield from still_picture("UI")))
        return changed(*pictures, hand.region("UI"))
