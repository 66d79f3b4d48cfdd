# SPDX-License-Identifier: GPL-3.0-or-later
"""The slider of a stroke's strength changes the stroke that it was dragged for."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

import bpy
import numpy as np
from harness import SteeredCase, field, module, redo, state, stroke, undo

strength = module("blender.panels.strength")


class StrengthSlider(SteeredCase):
    @contextmanager
    def timers(self) -> Iterator[None]:
        """Blender has timers, which call nothing but what the test calls."""
        with (
            patch.object(strength, "timers_run", lambda: True),
            patch.object(bpy.app.timers, "register", lambda *_, **__: None),
        ):
            yield

    def drag(self, name: str, value: float) -> None:
        """The slider of this field, which is not released yet."""
        bpy.context.view_layer.objects.active = field(name)
        bpy.context.window_manager.neural_sculpt_strength = value

    def strength_of(self, name: str) -> float:
        return field(name).neural_sculpt.strokes[-1].strength

    def test_that_of_a_duplicate_follows_at_once(self) -> None:
        """Its strokes have the identities of the original's."""
        stroke(np.eye(3), name="One")
        self.finish()
        self.ob.select_set(True)
        bpy.ops.object.duplicate()
        with self.timers():
            self.drag("Sphere", 0.5)
            self.drag("Sphere.001", 0.25)
            strength.finish()
        self.finish()
        self.assertEqual(self.strength_of("Sphere"), 0.5)
        self.assertEqual(self.strength_of("Sphere.001"), 0.25)

    def test_undo_before_it_rests(self) -> None:
        """It takes back the strength that was typed, and nothing before it."""
        for name in ("One", "Two"):
            stroke(np.eye(3), name=name)
            self.finish()
        drawn = state(self.ob)
        with self.timers():
            self.drag("Sphere", 0.5)
            undo()
            strength.finish()
            self.finish()
            self.assertEqual(state(field("Sphere")), drawn)
            redo()
            self.finish()
        self.assertEqual(self.strength_of("Sphere"), 0.5)
