# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers by hand: the strength of a stroke by its slider, and the report that follows."""

from unittest.mock import patch

import bpy
import numpy as np
from drawing import INTENSITY, SECONDS, WindowCase, changed, field, still_picture
from harness import module, state
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class Strength(WindowCase):
    def setUp(self) -> None:
        """With all panels in sight."""
        super().setUp()
        view = bpy.context.preferences.view
        self.addCleanup(setattr, view, "ui_scale", view.ui_scale)
        view.ui_scale = 0.5

    def test_strength_by_its_slider(self) -> Steps:
        """Dragged to the left the stroke sinks when the slider is released; Ctrl Z raises it.

        That it rests is no release here, be the computer as busy as it may.
        """
        self.enterContext(patch.object(module("blender.panels.strength"), "RESTS_AFTER", SECONDS))
        yield from self.add()
        path = self.arc()
        yield from self.draw(path)
        drawn = state(field())
        yield from hand.show_tab("Neural Sculpt")
        yield from hand.until(lambda: field().neural_sculpt.report, SECONDS, "a report")
        left, bottom, right, top = yield from self.slider()
        y = (bottom + top) / 2
        hand.move((right - 3, y))
        yield hand.DRAWN
        way = np.linspace(right - 3, (left + right) / 2, 8)
        yield from hand.drag([(x, y) for x in way], pause=0.05)
        yield from hand.until(lambda: strength() < 1, SECONDS, "another strength")
        yield from self.idle()
        self.assertAlmostEqual(strength(), 0.5, delta=0.2)
        self.assert_raised(path, by=strength() * INTENSITY)
        bpy.ops.ed.undo()
        yield hand.DRAWN
        self.assertEqual(state(field())[:3], drawn[:3])

    def test_the_report_follows(self) -> Steps:
        """A picture of the panels is left with the history and the report of the last stroke."""
        yield from self.add()
        yield from hand.show_tab("Neural Sculpt")
        for tilt in (0.0, 0.5):
            yield from self.draw(self.arc(tilt))
        yield from hand.until(lambda: field().neural_sculpt.report, SECONDS, "a report")
        self.assertIn("tube_mean", field().neural_sculpt.report)
        yield 0.5

    def slider(self) -> Steps:
        """Where the slider is, as left, bottom, right, top in window pixels: what changes in the
        picture when its value does."""
        drawn = yield from still_picture("UI")
        field().neural_sculpt.strokes[0].strength = 0.0
        hand.region("UI").tag_redraw()
        empty = yield from still_picture("UI", unlike=drawn)
        field().neural_sculpt.strokes[0].strength = 1.0
        hand.region("UI").tag_redraw()
        full = yield from still_picture("UI", unlike=empty)
        return changed(full, empty, hand.region("UI"))


def strength() -> float:
    return field().neural_sculpt.strokes[0].strength
