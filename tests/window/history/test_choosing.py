# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of the history are found on the surface, and the surface of another field is drawn on."""

import bpy
import numpy as np
from drawing import (
    RADIUS,
    WindowCase,
    changed,
    corner,
    field,
    middle,
    operate,
    still_picture,
    undo,
)
from harness import state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class Choosing(WindowCase):
    def test_the_stroke_under_the_mouse(self) -> Steps:
        """J chooses it in the list and shows it, until the history changes; a miss says so."""
        yield from self.add()
        upper, lower = self.arc(0.5), self.arc(-0.5)
        for path in (upper, lower):
            yield from self.draw(path)
        group = field().neural_sculpt
        self.assertEqual(group.active_stroke, 1)
        hand.move(corner())
        plain = yield from still_picture()
        for number, path in enumerate((upper, lower)):
            (at,) = hand.to_window([path[7]])
            hand.move(at)
            yield hand.DRAWN
            hand.tap("J", at)
            yield hand.DRAWN
            self.assertEqual(field().neural_sculpt.active_stroke, number)
            hand.move(corner())
            shown = yield from still_picture()
            left, bottom, right, top = changed(plain, shown, hand.region())
            ends = hand.to_window(path[[0, -1]])
            self.assertAlmostEqual(left, ends[0][0], delta=20)
            self.assertAlmostEqual(right, ends[1][0], delta=20)
            height = hand.to_window([path[7]])[0][1]
            self.assertTrue(bottom - 20 <= height <= top + 20, (bottom, height, top))
        before = state(field())
        hand.move(middle())
        yield hand.DRAWN
        hand.tap("J", middle())  # between both
        yield hand.DRAWN
        self.assertEqual(field().neural_sculpt.active_stroke, 1)
        self.assertEqual(state(field()), before)

    def test_a_drag_on_another_field(self) -> Steps:
        """It becomes the active one and gets the stroke; a click on it selects it alone."""
        yield from self.add()
        first = field().name
        second = yield from self.beside()
        for name in (first, second):
            before = {ob.name: state(ob) for ob in bpy.data.objects}
            at = hand.to_window(self.front(name))
            hand.move(at[2])
            yield hand.DRAWN
            hand.tap("LEFTMOUSE", at[2])
            yield 3 * hand.DRAWN
            self.assertEqual(bpy.context.view_layer.objects.active.name, name)
            self.assertEqual([ob.name for ob in bpy.context.selected_objects], [name])
            self.assertFalse([job for job in self.session.jobs if job.strokes])
            self.assertEqual({ob.name: state(ob) for ob in bpy.data.objects}, before)
        yield from self.idle()
        yield from hand.drag(hand.to_window(self.front(first)))
        yield from self.strokes_are(1)
        self.assertEqual(bpy.context.view_layer.objects.active.name, first)
        self.assertEqual(len(bpy.data.objects[second].neural_sculpt.strokes), 0)
        yield from undo()
        self.assertEqual(len(bpy.data.objects[first].neural_sculpt.strokes), 0)
        self.assertEqual(bpy.context.view_layer.objects.active.name, first)
        yield from undo()
        self.assertEqual(bpy.context.view_layer.objects.active.name, second)

    def beside(self) -> Steps:
        """Add a second field beside the first; its name."""
        operate(bpy.ops.neural_sculpt.add, kind="TORUS")
        yield from self.idle()
        ob = bpy.context.view_layer.objects.active
        ob.scale = (0.5, 0.5, 0.5)
        ob.location.x = -1.7 * self.size
        ob.rotation_euler.x = np.pi / 2  # its hole faces the viewer
        ob.location.z = 0.3
        bpy.ops.ed.undo_push(message="Place")
        yield 3 * hand.DRAWN
        return ob.name

    def front(self, name: str) -> np.ndarray:
        """Points (5, 3) of the world across the part of a field that is nearest to the viewer."""
        ob = bpy.data.objects[name]
        world = vertices(ob) @ np.array(ob.matrix_world.to_3x3()).T + ob.matrix_world.translation
        nearest = world[world[:, 1].argmin()]
        return nearest + np.linspace(-0.4, 0.4, 5)[:, None] * (RADIUS, 0, 0)
