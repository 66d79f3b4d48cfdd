# SPDX-License-Identifier: GPL-3.0-or-later
"""What the dialog Edit Stroke shows on the surface: it is in no mesh, and goes when the field is in
another state."""

from dataclasses import replace

import bpy
import numpy as np
from harness import SculptCase, add, arc, field, module, push_undo, redo, state, stroke, undo

changed_stroke = module("blender.viewport.changed_stroke")
stroke_list = module("blender.scene.stroke_list")
Brush = module("stroke.brush").Brush
RADIUS, INTENSITY = 0.15, 0.06


class EditPreview(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.addCleanup(changed_stroke.hide)
        self.name = add().name
        self.before = state(field(self.name))
        brush = {"radius": RADIUS, "intensity": INTENSITY}
        self.size = np.linalg.norm(arc(field(self.name)), axis=1).mean()
        stroke(arc(field(self.name)), **brush)
        self.drawn = state(field(self.name))

    def show(self, **given: float) -> np.ndarray:
        """Show the stroke with another brush; points (R, C, 3) of its ribbon."""
        ob = field(self.name)
        entry = stroke_list.listed_entry(ob, stroke_list.active_uid(ob))
        brush = Brush(**{"radius": RADIUS, "intensity": INTENSITY} | given)
        new = replace(entry.stroke, brush=brush)
        changed_stroke.show(ob, entry, new)
        shown = changed_stroke.shown()
        self.assertEqual(shown.stroke, new)
        return shown.ribbons[0].points

    def test_it_is_where_the_surface_will_be(self) -> None:
        """Along the middle, above the sphere that was there before the stroke."""
        for height in (0.03, -0.05, 0.09):
            points = self.show(intensity=height)
            middle = np.linalg.norm(points[5:-5, points.shape[1] // 2], axis=1)
            np.testing.assert_allclose(middle - self.size, height, atol=0.01)

    def test_nothing_of_it_is_in_the_field(self) -> None:
        self.show(intensity=-0.02)
        self.assertEqual(state(field(self.name)), self.drawn)
        undo()
        self.assertEqual(state(field(self.name)), self.before)
        redo()
        self.assertEqual(state(field(self.name)), self.drawn)

    def test_it_goes(self) -> None:
        """When the dialog is closed, and with the state of the field whose it is."""
        ways = {
            "closed": changed_stroke.hide,
            "changed": bpy.ops.neural_sculpt.mute_stroke,
            "undone": undo,
            "redone": redo,
            "mode": lambda: bpy.ops.object.mode_set(mode="EDIT"),
            "hidden": lambda: field(self.name).hide_set(True),
            "file": lambda: bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True),
        }
        push_undo("Shown")
        for way, act in ways.items():
            with self.subTest(way):
                self.show(radius=0.2)
                act()
                self.assertIsNone(changed_stroke.shown())
                if way == "mode":
                    bpy.ops.object.mode_set(mode="OBJECT")
                elif way == "hidden":
                    field(self.name).hide_set(False)
