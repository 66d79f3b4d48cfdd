# SPDX-License-Identifier: GPL-3.0-or-later
"""Brush strokes that wait for the scene get there one at a time, whatever comes between them."""

import os
import signal
import time
from contextlib import AbstractContextManager
from unittest.mock import patch

import bpy
import numpy as np
from bpy.types import Object
from harness import arc, call_as, module, push_undo, redo, state, stroke, undo, vertices
from test_live_absorption import BrushCase, brush

STROKES = (("Clay", -50), ("Grab", -20), ("Clay", 20), ("Grab", 50))
NAMES = [name for name, _ in STROKES]
ROUNDING = 0.0 if bpy.app.version >= (5, 0, 0) else 1e-7
"""Of vertices that Blender takes back or brings back."""


class BrushResults(BrushCase):
    """Each stroke becomes a step of ours, as in Blenders that round, for other strokes in all."""

    keeps = False

    def setUp(self) -> None:
        super().setUp()
        self.enterContext(patch.object(module("blender.scene.kept_steps"), "EXACT", self.keeps))
        call_as("Artist")
        self.addCleanup(call_as, "Script")
        self.addCleanup(setattr, self.results, "TAKE_SECONDS", self.results.TAKE_SECONDS)
        self.results.TAKE_SECONDS = 0.0  # one piece in each poll

    def brush_all(self) -> None:
        """Strokes without a rest, until all have their results and none is in the scene."""
        self.before = state(self.ob())
        with self.at_work():
            for each in STROKES:
                brush(*each)
                self.look()
            self.pump(lambda: not self.session.jobs)
        self.sculpted = vertices(self.ob())
        self.assertEqual(self.names(), [])

    def at_work(self) -> AbstractContextManager[object]:
        """While the artist's hand does not rest."""
        return patch.object(self.results, "is_at_work", lambda: True)

    def come_in(self, count: int) -> None:
        """All are brushed, and so many in the scene; with -1 the first step is taken back."""
        self.brush_all()
        self.session.poll_once()
        self.pump(lambda: len(self.names()) >= count)

    def steps(self) -> int:
        """How many steps Blender's history has up to the scene's."""
        return len(module("blender.scene.sculpt_steps").steps()[0])

    def assert_all_are_steps(self, names: list[str]) -> None:
        """The field has these entries, each is one undo step, and nothing else is to be undone."""
        self.assertEqual(self.names(), names)
        self.assertFalse(self.edited())
        self.assertFalse(self.session.jobs)
        whole = state(self.ob())
        for count in reversed(range(len(names))):
            undo()
            self.assertEqual(self.names(), names[:count])
            self.assertFalse(self.edited())
        self.assertEqual(state(self.ob()), self.before)
        for _ in names:
            redo()
        self.assertEqual(state(self.ob()), whole)

    def test_one_at_a_time_and_nothing_is_seen_of_it(self) -> None:
        self.brush_all()
        polls, whole = 0, self.steps()
        while not self.session.rests:
            entries, steps = len(self.names()), self.steps()
            np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
            self.session.poll_once()
            polls += 1
            self.assertLessEqual(len(self.names()) - entries, 1)
            self.assertLessEqual(abs(self.steps() - steps), 1)
        self.assertEqual(polls, 2 * len(STROKES))
        self.assertEqual(self.steps(), whole)
        self.assert_is(self.sculpted)
        self.assert_all_are_steps(NAMES)

    def test_one_alone_comes_in_at_once(self) -> None:
        before, steps = state(self.ob()), self.steps()
        brush("Clay", 0)
        self.sculpted = vertices(self.ob())
        self.look()
        with self.at_work():
            self.pump(lambda: not self.session.jobs)
        self.assertEqual(self.names(), [])
        self.session.poll_once()
        self.assertEqual(self.names(), ["Clay"])
        self.assertEqual(self.steps(), steps + 1)
        self.assert_is(self.sculpted)
        undo()
        self.assertEqual(state(self.ob()), before)

    def test_upon_a_step_of_sculpt_mode(self) -> None:
        """A border is made of what the mesh was before them, not of what is shown meanwhile."""
        brush("Mask", 0)
        self.look()
        before = vertices(self.ob())
        self.brush_all()
        self.finish()
        for _ in NAMES:
            undo()
        self.assertEqual(self.names(), [])
        np.testing.assert_array_equal(vertices(self.ob()), before)
        self.assertFalse(self.edited())

    def test_without_global_undo_they_keep_their_steps(self) -> None:
        """No step of ours can be made."""
        edit = bpy.context.preferences.edit
        edit.use_global_undo = False
        self.addCleanup(setattr, edit, "use_global_undo", True)
        self.brush_all()
        steps = self.steps()
        self.finish()
        self.assertEqual((self.names(), self.steps()), (NAMES, steps))
        undo()
        self.assertEqual(self.names(), NAMES[:-1])
        self.assertFalse(self.edited())
        redo()
        self.assertEqual(self.names(), NAMES)
        self.assertFalse(self.edited())

    def test_undo_has_the_rest_come_in_first(self) -> None:
        for count in (-1, 0, 2, 3):
            with self.subTest(count=count):
                self.come_in(count)
                undo()
                self.assertEqual(self.names(), NAMES[:-1])
                self.assertFalse(self.edited())
                redo()
                self.assert_is(self.sculpted)
                self.assert_all_are_steps(NAMES)
                for _ in NAMES:
                    undo()

    def test_redo_has_the_rest_come_in_first(self) -> None:
        """The brushes' steps that were taken back are not redone."""
        self.come_in(-1)
        redo()
        self.assert_is(self.sculpted)
        self.assert_all_are_steps(NAMES)

    def test_an_export_has_all_of_them(self) -> None:
        """It waits until they are in the scene."""
        self.brush_all()
        first, then = self.folder / "first.safetensors", self.folder / "then.safetensors"
        with self.at_work():
            bpy.ops.neural_sculpt.export(filepath=str(first))
            for _ in range(100):
                self.session.poll_once()
                time.sleep(0.005)
        self.finish()
        self.assertEqual(self.names(), NAMES)
        bpy.ops.neural_sculpt.export(filepath=str(then))
        self.finish()
        self.assertEqual(first.read_bytes(), then.read_bytes())

    def test_a_file_has_all_of_them(self) -> None:
        """What has not come in yet is on the mesh, from which it is absorbed."""
        self.come_in(2)
        self.save_and_open(2)

    def test_a_file_that_is_saved_as_steps_are_taken_back(self) -> None:
        self.come_in(-1)
        self.save_and_open(0)

    def save_and_open(self, count: int) -> None:
        """Save, go on, and open what was saved when `count` of them were there."""
        path = str(self.folder / "saved.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
        self.finish()
        self.assert_all_are_steps(NAMES)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(self.names(), NAMES[:count])
        np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
        self.assertTrue(self.edited())
        self.look()
        self.finish()
        self.assertFalse(self.edited())
        self.assertEqual(self.names(), [*NAMES[:count], "Sculpted"])

    def test_a_stroke_between_them_follows(self) -> None:
        for count in (-1, 2):
            with self.subTest(count=count):
                self.come_in(count)
                with self.at_work():
                    brush("Smooth", 10)
                self.look()
                self.assertEqual(len(self.session.jobs), 1)
                sculpted = vertices(self.ob())
                self.session.poll_once()
                self.assertEqual(self.names(), NAMES[: max(count, 0)])  # one has no result
                self.finish()
                self.assert_is(sculpted)
                self.assert_all_are_steps([*NAMES, "Smooth"])
                for _ in range(len(NAMES) + 1):
                    undo()

    def test_strokes_between_them_as_the_hand_goes_on(self) -> None:
        self.come_in(-1)
        for right in (-20, 0, 20, 40):
            with self.at_work():
                brush("Smooth", right)
            self.look()
            self.session.poll_once()
        sculpted = vertices(self.ob())
        self.finish()
        self.assert_is(sculpted)
        self.assert_all_are_steps([*NAMES, *["Smooth"] * 4])

    def test_a_stroke_between_them_is_undone(self) -> None:
        """It can be redone, and what has a result is what the next undo takes back."""
        self.come_in(2)
        brush("Smooth", 10)
        smooth = vertices(self.ob())
        self.look()
        undo()
        np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
        self.finish()
        redo()
        np.testing.assert_array_equal(vertices(self.ob()), smooth)
        self.look()
        self.assertEqual(self.names(), NAMES[:2])
        undo()
        self.assertEqual(self.names(), NAMES)
        undo()
        self.assertEqual(self.names(), NAMES[:-1])
        for _ in range(2):
            redo()
        self.assert_all_are_steps([*NAMES, "Smooth"])

    def test_a_stroke_after_one_that_was_undone_or_redone(self) -> None:
        for is_redone in (False, True):
            with self.subTest(is_redone=is_redone):
                self.come_in(2)
                brush("Smooth", 10)
                self.look()
                undo()
                if is_redone:
                    redo()
                brush("Grab", 50)
                sculpted = vertices(self.ob())
                self.look()
                self.finish()
                self.assert_is(sculpted)
                names = [*NAMES, *["Smooth"] * is_redone, "Grab"]
                self.assert_all_are_steps(names)
                for _ in names:
                    undo()

    def test_a_stroke_that_is_cancelled_between_them(self) -> None:
        """The others keep their results; it goes on with the next one, looked at before or not."""
        for is_looked_at in (False, True):
            with self.subTest(is_looked_at=is_looked_at):
                self.come_in(2)
                brush("Smooth", 10)
                self.look()
                self.session.cancel()
                if is_looked_at:
                    self.look()
                brush("Grab", 50)
                sculpted = vertices(self.ob())
                self.look()
                self.finish()
                self.assert_is(sculpted)
                self.assert_all_are_steps([*NAMES, "Grab"])
                for _ in range(len(NAMES) + 1):
                    undo()

    def test_the_worker_dies(self) -> None:
        self.come_in(2)
        brush("Smooth", 10)
        self.look()
        self.pump(lambda: self.session.jobs[0].status == "running")
        os.kill(self.session.client.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        self.finish()
        self.assert_all_are_steps([*NAMES, "Smooth"])

    def test_a_job_waits_for_them(self) -> None:
        self.come_in(2)
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        self.assertEqual(self.session.jobs[0].status, "queued")
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assert_all_are_steps([*NAMES, "Neural"])

    def test_a_job_waits_for_a_stroke_that_came_after_it(self) -> None:
        self.come_in(2)
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        brush("Smooth", 10)
        self.look()
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assert_all_are_steps([*NAMES, "Smooth", "Neural"])

    def test_a_stroke_while_a_job_is_computed_comes_first(self) -> None:
        self.before = state(self.ob())
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        self.pump(lambda: self.session.jobs[0].status == "running")
        brush("Clay")
        self.look()
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assert_all_are_steps(["Clay", "Neural"])

    def test_a_stroke_just_after_a_result_is_one_of_its_brush(self) -> None:
        self.before = state(self.ob())
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        self.finish()
        brush("Clay")  # no look came before it
        self.look()
        self.finish()
        self.assert_all_are_steps(["Neural", "Clay"])

    def test_of_both_undo_takes_back_the_last_first(self) -> None:
        self.before = state(self.ob())
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        self.pump(lambda: self.session.jobs[0].status == "running")
        brush("Clay")
        sculpted = vertices(self.ob())
        self.look()
        self.pump(lambda: self.names() == ["Clay"])
        undo()
        self.assertFalse(self.session.jobs)
        self.assert_is(sculpted)
        undo()
        self.assertEqual(state(self.ob()), self.before)
        redo()
        redo()
        self.finish()
        self.assert_all_are_steps(["Clay", "Neural"])

    def test_of_several_undo_takes_back_the_last_first(self) -> None:
        """Those that waited when the brush was used come after its stroke."""
        self.before = state(self.ob())
        for name in ("One", "Two"):
            stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name=name)
        self.pump(lambda: self.session.jobs[0].status == "running")
        brush("Clay")
        self.look()
        self.pump(lambda: self.names() == ["Clay"])
        for waiting in (["One"], []):
            undo()
            self.assertEqual([job.label for job in self.session.jobs], waiting)
            self.assertEqual(self.names(), ["Clay"])
        undo()
        self.assertEqual(state(self.ob()), self.before)
        for _ in range(3):
            redo()
        self.finish()
        self.assert_all_are_steps(["Clay", "One", "Two"])

    def test_a_job_that_waits_for_them_is_undone(self) -> None:
        self.come_in(2)
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        undo()
        self.assertEqual(self.names(), NAMES)
        self.assertFalse(self.session.jobs)
        redo()  # it is asked for again
        self.finish()
        self.assert_all_are_steps([*NAMES, "Neural"])

    def test_the_history_is_changed(self) -> None:
        self.come_in(2)
        first = self.ob().neural_sculpt.strokes[0].uid
        bpy.ops.neural_sculpt.mute_stroke(uid=first)
        self.finish()
        self.assertEqual(self.names(), NAMES)
        self.assertTrue(self.ob().neural_sculpt.strokes[0].muted)
        self.assertFalse(self.edited())
        undo()
        self.assert_all_are_steps(NAMES)

    def test_in_object_mode_they_come_in(self) -> None:
        self.come_in(2)
        self.leave_sculpt_mode()

    def test_in_object_mode_they_come_in_without_taking_steps_back(self) -> None:
        self.come_in(-1)
        self.leave_sculpt_mode()

    def leave_sculpt_mode(self) -> None:
        bpy.ops.object.mode_set(mode="OBJECT")
        push_undo("Object Mode")
        self.finish()
        self.assertEqual(self.names(), NAMES)
        self.assertFalse(self.edited())
        self.assert_is(self.sculpted)

    def test_a_mode_that_is_left_before_they_have_results(self) -> None:
        """The mode's step cannot be taken back for them, so those of the brushes stay: each press
        takes back one thing, byte for byte."""
        before, seen = self.seen(), list[tuple[object, str]]()
        for each in STROKES[:2]:
            brush(*each)
            self.look()
        bpy.ops.object.mode_set(mode="OBJECT")
        push_undo("Object Mode")
        self.finish()
        self.rest()
        expected = [("OBJECT", 2), ("SCULPT", 2), ("SCULPT", 1), ("SCULPT", 0)]
        for presses, (mode, count) in enumerate(expected):
            if presses:
                undo()
            self.assertEqual((self.ob().mode, self.names()), (mode, NAMES[:count]))
            self.assertFalse(self.edited())
            seen.insert(0, self.seen())
        self.assertEqual(seen[0], before)
        for state_then in seen[1:]:
            redo()
            self.assertEqual(self.seen(), state_then)
        self.undo_and_redo(seen, self.seen)

    def test_undone_ones_keep_the_brushes_steps(self) -> None:
        """A step of ours would cut off what can be redone. Nor are they forgotten when undo goes on
        to before all of them."""
        before = self.seen()
        self.brush_all()
        undo()
        self.finish()
        self.assertEqual(self.names(), NAMES[:-1])
        redo()
        self.finish()
        whole = self.seen()
        for count in (3, 2, 1, 0):
            undo()
            self.assertEqual(self.names(), NAMES[:count])
            self.assertFalse(self.edited())
        self.assertEqual(self.seen(), before)
        undo()
        self.assertEqual(self.ob().mode, "OBJECT")
        for count in range(5):
            redo()
            self.assertEqual(self.names(), NAMES[:count])
            self.assertFalse(self.edited())
        self.assertEqual(self.seen(), whole)

    def test_undone_before_anything_has_looked_at_it(self) -> None:
        brush("Clay")
        undo()
        redo()
        self.finish()
        self.assertEqual(self.names(), ["Clay"])
        self.assertFalse(self.edited())

    def test_one_upon_a_border(self) -> None:
        """The border of a neural stroke that waits, and was undone and redone. What came in before
        it is not lost when Blender is led there to make room for a step of ours."""
        brush("Clay", -40)
        self.look()
        self.draw("One")
        undo()
        redo()
        brush("Grab", 40)
        sculpted = vertices(self.ob())
        self.look()
        self.draw("Two")
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.names(), ["Clay", "Grab", "One", "Two"])
        self.assertFalse(self.edited())
        for _ in range(2):
            undo()
        self.assertEqual(self.names(), ["Clay", "Grab"])
        self.assert_is(sculpted)

    def test_undone_ones_without_results_and_then_what_was_before_them(self) -> None:
        """Redo brings all: a brush stroke or a neural one, and those that were made upon it."""
        for first in ("Clay", "Neural"):
            with self.subTest(first=first):
                if first == "Clay":
                    brush("Clay", -50)
                    self.look()
                else:
                    self.draw("Neural")
                self.finish()
                for each in (("Grab", 0), ("Smooth", 50)):
                    brush(*each)
                    self.look()
                sculpted = vertices(self.ob())
                for _ in range(3):
                    undo()
                self.finish()
                self.assertEqual(self.names(), [])
                for _ in range(3):
                    redo()
                np.testing.assert_allclose(vertices(self.ob()), sculpted, rtol=0, atol=ROUNDING)
                self.finish()
                names = [first, "Grab", "Smooth"]
                for count in (3, 2, 1, 0):
                    self.assertEqual(self.names(), names[:count])
                    self.assertFalse(self.edited())
                    if count:
                        undo()

    def test_a_neural_stroke_is_undone_before_they_have_results(self) -> None:
        """Redo comes to a border that was made without them."""
        brush("Clay", -40)
        self.look()
        self.draw("One")
        undo()
        self.finish()
        self.assertEqual(self.names(), ["Clay"])
        redo()
        self.assert_waits("One")
        self.finish()
        self.assertEqual(self.names(), ["Clay", "One"])

    def test_a_neural_stroke_is_redone_when_one_of_two_has_come(self) -> None:
        """The border was made of both, and of neither in the field."""
        for each in STROKES[:2]:
            brush(*each)
            self.look()
        self.draw("One")
        undo()
        self.pump(lambda: self.names() == NAMES[:1])
        redo()
        self.assertEqual(self.names(), NAMES[:1])
        self.finish()
        self.assertEqual(self.names(), [*NAMES[:2], "One"])

    def test_a_neural_stroke_is_undone_in_another_mode_when_one_of_two_has_come(self) -> None:
        """Undo comes to the mode's step, which was made of both, and of neither in the field."""
        for each in STROKES[:2]:
            brush(*each)
            self.look()
        bpy.ops.object.mode_set(mode="OBJECT")
        push_undo("Object Mode")
        self.pump(lambda: self.names() == NAMES[:1])
        self.draw("One")
        undo()
        self.assertEqual(self.names(), NAMES[:1])
        self.finish()
        self.assertEqual(self.names(), NAMES[:2])
        self.assertFalse(self.edited())

    def test_a_mode_that_is_left_with_a_preview(self) -> None:
        """Blender's own step holds what the mesh shows of a neural stroke, too."""
        brush("Clay", -40)
        self.look()
        self.draw("One")
        bpy.ops.object.mode_set(mode="OBJECT")
        module("blender.scene.mesh.preview").preview.show()
        push_undo("Object Mode")
        self.draw("Two")
        self.pump(lambda: self.names() == ["Clay"])
        undo()
        self.assert_waits("One")
        redo()
        self.assert_waits("One", "Two")
        self.finish()
        self.assertEqual(self.names(), ["Clay", "One", "Two"])

    def draw(self, name: str) -> None:
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name=name)

    def assert_waits(self, *names: str) -> None:
        """These neural strokes wait, and the brush's stroke is in the field."""
        self.assertEqual([job.label for job in self.session.jobs], [*names])
        self.assertEqual(self.names(), ["Clay"])
        self.assertFalse(self.edited())

    def seen(self) -> tuple[object, str]:
        """All of the field, with the normals that are behind, and the mode."""
        module("blender.scene.kept_steps").settle()
        return state(self.ob()), self.ob().mode

    def test_in_edit_mode_they_wait(self) -> None:
        self.come_in(2)
        self.toggle_edit_mode()
        self.session.poll_once()
        self.assertEqual(self.names(), NAMES[:2])
        self.toggle_edit_mode()
        self.assertEqual(self.names(), NAMES[:2])
        self.finish()
        self.assertEqual(self.names(), NAMES)
        self.assertFalse(self.edited())
        self.assert_is(self.sculpted)

    def test_edit_mode_is_left_by_undo(self) -> None:
        for count in (-1, 2):
            with self.subTest(count=count):
                self.come_in(count)
                self.toggle_edit_mode()
                undo()
                self.assertNotEqual(self.ob().mode, "EDIT")
                np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
                undo()
                self.assertEqual(self.names(), NAMES[:-1])
                redo()
                self.assert_all_are_steps(NAMES)
                for _ in NAMES:
                    undo()

    def toggle_edit_mode(self) -> None:
        """As Tab does."""
        bpy.ops.object.mode_set(mode="EDIT", toggle=True)
        push_undo("Toggle Edit Mode")

    def test_the_oldest_of_the_brushes_steps_are_gone(self) -> None:
        """More strokes than Blender remembers steps: the rest of them gives way to ours."""
        limit = bpy.context.preferences.edit.undo_steps
        self.addCleanup(setattr, bpy.context.preferences.edit, "undo_steps", limit)
        bpy.context.preferences.edit.undo_steps = 3
        self.brush_all()
        self.finish()
        self.assertEqual(self.names(), NAMES)
        self.assertFalse(self.edited())
        self.assert_is(self.sculpted)
        undo()
        self.assertEqual(self.names(), NAMES[:-1])
        self.assertFalse(self.edited())

    def test_only_the_last_brings_another_proxy(self) -> None:
        """Where brushes have stretched it; until then each is a step with the triangles it had."""
        self.before = state(self.ob())
        count = len(vertices(self.ob()))
        with self.at_work():
            for right in (0.0, 0.3, -0.3):
                self.pull(right)
                self.look()
            self.pump(lambda: not self.session.jobs)
        self.finish()
        self.assertEqual(len(self.names()), 3)
        self.assertFalse(self.edited())
        self.assertNotEqual(len(vertices(self.ob())), count)
        for left in (2, 1):
            undo()
            self.assertEqual(len(self.names()), left)
            self.assertEqual(len(vertices(self.ob())), count)
            self.assertFalse(self.edited())
        brush("Clay", 0)  # the triangles still are stretched, which the next stroke ends
        self.look()
        self.finish()
        self.assertNotEqual(len(vertices(self.ob())), count)
        self.assertEqual(self.names()[1:], ["Clay"])

    def pull(self, right: float) -> None:
        """What a brush would do that grabs far."""
        points = vertices(self.ob())
        axis = np.array([np.sin(right), -np.cos(right), 0])
        share = np.linalg.norm(points - 0.6 * axis, axis=1) / 0.12
        points += 0.2 * (np.clip(1 - share**2, 0, None) ** 2)[:, None] * axis
        self.ob().data.vertices.foreach_set("co", points.astype(np.float32).ravel())

    def ob(self) -> Object:
        return bpy.data.objects["Sphere"]
