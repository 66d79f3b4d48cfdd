# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt Mode by keys: one Ctrl Z takes back the first neural stroke, and one Absorb; Shift smooths
while our tool is chosen."""

import bpy
import numpy as np
from drawing import (
    INTENSITY,
    RADIUS,
    WindowCase,
    choose_tool,
    edited,
    enter_sculpt_mode,
    field,
    operate,
    redo,
    undo,
)
from harness import brush_settings, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class SculptModeKeys(WindowCase):
    def test_one_ctrl_z_takes_back_the_first_stroke(self) -> Steps:
        yield from self.add()
        yield from enter_sculpt_mode()
        choose_tool()
        yield hand.DRAWN
        before = state(field())
        yield from self.draw(self.arc())
        after = state(field())
        yield from undo()
        self.assertEqual(field().mode, "SCULPT")
        self.assertEqual(state(field()), before)
        yield from redo()
        self.assertEqual(state(field()), after)
        yield from undo()
        yield from undo()  # the mode
        self.assertEqual(field().mode, "OBJECT")

    def test_one_ctrl_z_takes_back_absorb(self) -> Steps:
        """What the brush did is there again, and is absorbed no more."""
        yield from self.add()
        yield from enter_sculpt_mode()
        yield from self.native(-0.3)
        sculpted = vertices(field())
        operate(bpy.ops.neural_sculpt.absorb)
        yield from self.strokes_are(1)
        self.assertFalse(edited())
        yield from undo()
        self.assertEqual(len(field().neural_sculpt.strokes), 0)
        np.testing.assert_allclose(vertices(field()), sculpted, atol=1e-6)
        self.assertTrue(edited())

    def test_shift_smooths(self) -> Steps:
        """It is our stroke, not one of Blender's brush Smooth."""
        yield from self.add()
        yield from enter_sculpt_mode()
        choose_tool()
        yield hand.DRAWN
        path = self.arc()
        yield from self.draw(path)
        high = self.heights().max()
        brush_settings().radius = 2 * RADIUS  # what is finer goes
        yield from self.draw(path, ("shift",))
        self.assertFalse(edited())
        kind = field().neural_sculpt.strokes[1].name
        self.assertEqual(kind, "Smooth")
        self.assertLess(self.heights().max(), high - 0.1 * INTENSITY)
