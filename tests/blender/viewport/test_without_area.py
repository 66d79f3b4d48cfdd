# SPDX-License-Identifier: GPL-3.0-or-later
"""Modal operators whose area is gone: with its window, or because a menu has maximized it while
points are edited. Their context then has the area under the mouse, or none."""

from types import FunctionType, SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
from harness import SteeredCase, field, module, stroke

draw = module("blender.operators.strokes.draw")
drawing = module("interaction.drawing")
overlay = module("blender.viewport.overlay")
stroke_list = module("blender.scene.stroke_list")
Resize = module("blender.operators.strokes.resize").NEURAL_SCULPT_OT_resize

PLACE = {"mouse_x": 5, "mouse_y": 5, "pressure": 1.0}
KEYS = {"alt": False, "ctrl": False, "oskey": False, "shift": False}


def methods(operator: type) -> dict[str, FunctionType]:
    """Those of an operator, which cannot be made but by Blender."""
    return {name: each for name, each in vars(operator).items() if isinstance(each, FunctionType)}


class WithoutArea(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        self.context = MagicMock(wraps=bpy.context, area=None, mode="OBJECT")
        self.context.active_object = self.ob

    def event(self, kind: str, value: str = "PRESS") -> SimpleNamespace:
        return SimpleNamespace(type=kind, value=value, **PLACE, **KEYS)

    def test_points_are_edited(self) -> None:
        """To the end: Enter sculpts them."""
        stroke(np.eye(3), name="One")
        self.finish()
        ob = field("Sphere")
        (entry,) = stroke_list.entries(ob)
        operator = type("Operator", (), methods(draw.NEURAL_SCULPT_OT_draw))()
        operator.uid, operator.bl_label = entry.uid, "Edit Points"
        operator._target, operator._turned = ob.session_uid, False
        operator._begin_again(bpy.context, ob)
        operator._drawing.line.points[0] = (0.5, 0.0, 0.0)
        self.assertEqual(operator.modal(self.context, self.event("MOUSEMOVE")), draw.PASS)
        self.assertEqual(operator.modal(self.context, self.event("LEFTMOUSE")), draw.PASS)
        self.assertEqual(operator.modal(self.context, self.event("RET")), {"FINISHED"})
        self.finish()
        (entry,) = stroke_list.entries(field("Sphere"))
        self.assertEqual(entry.stroke.points[0].tolist(), [0.5, 0.0, 0.0])

    def test_a_press_is_waited_for(self) -> None:
        operator = type("Operator", (), methods(draw.NEURAL_SCULPT_OT_draw))()
        operator._target, operator._drawing = self.ob.session_uid, None
        self.assertEqual(operator.modal(self.context, self.event("LEFTMOUSE")), draw.PASS)

    def test_the_brush_is_resized(self) -> None:
        """As its window closes."""
        overlay.hold_brush(overlay.Anchor(self.ob.session_uid, (0, 0, 1), (0, 0, 1)))
        Resize.cancel(SimpleNamespace(), self.context)
