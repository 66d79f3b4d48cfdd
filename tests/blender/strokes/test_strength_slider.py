# SPDX-License-Identifier: GPL-3.0-or-later
"""The slider of a stroke's strength changes the stroke that it was dragged for."""

from unittest.mock import patch

import bpy
import numpy as np
from harness import SteeredCase, field, module, stroke

strength = module("blender.panels.strength")


class StrengthSlider(SteeredCase):
    def drag(self, name: str, value: float) -> None:
        """The slider of this field, which is not released yet."""
        bpy.context.view_layer.objects.active = field(name)
        bpy.context.window_manager.neural_sculpt_strength = value

    def strength_of(self, name: str) -> float:
        (item,) = field(name).neural_sculpt.strokes
        return item.strength

    def test_that_of_a_duplicate_follows_at_once(self) -> None:
        """Its strokes have the identities of the original's."""
        stroke(np.eye(3), name="One")
        self.finish()
        self.ob.select_set(True)
        bpy.ops.object.duplicate()
        with (
            patch.object(strength, "timers_run", lambda: True),
            patch.object(bpy.app.timers, "register", lambda *_, **__: None),
        ):
            self.drag("Sphere", 0.5)
            self.drag("Sphere.001", 0.25)
            strength._State.until = 0.0  # it rests
            strength._tick()
        self.finish()
        self.assertEqual(self.strength_of("Sphere"), 0.5)
        self.assertEqual(self.strength_of("Sphere.001"), 0.25)
