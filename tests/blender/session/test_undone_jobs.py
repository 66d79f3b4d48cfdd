# SPDX-License-Identifier: GPL-3.0-or-later
"""What undo takes back before it has a result, redo brings back: one change for each press."""

import bpy
import numpy as np
from harness import SteeredCase, field, module, push_undo, redo, state, stroke, undo

sculpt_steps = module("blender.scene.sculpt_steps")


class UndoneJobs(SteeredCase):
    def waiting(self) -> list[str]:
        return [job.label for job in self.session.jobs]

    def listed(self) -> list[str]:
        return [item.name for item in field("Sphere").neural_sculpt.strokes]

    def draw(self, *names: str) -> None:
        for name in names:
            stroke(np.eye(3), name=name)

    def go_back_and_forth(self) -> None:
        """All that waits is taken back and brought back, one for each press."""
        names = self.waiting()
        for count in range(len(names)):
            undo()
            self.assertEqual(self.waiting(), names[: -count - 1])
        for count in range(len(names)):
            redo()
            self.assertEqual(self.waiting(), names[: count + 1])

    def test_each_redo_brings_back_one(self) -> None:
        before = state(self.ob)
        self.draw("One", "Two", "Three")
        self.go_back_and_forth()
        self.go_back_and_forth()
        self.finish()
        states = [before]
        for count in (2, 1, 0):
            states.insert(1, state(field("Sphere")))
            undo()
            self.assertEqual(self.listed(), ["One", "Two", "Three"][:count])
        for expected in states:
            self.assertEqual(state(field("Sphere")), expected)
            if expected is not states[-1]:
                redo()

    def test_a_stroke_of_any_name_is_one_press(self) -> None:
        """Such as that of an object, along whose lines it was sculpted."""
        for name in ("Border", "Renewed Proxy", "Two\nlines", "It's 'one'"):
            with self.subTest(name=name):
                self.draw("Before")
                self.finish()
                before = state(field("Sphere"))
                self.draw(name)
                self.finish()
                drawn = state(field("Sphere"))
                self.assertEqual(sculpt_steps.active().name, name)
                undo()
                self.assertEqual(state(field("Sphere")), before)
                redo()
                self.assertEqual(state(field("Sphere")), drawn)

    def test_what_was_done_before_is_one_press_away(self) -> None:
        for mode in ("OBJECT", "SCULPT"):
            with self.subTest(mode=mode):
                bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=mode)
                before = state(field("Sphere"))
                self.draw("Before")
                self.finish()
                drawn = state(field("Sphere"))
                self.draw("One", "Two")
                self.go_back_and_forth()
                undo()
                undo()
                self.assertEqual(state(field("Sphere"))[2:], drawn[2:])
                undo()
                self.assertEqual(state(field("Sphere")), before)
                redo()
                self.assertEqual(state(field("Sphere"))[2:], drawn[2:])
                for count in (1, 2):
                    redo()
                    self.assertEqual(self.waiting(), ["One", "Two"][:count])
                self.session.cancel()
                undo()
                self.assertEqual(state(field("Sphere")), before)
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_a_jump_in_the_history_brings_back_all_that_it_passes(self) -> None:
        before = state(self.ob)
        self.draw("One", "Two", "Three")
        for _ in range(3):
            undo()
        place = len(sculpt_steps.steps()[0])
        jump(place + 1)
        self.assertEqual(self.waiting(), ["One", "Two"])
        redo()
        self.assertEqual(self.waiting(), ["One", "Two", "Three"])
        self.finish()
        for count in (2, 1, 0):
            undo()
            self.assertEqual(self.listed(), ["One", "Two", "Three"][:count])
        self.assertEqual(state(field("Sphere")), before)

    def test_a_jump_past_the_place_where_one_was_undone(self) -> None:
        """Without a border, for something else can be redone there."""
        self.draw("One")
        place = len(sculpt_steps.steps()[0]) - 1
        for x in (1.0, 2.0):
            field("Sphere").location.x = x
            push_undo("Move")
        for waiting in (["One"], ["One"], []):
            undo()
            self.assertEqual(self.waiting(), waiting)
        jump(place + 2)
        self.assertEqual((self.waiting(), field("Sphere").location.x), (["One"], 2.0))
        self.finish()
        self.assertEqual(self.listed(), ["One"])

    def test_the_object_is_deleted_and_comes_back(self) -> None:
        """Before the strokes have results, which then find no object."""
        self.draw("One", "Two")
        self.ob.select_set(True)
        bpy.ops.object.delete("EXEC_DEFAULT", True)
        self.finish()
        self.assertIn("the object is gone", self.session.last_error)
        self.assertEqual(self.waiting(), [])
        undo()
        self.assertEqual(self.waiting(), ["One", "Two"])
        redo()
        self.assertEqual((self.waiting(), len(bpy.data.objects)), ([], 0))
        undo()
        self.assertEqual(self.waiting(), ["One", "Two"])
        self.draw("Three")
        self.finish()
        self.assertEqual(self.listed(), ["One", "Two", "Three"])

    def test_a_result_comes_before_redo(self) -> None:
        for mode in ("OBJECT", "SCULPT"):
            with self.subTest(mode=mode):
                bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=mode)
                self.draw("One", "Two", "Three")
                undo()
                undo()
                self.finish()
                self.assertEqual(self.listed()[-1], "One")
                one = state(field("Sphere"))
                for name in ("Two", "Three"):
                    redo()
                    self.assertEqual(self.waiting(), [name])
                    self.finish()
                    self.assertEqual(self.listed()[-1], name)
                undo()
                undo()
                self.assertEqual(state(field("Sphere")), one)
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_a_result_comes_behind_what_was_done_meanwhile(self) -> None:
        """What still waits comes behind that result, and so is undone before it."""
        self.draw("One", "Two", "Three")
        bpy.context.object.location.x = 1.0
        push_undo("Move")
        self.say("go")
        self.pump(lambda: self.listed() == ["One"])
        (self.folder / "go").unlink()
        for waiting in (["Two"], []):
            undo()
            self.assertEqual((self.listed(), self.waiting()), (["One"], waiting))
        undo()
        self.assertEqual((self.listed(), field("Sphere").location.x), ([], 1.0))
        undo()
        self.assertEqual(field("Sphere").location.x, 0.0)

    def test_what_is_done_instead_cuts_it_off(self) -> None:
        self.draw("One", "Two")
        undo()
        undo()
        self.draw("Three")
        self.finish()
        undo()
        redo()
        self.assertEqual(self.waiting(), [])
        self.assertEqual(self.listed(), ["Three"])


def jump(place: int) -> None:
    """Choose a step in Blender's menu of its history, by its number."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo_history(item=place)
