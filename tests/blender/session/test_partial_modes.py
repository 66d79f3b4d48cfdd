# SPDX-License-Identifier: GPL-3.0-or-later
"""Modes whose undo steps hold images or hair alone: results wait until they are left."""

import bpy
import numpy as np
from bpy.types import Object
from harness import SteeredCase, field, push_undo, redo, state, stroke, undo


class PartialModes(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        bpy.ops.mesh.primitive_cube_add()
        for ob in (self.ob, bpy.context.active_object):
            ob.modifiers.new("Hair", "PARTICLE_SYSTEM")
            ob.particle_systems[0].settings.type = "HAIR"
        bpy.context.view_layer.objects.active = self.ob
        push_undo("Hair")
        self.before = state(self.ob)

    def toggle(self, mode: str) -> None:
        """Enter or leave a mode, as an artist does."""
        if mode == "PARTICLE":
            bpy.ops.particle.particle_edit_toggle("EXEC_DEFAULT", True)
        else:
            bpy.ops.paint.texture_paint_toggle("EXEC_DEFAULT", True)

    def wait_in(self, mode: str, ob: Object) -> None:
        """A stroke has its result while an object is in another mode."""
        stroke(np.eye(3), name="One")
        bpy.context.view_layer.objects.active = ob
        self.toggle(mode)
        self.assertIn(mode, bpy.context.mode)
        self.say("go")
        self.pump(lambda: not self.session.jobs or "this mode" in self.session.jobs[0].message)
        self.assertEqual(len(field("Sphere").neural_sculpt.strokes), 0)

    def test_the_stroke_is_undone_and_redone(self) -> None:
        for mode in ("PAINT_TEXTURE", "PARTICLE"):
            for name in ("Sphere", "Cube"):
                with self.subTest(mode=mode, name=name):
                    self.wait_in(mode, bpy.data.objects[name])
                    self.toggle(mode)
                    self.finish()
                    drawn = state(field("Sphere"))
                    self.assertEqual(len(field("Sphere").neural_sculpt.strokes), 1)
                    undo()
                    self.assertEqual(state(field("Sphere")), self.before)
                    redo()
                    self.assertEqual(state(field("Sphere")), drawn)
                    undo()
                    bpy.context.view_layer.objects.active = field("Sphere")

    def test_nothing_is_asked_for_there(self) -> None:
        for mode in ("PAINT_TEXTURE", "PARTICLE"):
            self.toggle(mode)
            with self.assertRaisesRegex(RuntimeError, "Leave it for Object Mode"):
                bpy.ops.neural_sculpt.stroke()
            with self.assertRaisesRegex(RuntimeError, "Leave it for Object Mode"):
                bpy.ops.neural_sculpt.choose_solver(solver="NETWORK")
            self.toggle(mode)
