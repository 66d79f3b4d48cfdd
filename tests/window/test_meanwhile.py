# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does by keys and mouse while a stroke waits, and Blender's history afterwards.

The worker is stopped meanwhile, so that the stroke waits for as long as the test wants.
"""

import os
import signal

import bmesh
import bpy
import numpy as np
import simulated_input as hand
from drawing import SECONDS, WindowCase, choose_tool, field, middle, operate, redo, undo
from harness import module, vertices
from simulated_input import Steps


class Meanwhile(WindowCase):
    def draw_and_wait(self, tilt: float = 0.0) -> Steps:
        """Draw a stroke that the worker does not hear of yet."""
        os.kill(self.session.client.pid, signal.SIGSTOP)
        yield from hand.drag(hand.to_window(self.arc(tilt)))
        yield from hand.until(lambda: any(j.strokes for j in self.session.jobs), SECONDS, "a job")
        yield 3 * hand.DRAWN

    def go_on(self) -> None:
        os.kill(self.session.client.pid, signal.SIGCONT)

    def listed(self) -> list[bool]:
        """Of each stroke in the list, whether it is muted."""
        return [item.muted for item in field().neural_sculpt.strokes]

    def has_preview(self) -> bool:
        return module("blender.preview").TRUE["position"] in field().data.attributes

    def edited(self) -> bool:
        return module("blender.native_edits").edited(field())

    def test_edit_stroke_escaped_and_undone(self) -> Steps:
        yield from self.add()
        yield from self.draw(self.arc(0.5))
        yield from self.draw(self.arc(-0.5))
        operate(bpy.ops.neural_sculpt.edit_stroke)
        yield 5 * hand.DRAWN
        hand.tap("ESC", middle())
        yield 3 * hand.DRAWN
        for count in (1, 0):
            yield from undo()
            self.assertEqual(len(field().neural_sculpt.strokes), count)
        for count in (1, 2):
            yield from redo()
            self.assertEqual(len(field().neural_sculpt.strokes), count)
        yield 3 * hand.DRAWN

    def test_a_curve_is_shaped_in_the_dialog_of_a_scene_without_curves(self) -> Steps:
        """The choice of a curve in the panel is one step, which undo takes back whole."""
        yield from self.add()
        brush = hand.window().scene.neural_sculpt
        self.assertIsNotNone(brush.curves)
        yield from self.draw(self.arc(0.5))
        yield from self.draw(self.arc(-0.5))
        brush.profile = "CURVE"
        yield from hand.show_tab("Neural Sculpt")
        yield from undo()
        yield from redo()
        brush = hand.window().scene.neural_sculpt
        self.assertIn(brush.curves, [*bpy.data.node_groups])

    def test_edit_mode(self) -> Steps:
        """Tab while a stroke waits: no preview there, and the stroke comes after the next Tab."""
        yield from self.add()
        before = vertices(field())
        yield from self.draw_and_wait()
        self.assertTrue(self.has_preview())
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "EDIT", SECONDS, "Edit Mode")
        yield 3 * hand.DRAWN
        edited = bmesh.from_edit_mesh(field().data)
        np.testing.assert_array_equal([vertex.co[:] for vertex in edited.verts], before)
        self.go_on()
        job = self.session.jobs[0]
        yield from hand.until(lambda: "Edit Mode" in job.message, SECONDS, "a result that waits")
        self.assertEqual(self.listed(), [])
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "OBJECT", SECONDS, "Object Mode")
        yield from self.strokes_are(1)
        self.assertEqual(self.listed(), [False])
        self.assert_raised(self.arc())

    def test_moved_in_edit_mode(self) -> Steps:
        """What is moved there stays, is a native edit, and the stroke is kept, muted."""
        yield from self.add()
        before = vertices(field())
        yield from self.draw_and_wait()
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "EDIT", SECONDS, "Edit Mode")
        yield 3 * hand.DRAWN
        hand.tap("A", middle())
        yield hand.DRAWN
        hand.tap("G", middle())
        yield 3 * hand.DRAWN
        x, y = middle()
        for step in range(10, 101, 10):
            hand.move((x + step, y))
            yield hand.DRAWN
        hand.tap("RET", (x + 100, y))
        yield 3 * hand.DRAWN
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "OBJECT", SECONDS, "Object Mode")
        moved = vertices(field())
        self.assertTrue(self.edited())
        self.go_on()
        yield from hand.until(lambda: bool(self.session.last_error), SECONDS, "a message")
        self.assertIn("in the history, muted", self.session.last_error)
        self.assertEqual(self.listed(), [True])
        np.testing.assert_array_equal(vertices(field()), moved)
        shift = moved - before
        np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-5)
        self.assertGreater(shift[0, 0], 0.05)
        self.session.last_error = ""

    def test_native_brush_while_a_stroke_waits(self) -> Steps:
        """The native stroke stays, ours is muted in the list, and Ctrl Z after Absorb is whole."""
        yield from self.add()
        yield from self.draw(self.arc(0.6))
        bpy.ops.object.mode_set(mode="SCULPT")
        yield hand.DRAWN
        if bpy.context.tool_settings.sculpt.brush is None:
            bpy.ops.object.mode_set(mode="OBJECT")
            self.skipTest("this Blender was packed without brushes")
        choose_tool()
        yield hand.DRAWN
        made = vertices(field())
        yield from self.draw_and_wait()
        self.assertTrue(self.has_preview())
        choose_tool("builtin.brush")
        yield from hand.until(lambda: not self.has_preview(), SECONDS, "no preview")
        np.testing.assert_array_equal(vertices(field()), made)
        yield from hand.drag(hand.to_window(self.arc(-0.5)), pause=0.03)
        yield from hand.until(self.edited, SECONDS, "a native edit")
        sculpted = vertices(field())
        self.go_on()
        yield from hand.until(lambda: bool(self.session.last_error), SECONDS, "a message")
        self.assertIn("Absorb takes that into the field", self.session.last_error)
        self.assertEqual(self.listed(), [False, True])
        np.testing.assert_array_equal(vertices(field()), sculpted)
        self.session.last_error = ""
        operate(bpy.ops.neural_sculpt.absorb)
        yield from self.strokes_are(3)
        self.assertEqual(self.listed(), [False, True, False])
        self.assertFalse(self.edited())
        absorbed = field().neural_sculpt.revision
        yield from undo()
        self.assertNotEqual(field().neural_sculpt.revision, absorbed)
        self.assertEqual(self.listed(), [False, True])
        np.testing.assert_array_equal(vertices(field()), sculpted)
        self.assertTrue(self.edited())
        yield from redo()
        self.assertEqual(field().neural_sculpt.revision, absorbed)
        self.assertFalse(self.edited())

    def test_absorb_right_after_a_native_stroke_is_undone_whole(self) -> Steps:
        """The step before is one of Sculpt Mode, which Blender's history does not load."""
        yield from self.add()
        bpy.ops.object.mode_set(mode="SCULPT")
        yield hand.DRAWN
        if bpy.context.tool_settings.sculpt.brush is None:
            bpy.ops.object.mode_set(mode="OBJECT")
            self.skipTest("this Blender was packed without brushes")
        choose_tool("builtin.brush")
        yield hand.DRAWN
        for tilt in (-0.5, 0.5):
            yield from hand.drag(hand.to_window(self.arc(tilt)), pause=0.03)
        yield from hand.until(self.edited, SECONDS, "a native edit")
        yield 3 * hand.DRAWN
        sculpted, revision = vertices(field()), field().neural_sculpt.revision
        operate(bpy.ops.neural_sculpt.absorb)
        yield from hand.until(lambda: not self.edited(), SECONDS, "an absorbed proxy")
        yield from self.idle()
        yield from undo()
        self.assertEqual(field().neural_sculpt.revision, revision)
        np.testing.assert_array_equal(vertices(field()), sculpted)
        self.assertTrue(self.edited())
        yield from redo()
        self.assertNotEqual(field().neural_sculpt.revision, revision)
        self.assertFalse(self.edited())
