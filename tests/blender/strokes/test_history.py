# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of strokes: mute, solo, rename, delete, order, duplicate, edit again, apply to base."""

from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from harness import (
    EXTENSION,
    SculptCase,
    add,
    arc,
    brush_settings,
    field,
    long,
    module,
    push_undo,
    redo,
    state,
    stroke,
    strokes_of,
    undo,
    vertices,
)

RADIUS, INTENSITY = 0.15, 0.06
SIZE = 0.6  # of the sphere
TILTS = {"One": 0.0, "Two": 1.2, "Three": 2.4}
ops = bpy.ops.neural_sculpt


class History(SculptCase):
    """Three strokes on a sphere, far from one another; drawn once."""

    drawn_file: str = ""
    before_last: np.ndarray

    def setUp(self) -> None:
        super().setUp()
        if not History.drawn_file:
            History.drawn_file = self.draw()
        bpy.ops.wm.open_mainfile(filepath=History.drawn_file)
        push_undo("Open")
        self.ob = field("Sphere")
        self.drawn = state(self.ob)

    def draw(self) -> str:
        """The file in which all tests begin; its proxies are uniform, so their vertices compare."""
        bpy.context.preferences.addons[EXTENSION].preferences.refine = False
        folder = TemporaryDirectory()
        self.addClassCleanup(folder.cleanup)
        ob = add("SPHERE")
        for name, tilt in TILTS.items():
            History.before_last = vertices(ob)
            stroke(arc(ob, tilt=tilt), radius=RADIUS, intensity=INTENSITY, name=name)
        path = str(Path(folder.name) / "drawn.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        return path

    def uid(self, name: str) -> str:
        return next(item.uid for item in field("Sphere").neural_sculpt.strokes if item.name == name)

    def names(self) -> list[str]:
        return [item.name for item in field("Sphere").neural_sculpt.strokes]

    def heights(self) -> dict[str, float]:
        """Height of the field in the middle of each stroke, in intensities."""
        points = vertices(field("Sphere"))
        size = np.linalg.norm(points, axis=1)
        heights = {}
        for name, tilt in TILTS.items():
            middle = np.array([0, np.sin(-tilt), np.cos(tilt)])
            near = (points @ middle) / size > 0.997
            heights[name] = (float(size[near].mean()) - SIZE) / INTENSITY
        return heights

    def assert_heights(self, **wanted: float) -> None:
        heights = self.heights()
        for name, height in wanted.items():
            self.assertAlmostEqual(heights[name], height, delta=0.3, msg=str(heights))

    def test_a_stroke_that_has_left_the_list_is_not_changed(self) -> None:
        stroke_list = module("blender.scene.stroke_list")
        *others, last = stroke_list.entries(field("Sphere"))
        changed = stroke_list.changed([*others, last], last.uid, others[0].stroke)
        self.assertEqual([entry.data for entry in changed][-1], others[0].data)
        error = module("common.errors").SculptError
        with self.assertRaisesRegex(error, "no longer in the list"):
            stroke_list.changed(others, last.uid, last.stroke)

    def test_mute_and_unmute(self) -> None:
        self.assert_heights(One=1, Two=1, Three=1)
        ops.mute_stroke(uid=self.uid("Two"))
        muted = state(self.ob)
        self.assert_heights(One=1, Two=0, Three=1)
        self.assertEqual([item.muted for item in self.ob.neural_sculpt.strokes], [0, 1, 0])
        ops.mute_stroke(uid=self.uid("Two"))
        self.assert_heights(One=1, Two=1, Three=1)
        undo()
        self.assertEqual(state(field("Sphere")), muted)
        undo()
        self.assertEqual(state(field("Sphere")), self.drawn)
        redo()
        self.assertEqual(state(field("Sphere")), muted)

    def test_without_the_last_stroke_the_field_is_as_it_was_before_it(self) -> None:
        ops.mute_stroke(uid=self.uid("Three"))
        np.testing.assert_allclose(vertices(self.ob), self.before_last, atol=5e-3)

    @long
    def test_a_replay_by_another_worker_makes_the_same_field(self) -> None:
        self.session.stop()
        ops.mute_stroke(uid=self.uid("Three"))
        np.testing.assert_allclose(vertices(self.ob), self.before_last, atol=5e-3)

    def test_a_stroke_that_lies_on_a_muted_one_is_laid_on_what_is_below(self) -> None:
        """It is narrower than the other is high."""
        on_one = arc(self.ob) * (1 + INTENSITY / SIZE)
        stroke(on_one, radius=0.05, intensity=INTENSITY, name="Over One")
        ops.mute_stroke(uid=self.uid("One"))
        self.assert_heights(One=0.6)  # in the mean of more than its width

    def test_all_muted_is_the_base(self) -> None:
        for name in TILTS:
            ops.mute_stroke(uid=self.uid(name))
        group = field("Sphere").neural_sculpt
        size = np.linalg.norm(vertices(field("Sphere")), axis=1)
        np.testing.assert_allclose(size, SIZE, atol=0.01)
        self.assertEqual(group.report, "")

    def test_solo(self) -> None:
        ops.solo_stroke(uid=self.uid("Two"))
        self.assert_heights(One=0, Two=1, Three=0)
        ops.solo_stroke(uid=self.uid("Two"))
        self.assert_heights(One=1, Two=1, Three=1)
        self.assertEqual(self.names(), [*TILTS])

    def test_delete(self) -> None:
        self.ob.neural_sculpt.active_stroke = 1
        ops.delete_stroke()
        self.assertEqual(self.names(), ["One", "Three"])
        self.assert_heights(One=1, Two=0, Three=1)
        undo()
        self.assertEqual(state(field("Sphere")), self.drawn)

    def test_duplicate(self) -> None:
        ops.duplicate_stroke(uid=self.uid("Three"))
        self.assertEqual(self.names(), [*TILTS, "Three"])
        self.assertEqual(len({item.uid for item in self.ob.neural_sculpt.strokes}), 4)
        self.assert_heights(One=1, Two=1, Three=2)

    def test_order_and_the_chosen_stroke(self) -> None:
        self.ob.neural_sculpt.active_stroke = 2
        ops.move_stroke(direction="UP")
        self.assertEqual(self.names(), ["One", "Three", "Two"])
        self.assertEqual(self.ob.neural_sculpt.active_stroke, 1, "it is chosen still")
        self.assertNotEqual(self.ob.neural_sculpt.revision, self.drawn[3])
        self.assert_heights(One=1, Two=1, Three=1)
        moved = state(self.ob)
        ops.move_stroke(uid=self.uid("Two"), direction="DOWN")
        self.assertEqual(state(self.ob), moved, "it is the last already")

    def test_what_changes_no_stroke_that_is_heard_needs_no_replay(self) -> None:
        ops.mute_stroke(uid=self.uid("Two"))
        muted = state(self.ob)
        self.session.stop()
        ops.move_stroke(uid=self.uid("Two"), direction="DOWN")
        self.assertEqual(self.names(), ["One", "Three", "Two"])
        ops.delete_stroke(uid=self.uid("Two"))
        self.assertEqual(self.names(), ["One", "Three"])
        self.assertIsNone(self.session.client, "no worker was needed")
        self.assertEqual(state(self.ob)[5], muted[5])
        undo()
        undo()
        self.assertEqual(state(field("Sphere")), muted)

    def test_rename(self) -> None:
        self.ob.neural_sculpt.strokes[1].name = "Brow"
        ops.mute_stroke(uid=self.uid("One"))
        self.assertEqual(self.names(), ["One", "Brow", "Three"])
        self.assertEqual(strokes_of(self.ob)[1]["name"], "Brow")

    def test_edit_again(self) -> None:
        before = strokes_of(self.ob)
        ops.edit_stroke(uid=self.uid("Three"), intensity=-INTENSITY, profile="LINEAR")
        self.assert_heights(One=1, Two=1, Three=-0.8)
        after = strokes_of(self.ob)
        self.assertEqual(after[:2], before[:2])
        changed = {key for key in after[2] if after[2].get(key) != before[2].get(key)}
        self.assertEqual(changed, {"intensity", "profile"})
        undo()
        self.assertEqual(state(field("Sphere")), self.drawn)

    @long
    def test_a_stroke_that_smooths(self) -> None:
        """It is edited and muted as all strokes are, and computed again on what is below."""
        top = arc(self.ob) * (SIZE + INTENSITY) / SIZE
        settings = brush_settings()
        settings.kind, settings.strength = "SMOOTH", 1.0
        stroke(top, radius=0.3)
        smooth = strokes_of(self.ob)[-1]
        self.assertEqual((smooth["kind"], smooth["intensity"]), ("smooth", 1.0))
        self.assertEqual(self.names()[-1], "Smooth")
        faired = self.heights()["One"]
        self.assertLess(faired, 0.75)
        self.assert_heights(Two=1, Three=1)
        ops.edit_stroke(uid=self.uid("Smooth"), strength=0.5)
        self.assertEqual(strokes_of(self.ob)[-1], {**smooth, "intensity": 0.5})
        self.assertAlmostEqual(self.heights()["One"], (1 + faired) / 2, delta=0.1)
        ops.mute_stroke(uid=self.uid("Smooth"))
        before = np.frombuffer(self.drawn[5], np.float32).reshape(-1, 3)
        np.testing.assert_allclose(vertices(self.ob), before, atol=5e-3)
        ops.mute_stroke(uid=self.uid("Smooth"))
        ops.mute_stroke(uid=self.uid("One"))
        self.assert_heights(One=0, Two=1, Three=1)

    def test_edit_again_without_pressure(self) -> None:
        pressed = [
            {"name": "", "location": p, "radius_factor": 1.0, "intensity_factor": f}
            for p, f in zip(arc(self.ob, tilt=-1.2).tolist(), np.linspace(0, 1, 9), strict=True)
        ]
        ops.stroke(points=pressed, radius=RADIUS, intensity=INTENSITY, name="Pressed")
        before = strokes_of(self.ob)[-1]
        ops.edit_stroke(uid=self.uid("Pressed"), pressure=False)
        after = strokes_of(self.ob)[-1]
        self.assertEqual(before, {**after, "intensity_factors": before["intensity_factors"]})
        self.assertNotIn("intensity_factors", after)
        ops.edit_stroke(uid=self.uid("Pressed"), closed=True)
        self.assertEqual(strokes_of(self.ob)[-1], {**after, "closed": True})

    def test_edit_again_without_a_change(self) -> None:
        ops.edit_stroke(uid=self.uid("Three"))
        self.assertEqual(state(self.ob), self.drawn)

    def test_apply_to_base(self) -> None:
        ops.mute_stroke(uid=self.uid("Two"))
        muted = state(self.ob)
        ops.apply_to_base()
        group = self.ob.neural_sculpt
        self.assertEqual(self.names(), ["Two"])
        self.assertEqual(group.weights, b"")
        self.assertGreater(len(group.base_weights), len(self.drawn[1]))
        self.assertEqual(state(self.ob)[5], muted[5])
        ops.mute_stroke(uid=self.uid("Two"))
        self.assert_heights(One=1, Two=1, Three=1)
        undo()
        undo()
        self.assertEqual(state(field("Sphere")), muted)

    def test_what_is_drawn_upon_a_new_base_stays_as_it_was_computed(self) -> None:
        ops.apply_to_base()
        for name, tilt in (("Four", 0.4), ("Five", -0.8)):
            stroke(arc(self.ob, spread=0.2, tilt=tilt), radius=0.1, intensity=0.03, name=name)
        before = state(self.ob)[2]
        ops.mute_stroke(uid=self.uid("Five"))
        ops.mute_stroke(uid=self.uid("Five"))
        self.assertEqual(state(self.ob)[2], before)

    def test_a_stroke_that_would_float_is_named_and_leaves_all_as_it_was(self) -> None:
        stroke(arc(self.ob, tilt=-1.2), radius=0.3, intensity=0.25, name="Hill")
        top = arc(self.ob, spread=0.1, tilt=-1.2)
        top *= (SIZE + 0.25) / np.linalg.norm(top, axis=1, keepdims=True)
        stroke(top, radius=0.03, intensity=0.01, name="Flag")
        before = state(self.ob)
        self.assert_fails("Flag", ops.mute_stroke, uid=self.uid("Hill"))
        self.assertEqual(state(self.ob), before)

    def test_a_damaged_history_is_refused_whole(self) -> None:
        for text in ("{", "[" * 100_000, '{"points": []}', "null"):
            self.ob.neural_sculpt.strokes[1].data = text
            before = state(self.ob)
            self.assert_fails("Two", ops.mute_stroke, uid=self.uid("One"))
            self.assert_fails("Two", ops.edit_stroke, uid=self.uid("One"), radius=0.1)
            self.assertEqual(state(self.ob), before)

    def test_a_damaged_history_ends_with_the_field_as_it_is(self) -> None:
        ops.mute_stroke(uid=self.uid("Three"))
        self.ob.neural_sculpt.strokes[1].data = "damaged"
        proxy = vertices(self.ob)
        ops.apply_to_base()
        self.assertEqual(self.names(), ["Three"])
        np.testing.assert_array_equal(vertices(self.ob), proxy)
        with self.as_in_a_window():
            ops.mute_stroke(uid=self.uid("Three"))  # which has stood still since then
            self.assertTrue(self.session.jobs)

    def test_cancel(self) -> None:
        with self.as_in_a_window():
            ops.mute_stroke(uid=self.uid("One"))
            self.assertEqual(self.session.jobs[0].status, "running")
            self.assertEqual(state(self.ob), self.drawn)
            ops.cancel()
            self.assertFalse(self.session.jobs)
            self.finish()
        self.assertEqual(state(self.ob), self.drawn)

    def test_changes_that_wait_are_undo_steps_of_their_own(self) -> None:
        with self.as_in_a_window():
            ops.delete_stroke(uid=self.uid("One"))
            ops.mute_stroke(uid=self.uid("Two"))
            ops.edit_stroke(uid=self.uid("Three"), intensity=-INTENSITY)
            self.finish()
        self.assertEqual(self.names(), ["Two", "Three"])
        self.assert_heights(One=0, Two=0, Three=-1)
        undo()
        self.assert_heights(One=0, Two=0, Three=1)
        undo()
        self.assert_heights(One=0, Two=1, Three=1)
        undo()
        self.assertEqual(state(field("Sphere")), self.drawn)
        for _ in range(3):
            redo()
        self.assert_heights(One=0, Two=0, Three=-1)

    def test_a_change_that_another_one_has_made_already_is_no_undo_step(self) -> None:
        with self.as_in_a_window():
            for _ in range(2):
                ops.delete_stroke(uid=self.uid("One"))
            self.finish()
        self.assert_heights(One=0, Two=1, Three=1)
        undo()
        self.assertEqual(state(field("Sphere")), self.drawn)

    def test_undo_takes_back_one_of_two_changes_that_wait(self) -> None:
        push_undo("Opened")
        with self.as_in_a_window():
            ops.delete_stroke(uid=self.uid("One"))
            ops.mute_stroke(uid=self.uid("Two"))
            undo()
            self.finish()
        self.assert_heights(One=0, Two=1, Three=1)

    def test_a_stroke_drawn_meanwhile_comes_after(self) -> None:
        with self.as_in_a_window():
            ops.delete_stroke(uid=self.uid("One"))
            stroke(arc(self.ob), radius=RADIUS, intensity=-INTENSITY, name="Four")
            self.finish()
        self.assertEqual(self.names(), ["Two", "Three", "Four"])
        self.assert_heights(One=-1, Two=1, Three=1)

    def test_only_fields_with_strokes(self) -> None:
        add("SPHERE")
        for operator in (ops.mute_stroke, ops.edit_stroke, ops.apply_to_base):
            self.assertFalse(operator.poll())
