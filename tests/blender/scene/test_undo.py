# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's undo and redo across strokes and what is done between and beside them, byte by byte."""

import time
from collections.abc import Callable

import bpy
import numpy as np
from harness import SteeredCase, add, call_as, field, long, push_undo, redo, state, stroke, undo
from undo_orders import Order, Steps
from undo_sequences import Hands, Sequence


class Undo(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        self.states = [state(self.ob)]

    def stroke(self, meanwhile: Callable[[], None] | None = None) -> None:
        """A stroke; `meanwhile` is done, as a step, while it is computed."""
        stroke(np.eye(3), name=f"Stroke {len(self.states)}")
        if meanwhile:
            self.native(meanwhile)
        self.finish()
        self.states.append(state(field("Sphere")))

    def native(self, change: Callable[[], None]) -> None:
        change()
        push_undo("Native")
        self.states.append(state(field("Sphere")))

    def back_and_forth(self) -> None:
        """All the way back and all the way forth; every state is as it was."""
        self.undo_and_redo(self.states, lambda: state(field("Sphere")))

    def test_three_strokes_and_a_transform(self) -> None:
        self.stroke()
        self.native(lambda: move(1.0))
        self.stroke()
        self.native(lambda: move(2.0))
        self.stroke()
        self.assertEqual(len({seen[3] for seen in self.states}), 4)
        self.assertEqual([len(seen[2]) for seen in self.states], [0, 1, 1, 2, 2, 3])
        self.back_and_forth()
        self.back_and_forth()

    def test_sculpt_mode_alone(self) -> None:
        """Entered and left with nothing between, which Blender takes back as if it was not left."""
        modes = [self.mode()]
        for _ in range(5):
            bpy.ops.sculpt.sculptmode_toggle("EXEC_DEFAULT", True)
            bpy.context.view_layer.update()
            modes.append(self.mode())
        self.assertEqual(modes, 3 * ["OBJECT", "SCULPT"])
        self.undo_and_redo(modes, self.mode)

    def mode(self) -> str:
        return field("Sphere").mode

    def test_the_object_is_moved_before_the_result_comes(self) -> None:
        self.stroke(meanwhile=lambda: move(1.0))
        self.stroke(meanwhile=lambda: move(2.0))
        self.back_and_forth()

    def test_something_else_is_changed_before_the_result_comes(self) -> None:
        self.stroke(meanwhile=lambda: bpy.data.objects.new("Else", None))
        self.stroke()
        self.back_and_forth()

    def test_the_mesh_is_given_a_material_before_the_result_comes(self) -> None:
        self.stroke(meanwhile=paint)
        self.stroke()
        self.back_and_forth()
        self.assertEqual(len(field("Sphere").data.materials), 1)

    def test_in_sculpt_mode(self) -> None:
        bpy.ops.object.mode_set(mode="SCULPT")
        push_undo("Sculpt Mode")
        self.states = [state(field("Sphere"))]
        self.stroke()
        self.stroke(meanwhile=lambda: move(1.0))
        self.back_and_forth()
        self.assertEqual(field("Sphere").mode, "SCULPT")
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_a_job_that_cannot_begin_does_not_drop_the_stroke_after_it(self) -> None:
        bpy.ops.object.mode_set(mode="SCULPT")
        stroke(np.eye(3), name="One")
        bpy.ops.neural_sculpt.absorb()  # of nothing
        stroke(np.eye(3), name="Two")
        self.finish()
        listed = [(item.name, item.muted) for item in field("Sphere").neural_sculpt.strokes]
        self.assertEqual(listed, [("One", False), ("Two", False)])
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_undo_and_another_stroke_leave_the_other_branch(self) -> None:
        self.stroke()
        undo()
        self.assertEqual(state(field("Sphere")), self.states.pop(0))
        del self.states[:]
        self.states.append(state(field("Sphere")))
        self.stroke()
        self.back_and_forth()


class Orders(SteeredCase):
    """Native strokes are taken in by Absorb alone."""

    def setUp(self) -> None:
        super().setUp()
        self.absorb_alone()

    def absorb_alone(self) -> None:
        bpy.context.active_object.neural_sculpt.live = False
        push_undo("How to absorb")

    def test_all_kinds_of_steps_beside_each_other(self) -> None:
        for seconds in Order("test", self).play_borders():
            time.sleep(seconds)

    @long
    def test_random_orders(self) -> None:
        for seed in range(10):
            with self.subTest(seed=seed):
                bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
                push_undo("Start")
                call_as("Script")
                add("SPHERE")
                self.absorb_alone()
                call_as("Artist")
                for seconds in Order(f"test {seed}", self).play():
                    time.sleep(seconds)

    def neural(self) -> Steps:
        stroke(np.eye(3))
        yield from self.end()

    def absorb(self) -> Steps:
        bpy.ops.neural_sculpt.absorb()
        yield from self.end()

    def end(self) -> Steps:
        self.finish()
        self.assertEqual(self.session.last_error, "")
        yield 0.0

    def native(self) -> Steps:
        bpy.ops.sculpt.mesh_filter("EXEC_DEFAULT", True, type="INFLATE", strength=0.5)
        yield 0.0

    def toggle_mode(self) -> Steps:
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="SCULPT", toggle=True)
        yield 0.0

    def undo(self) -> Steps:
        undo()
        yield 0.0

    def redo(self) -> Steps:
        redo()
        yield 0.0


class Sequences(SteeredCase):
    @long
    def test_a_few_of_the_attack(self) -> None:
        for seed in range(3):
            with self.subTest(seed=seed):
                for seconds in Sequence(self, f"test {seed}", Hands()).play():
                    time.sleep(seconds)


def move(x: float) -> None:
    field("Sphere").location.x = x
    bpy.context.view_layer.update()


def paint() -> None:
    field("Sphere").data.materials.append(bpy.data.materials.new("Clay"))
