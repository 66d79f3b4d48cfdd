# SPDX-License-Identifier: GPL-3.0-or-later
"""The points of a stroke of the history are edited while results come."""

from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
from harness import SteeredCase, add, field, module, stroke, strokes_of

draw = module("blender.operators.strokes.draw")
stroke_list = module("blender.scene.stroke_list")

MOVED = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]]


class EditPoints(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        stroke(np.eye(3), name="One")
        self.finish()
        (self.entry,) = stroke_list.entries(field("Sphere"))

    def confirm(self) -> None:
        """What Enter does when the points are MOVED."""
        new = replace(self.entry.stroke, points=np.array(MOVED))
        operator = SimpleNamespace(
            uid=self.entry.uid,
            bl_label="Edit Points",
            _listed=self.entry,
            _stroke=lambda *_: new,
            cancel=lambda _: None,
        )
        draw.NEURAL_SCULPT_OT_draw._sculpt(operator, None, bpy.context, field("Sphere"))

    def test_another_field_is_active_by_now(self) -> None:
        """As when it was fitted meanwhile."""
        add("TORUS")
        self.finish()
        self.assertEqual(bpy.context.active_object, field("Torus"))
        self.confirm()
        self.finish()
        (kept,) = strokes_of(field("Sphere"))
        self.assertEqual(kept["points"], MOVED)

    def test_the_stroke_has_left_the_history(self) -> None:
        bpy.ops.neural_sculpt.apply_to_base()
        self.finish()
        with self.assertRaisesRegex(Exception, "no longer in the list"):
            self.confirm()

    def test_the_stroke_is_about_to_leave_the_history(self) -> None:
        bpy.ops.neural_sculpt.apply_to_base()
        self.confirm()
        self.finish()
        self.assertIn("no longer in the list", self.session.last_error)
