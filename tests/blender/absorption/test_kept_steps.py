# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes whose steps stay in Blender's history: the field follows them back and forth."""

import os
import random

import bpy
import numpy as np
import test_brush_results
from harness import arc, long, module, push_undo, redo, state, stroke, undo, vertices
from test_brush_results import NAMES
from test_live_absorption import BrushCase, brush

sculpt_steps = module("blender.scene.sculpt_steps")
kept_steps = module("blender.scene.kept_steps")

STRAIGHT = 0.98  # cosine
LENGTH = 16
MESH = 4  # in SEEN
SEEN = "weights", "base", "strokes", "revision", "mesh", "mode", "masks", "normals"


class KeptResults(test_brush_results.BrushResults):
    """What holds of strokes that become steps of ours holds of these."""

    keeps = True

    def setUp(self) -> None:
        if not kept_steps.EXACT:
            self.skipTest("this Blender rounds what it takes back")
        super().setUp()

    def test_one_at_a_time_and_nothing_is_seen_of_it(self) -> None:
        """Nothing is pushed, and the mesh is not evaluated."""
        self.brush_all()
        evaluated: list[bool] = []

        def note(_: object, graph: bpy.types.Depsgraph) -> None:
            evaluated.extend(update.is_updated_geometry for update in graph.updates)

        handlers = bpy.app.handlers.depsgraph_update_post
        bpy.context.view_layer.update()
        handlers.append(note)
        self.addCleanup(handlers.remove, note)
        polls, history = 0, sculpt_steps.steps()
        while not self.session.rests:
            self.session.poll_once()
            bpy.context.view_layer.update()
            polls += 1
            self.assertEqual(self.names(), NAMES[:polls])
        self.assertEqual(polls, len(NAMES))
        self.assertEqual(sculpt_steps.steps(), history)
        self.assertFalse(any(evaluated))
        np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
        self.assert_all_are_steps(NAMES)

    @long
    def test_the_worker_dies(self) -> None:
        super().test_the_worker_dies()

    # No step is taken back, nothing is half-way, and no stroke brings another proxy.
    test_only_the_last_brings_another_proxy = None
    test_redo_has_the_rest_come_in_first = None
    test_a_file_that_is_saved_as_steps_are_taken_back = None

    def test_a_stroke_between_them_follows(self) -> None:
        self.come_in(2)
        with self.at_work():
            brush("Smooth", 10)
        self.look()
        sculpted = vertices(self.ob())
        self.finish()
        self.assert_is(sculpted)
        self.assert_all_are_steps([*NAMES, "Smooth"])

    def test_a_stroke_between_them_is_undone(self) -> None:
        """It is in the field as soon as it has a result, whether it was redone or not."""
        self.come_in(2)
        brush("Smooth", 10)
        smooth = vertices(self.ob())
        self.look()
        undo()
        np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
        self.finish()
        self.assertEqual(self.names(), NAMES)
        redo()
        np.testing.assert_array_equal(vertices(self.ob()), smooth)
        self.look()
        self.finish()
        self.assert_all_are_steps([*NAMES, "Smooth"])


class KeptSteps(BrushCase):
    def setUp(self) -> None:
        if not kept_steps.EXACT:
            self.skipTest("this Blender rounds what it takes back")
        super().setUp()
        self.enterContext(self.as_in_a_window())

    def absorb(self, *strokes: tuple[str, float]) -> None:
        for name, right in strokes:
            brush(name, right)
            self.look()
            self.finish()

    def test_a_neural_stroke_without_global_undo(self) -> None:
        """It is no step of Blender's history, and stays where undo cannot take a brush stroke from
        its proxy."""
        self.absorb(("Clay", 0), ("Grab", -40))
        edit = bpy.context.preferences.edit
        edit.use_global_undo = False
        self.addCleanup(setattr, edit, "use_global_undo", True)
        stroke(arc(self.ob()), radius=0.1, intensity=0.05, name="Neural")
        self.finish()
        drawn = state(self.ob())
        for step in (undo, redo):
            step()
            self.assertEqual(self.names(), ["Clay", "Grab", "Neural"])
            self.assertTrue(state(self.ob()) == drawn)

    def test_normals_are_those_of_the_surface_when_settled(self) -> None:
        before = vertices(self.ob())
        self.absorb(("Clay", -20), ("Grab", 20))
        moved = (vertices(self.ob()) != before).any(axis=1)
        self.assertLess(self.along_the_surface(moved), STRAIGHT)
        kept_steps.settle()
        self.assertGreater(self.along_the_surface(moved), STRAIGHT)
        self.assert_goes_back_and_forth(moved)

    def assert_goes_back_and_forth(self, moved: np.ndarray) -> None:
        for step in (undo, undo, redo, redo):
            step()
            kept_steps.settle()
            self.assertGreater(self.along_the_surface(moved), STRAIGHT)

    def test_a_mode_that_is_left_at_once_has_them_too(self) -> None:
        """Blender has pushed its step without them."""
        before = vertices(self.ob())
        self.absorb(("Clay", 0))
        moved = (vertices(self.ob()) != before).any(axis=1)
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="OBJECT")
        kept_steps.settle()  # in a window by itself
        self.ob().location.x = 1.0
        push_undo("Move")
        undo()
        kept_steps.settle()
        self.assertEqual(self.ob().mode, "OBJECT")
        self.assertGreater(self.along_the_surface(moved), STRAIGHT)
        for step in (undo, undo, redo, redo):
            step()
            kept_steps.settle()
            self.assertGreater(self.along_the_surface(moved), STRAIGHT, step)

    def test_a_mode_that_is_left_before_they_have_results(self) -> None:
        """Each press still takes back one thing, and never shows what an earlier one took back."""
        seen = [(state(self.ob()), "SCULPT")]
        for each in (("Clay", -40), ("Grab", 40)):
            brush(*each)
            self.look()
        bpy.ops.object.mode_set(mode="OBJECT")
        push_undo("Object Mode")
        self.ob().location.x = 1.0
        push_undo("Move")
        sculpted, history = vertices(self.ob()), sculpt_steps.steps()
        self.finish()
        self.assertEqual(sculpt_steps.steps(), history)
        self.assertEqual(self.names(), ["Clay", "Grab"])
        self.assertFalse(self.edited())
        np.testing.assert_array_equal(vertices(self.ob()), sculpted)
        kept_steps.settle()
        moved = self.now()
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        self.finish()
        last = self.now()
        undo()
        self.assertEqual(self.now(), moved)
        for mode, names in (
            *(("OBJECT", ["Clay", "Grab"]), ("SCULPT", ["Clay", "Grab"])),
            *(("SCULPT", ["Clay"]), ("SCULPT", [])),
        ):
            undo()
            seen.insert(1, self.now())
            self.assertEqual((self.ob().mode, self.names()), (mode, names))
            self.assertFalse(self.edited())
        self.assertEqual(seen.pop(1), seen[0])
        for expected in (*seen[1:], moved, last):
            redo()
            self.assertEqual(self.now(), expected)
        for _ in range(5):
            undo()
        self.assertEqual(self.now(), seen[0])
        brush("Clay", 0)  # another one, whose steps lie where those had been
        self.look()
        bpy.ops.object.mode_set(mode="OBJECT")
        push_undo("Object Mode")
        self.finish()
        undo()
        redo()
        self.assertEqual(self.names(), ["Clay"])
        self.assertFalse(self.edited())

    def test_another_object_is_active_when_they_have_results(self) -> None:
        """Undo to a step that was made before brings the stroke with the vertices."""
        brush("Clay", 0)
        self.look()
        bpy.ops.object.mode_set(mode="OBJECT")
        push_undo("Object Mode")
        other = bpy.data.objects.new("Other", None)
        bpy.context.collection.objects.link(other)
        bpy.context.view_layer.objects.active = other
        push_undo("Add Other")
        self.finish()
        brushed = state(self.ob())
        self.assertEqual(self.names(), ["Clay"])
        bpy.data.objects["Other"].location.x = 1.0
        push_undo("Move")
        for step in (undo, undo, redo, redo):
            step()
            kept_steps.settle()
            self.assertEqual(self.names(), ["Clay"], step)
            self.assertFalse(self.edited(), step)
        self.assertEqual(state(self.ob()), brushed)

    def now(self) -> tuple[object, str]:
        """All of the field, with the normals that are behind, and the mode."""
        kept_steps.settle()
        return state(self.ob()), self.ob().mode

    def along_the_surface(self, some: np.ndarray) -> float:
        """Cosine between the mesh's own normals and those of its triangles, of vertices: 95 % have
        at least that."""
        mesh, points = self.ob().data, vertices(self.ob())
        corners, own = np.empty(len(mesh.loops), np.int32), np.empty(points.size, np.float32)
        mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
        mesh.attributes["custom_normal"].data.foreach_get("vector", own)
        a, b, c = points[corners.reshape(-1, 3)].swapaxes(0, 1)
        normals = np.zeros_like(points)
        for corner in corners.reshape(-1, 3).T:
            np.add.at(normals, corner, np.cross(b - a, c - a))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        return float(np.quantile((own.reshape(-1, 3) * normals).sum(axis=1)[some], 0.05))

    def test_a_jump_in_the_history(self) -> None:
        """Blender's menu of it leads over several steps at once."""
        states = [state(self.ob())]
        for each in (("Clay", -50), ("Grab", -20), ("Clay", 20)):
            self.absorb(each)
            states.append(state(self.ob()))
        first = len(sculpt_steps.steps()[0]) - len(states)
        for place in (1, 3, 0, 2, 3, 0):
            with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
                bpy.ops.ed.undo_history(item=first + place)
            self.assertEqual(state(self.ob()), states[place])

    def test_a_jump_to_strokes_that_were_forgotten(self) -> None:
        """They were undone without results, and so was what they began with."""
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        self.finish()
        begun = state(self.ob())
        for each in (("Grab", -40), ("Clay", 20), ("Mask", 0)):
            brush(*each)
            self.look()
        brushed, place = vertices(self.ob()), len(sculpt_steps.steps()[0]) - 1
        for _ in range(4):
            undo()
        self.assertEqual((self.names(), len(self.session.jobs)), ([], 0))
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            bpy.ops.ed.undo_history(item=place)
        self.live.look_later()
        self.finish()
        np.testing.assert_array_equal(vertices(self.ob()), brushed)
        self.assertEqual(self.names(), ["Neural", "Grab", "Clay"])
        self.assertFalse(self.edited())
        for count in (3, 2, 1):
            undo()
            self.assertEqual(self.names(), ["Neural", "Grab", "Clay"][:count])
            self.assertFalse(self.edited())
        self.assertEqual(state(self.ob()), begun)

    def test_a_file_has_all_of_it(self) -> None:
        before = vertices(self.ob())
        self.absorb(("Clay", -20), ("Grab", 20))
        moved, made = (vertices(self.ob()) != before).any(axis=1), state(self.ob())
        path = str(self.folder / "saved.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(state(self.ob()), made)
        self.assertFalse(self.edited())
        self.assertGreater(self.along_the_surface(moved), STRAIGHT)


class Orders(BrushCase):
    """Random orders of brush strokes, neural strokes, masks, modes, undo and redo."""

    def setUp(self) -> None:
        if not kept_steps.EXACT:
            self.skipTest("this Blender rounds what it takes back")
        super().setUp()
        self.addCleanup(setattr, self.results, "SEEN_OFF", self.results.SEEN_OFF)
        self.enterContext(self.as_in_a_window())

    @long
    def test_each_press_takes_back_one_thing(self) -> None:
        for number in range(int(os.environ.get("NEURAL_SCULPT_ORDERS", "3"))):
            with self.subTest(number=number):
                self.play(random.Random(f"kept {number}"))
            while self.at:
                self.do("undo")

    def play(self, by: random.Random) -> None:
        """An order, then all the way back and all the way forth; of brush strokes none, some or all
        are so far off that rest brings another proxy."""
        self.results.SEEN_OFF = by.choice([5e-4, 1e-4, 5e-5, 0.0])
        self.random, self.told = by, []
        self.at, self.states = 0, [self.seen()]
        while len(self.told) < LENGTH:
            self.do(by.choice(self.choices()))
        for word in ("undo", "redo", "undo"):
            while self.at if word == "undo" else self.at < len(self.states) - 1:
                self.do(word)

    def choices(self) -> list[str]:
        """What can be done now."""
        sculpting = self.ob().mode == "SCULPT"
        words = ["toggle_mode", "neural", *["mute"] * bool(self.names()), *["rest"] * 3]
        words += ["native", "native", "two", "two", "mask"] * 2 * sculpting
        words += ["undo"] * 5 * (self.at > 0)
        return words + ["redo"] * 4 * (self.at < len(self.states) - 1)

    def do(self, word: str) -> None:
        """One thing, and what must be so after it."""
        self.told.append(word)
        getattr(self, f"do_{word}")()
        self.look_in_sculpt_mode()
        self.finish()
        self.assertEqual(self.session.last_error, "", self.told)
        self.assertFalse(self.edited(), self.told)
        steps = {"undo": -1, "redo": 1, "two": 2, "rest": 0}.get(word, 1)
        self.at += steps
        if word not in ("undo", "redo", "rest"):
            self.states[self.at - steps + 1 :] = [None] * steps
        if word == "rest" and self.at == len(self.states) - 1:  # the proxy may be another one
            self.states[-1] = (*self.states[-1][:MESH], *[None] * len(SEEN[MESH:]))
        seen, before = self.seen(), self.states[self.at]
        if before is None:  # of two strokes the first is not seen before it is undone
            before = seen
        for name, now, then in zip(SEEN, seen, before, strict=True):
            if now is not None and then is not None:
                self.assertEqual(now, then, f"{name} after {self.told}")
        known = (then or now for now, then in zip(seen, before, strict=True))
        self.states[self.at] = tuple(known)

    def look_in_sculpt_mode(self) -> None:
        if self.ob().mode == "SCULPT":
            self.look()

    def seen(self) -> tuple[object, ...]:
        """All that makes the field; as often as not its normals, which are settled for that."""
        *made, _, mesh, _ = state(self.ob())
        painted = module("blender.scene.mesh.brush_attributes").read(self.ob().data)
        masks = {name: values.tobytes() for name, values in painted.items() if values.any()}
        return (
            *made,
            mesh,
            self.ob().mode,
            masks,
            self.normals() if self.random.random() < 0.5 else None,
        )

    def normals(self) -> bytes:
        kept_steps.settle()
        mesh = self.ob().data
        flat = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.attributes["custom_normal"].data.foreach_get("vector", flat)
        return flat.tobytes()

    def do_native(self) -> None:
        brush(
            self.random.choice(["Clay", "Grab", "Smooth", "Inflate/Deflate"]),
            self.random.uniform(-60, 60),
        )

    def do_two(self) -> None:
        self.do_native()
        self.look()
        self.do_native()

    def do_mask(self) -> None:
        brush("Mask", self.random.uniform(-60, 60))

    def do_neural(self) -> None:
        stroke(
            arc(self.ob(), tilt=self.random.uniform(0, 2)),
            radius=0.1,
            intensity=0.03,
            name="Neural",
        )

    def do_mute(self) -> None:
        listed = self.ob().neural_sculpt.strokes
        bpy.ops.neural_sculpt.mute_stroke(uid=self.random.choice([item.uid for item in listed]))

    def do_toggle_mode(self) -> None:
        mode = "OBJECT" if self.ob().mode == "SCULPT" else "SCULPT"
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=mode)
        if mode == "OBJECT":
            kept_steps.settle()

    def do_rest(self) -> None:
        self.rest()

    def do_undo(self) -> None:
        undo()

    def do_redo(self) -> None:
        redo()
