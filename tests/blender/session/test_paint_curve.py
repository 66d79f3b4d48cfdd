# SPDX-License-Identifier: GPL-3.0-or-later
"""A brush of Sculpt Mode strokes along a paint curve, which has undo steps of its own."""

import bpy
import numpy as np
from harness import SteeredCase, field, push_undo, state, stroke
from test_live_absorption import view


class PaintCurve(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        bpy.ops.object.mode_set(mode="SCULPT")
        push_undo("Sculpt Mode")
        if self.brush() is None:
            self.skipTest("this Blender has its brushes in a window alone")
        self.brush().stroke_method = "CURVE"
        with bpy.context.temp_override(**view()):
            bpy.ops.paintcurve.new()

    def brush(self) -> bpy.types.Brush:
        return bpy.context.tool_settings.sculpt.brush

    def test_strokes_are_undone_and_redone(self) -> None:
        states = [state(field("Sphere"))]
        for name in ("One", "Two"):
            stroke(np.eye(3), name=name)
            self.finish()
            states.append(state(field("Sphere")))
        self.undo_and_redo(states, lambda: state(field("Sphere")))
        self.assertEqual(self.brush().stroke_method, "CURVE")
