# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields are the sum of their base and layers, whatever is done in whatever order.

The worker is the toy one, whose fields tests add up by themselves. With the environment variable
NEURAL_SCULPT_SEQUENCES=200 as many random sequences run; a few otherwise.
"""

import json
import os
import random
from pathlib import Path
from unittest.mock import patch

import bpy
import numpy as np
from bpy.types import Object
from harness import (
    SteeredCase,
    add,
    call_as,
    collection,
    field,
    module,
    push_undo,
    redo,
    state,
    undo,
    vertices,
)

SEQUENCES = int(os.environ.get("NEURAL_SCULPT_SEQUENCES", "4"))
STEPS = 25
ops = bpy.ops.neural_sculpt


def expected(ob: Object) -> np.ndarray:
    """Base + sum of strength x layer over what is not muted, (SIZE,)."""
    group = ob.neural_sculpt
    if group.weights:
        return np.frombuffer(group.weights, "<i4")
    total = np.frombuffer(group.base_weights, "<i4")
    for item in group.strokes:
        if not item.muted:
            layer = np.frombuffer(item.layer, "<i4")
            total = total + np.rint(item.strength * layer).astype("<i4")
    return total


class Layers(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        self.say("go")
        call_as("Script")

    def finish(self) -> None:
        """Edits end by themselves."""
        self.pump(lambda: not self.session.jobs)

    def stroke(self, x: float = 0.5, name: str = "") -> str:
        """A stroke on one side; its uid."""
        points = np.array([[x, 0.1, 0.2], [x, 0.2, 0.3]])
        self.assertEqual(ops.stroke(points=collection(points), name=name), {"FINISHED"})
        return active().neural_sculpt.strokes[-1].uid

    def assert_sum(self, ob: Object) -> None:
        np.testing.assert_array_equal(vertices(ob)[:-1].ravel(), expected(ob))

    def layers(self) -> list[bytes]:
        return [item.layer for item in active().neural_sculpt.strokes]

    def test_a_stroke_is_a_layer(self) -> None:
        self.stroke()
        group = self.ob.neural_sculpt
        self.assertEqual(group.weights, b"", "the field is held once")
        self.assertEqual(len(group.strokes[0].layer_id), 64)
        self.assert_sum(self.ob)

    def test_muting_and_unmuting_what_nothing_lies_on_computes_nothing(self) -> None:
        left, _ = self.stroke(-0.5), self.stroke(0.5)
        before, kept = expected(self.ob), self.layers()
        ops.mute_stroke(uid=left)
        self.assertEqual(self.layers(), kept)
        self.assert_sum(self.ob)
        ops.mute_stroke(uid=left)
        self.assertEqual(self.layers(), kept)
        np.testing.assert_array_equal(expected(self.ob), before)

    def test_what_lies_on_a_muted_stroke_is_computed_again(self) -> None:
        first, _ = self.stroke(), self.stroke()
        kept = self.layers()
        ops.mute_stroke(uid=first)
        self.assertEqual(self.layers()[0], kept[0])
        self.assertNotEqual(self.layers()[1], kept[1])
        self.assert_sum(self.ob)
        ops.mute_stroke(uid=first)
        self.assertEqual(self.layers(), kept)

    def test_strength(self) -> None:
        uid = self.stroke()
        base = np.frombuffer(self.ob.neural_sculpt.base_weights, "<i4")
        whole = expected(self.ob) - base
        ops.set_strength(uid=uid, strength=0.25)
        self.assert_sum(self.ob)
        np.testing.assert_allclose(expected(self.ob) - base, 0.25 * whole, atol=0.5)
        undo()
        self.assertEqual(field("Sphere").neural_sculpt.strokes[0].strength, 1.0)
        self.assert_sum(field("Sphere"))

    def test_the_slider_acts_when_it_rests(self) -> None:
        uid = self.stroke()
        before = state(self.ob)
        with patch.object(module("blender.panels.strength"), "timers_run", lambda: True):
            for strength in (0.8, 0.6, 0.5):
                bpy.context.window_manager.neural_sculpt_strength = strength
                self.assertEqual(state(self.ob), before)
                shown = bpy.context.window_manager.neural_sculpt_strength
                self.assertAlmostEqual(shown, strength, places=6)
        self.assertFalse(self.session.jobs)
        bpy.context.window_manager.neural_sculpt_strength = 0.5
        self.assertEqual(self.ob.neural_sculpt.strokes[0].strength, 0.5)
        self.assertEqual(self.ob.neural_sculpt.strokes[0].uid, uid)
        self.assert_sum(self.ob)
        undo()
        self.assertEqual(state(field("Sphere")), before)

    def test_several_strokes_are_one_step(self) -> None:
        before = state(self.ob)
        strokes = [
            {"points": [[x, 0.1, 0], [x, 0.2, 0]], "radius": 0.1, "intensity": 0.05}
            for x in (0.5, -0.5)
        ]
        ops.stroke(stroke_json=json.dumps({"version": 1, "strokes": strokes}))
        self.assertEqual(len(self.ob.neural_sculpt.strokes), 2)
        self.assert_sum(self.ob)
        undo()
        self.assertEqual(state(field("Sphere")), before)

    def test_bytes_are_sent_once(self) -> None:
        sent: list[set[str]] = []
        submit = self.session.client.submit

        def spy(kind: object, fields: dict, arrays: dict) -> int:
            sent.append(set(arrays))
            return submit(kind, fields, arrays)

        self.session.client.submit = spy
        uid = self.stroke()
        ops.mute_stroke(uid=uid)
        ops.mute_stroke(uid=uid)
        self.assertEqual(sent, [set()] * 3, "the worker made all of it")

    def test_a_worker_that_forgot_is_sent_all_again(self) -> None:
        self.stroke()
        self.say("forget")
        self.stroke()
        self.assertFalse((self.folder / "forget").exists())
        self.assert_sum(self.ob)

    def test_a_new_worker_is_sent_all(self) -> None:
        uid = self.stroke()
        self.session.stop()
        ops.set_strength(uid=uid, strength=0.5)
        self.assert_sum(self.ob)

    def open_older(self) -> tuple[object, ...]:
        """A file with weights and strokes that have no layers; the field's state."""
        self.stroke(0.5, "One")
        self.stroke(-0.5, "Two")
        group = self.ob.neural_sculpt
        group.weights = np.arange(100, 124, dtype="<i4").tobytes()
        group.base_id = ""
        for item in group.strokes:
            item.layer, item.layer_id, item.context = b"", "", ""
        path = self.folder / "older.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))
        push_undo("Open")
        return state(field("Sphere"))

    def test_a_layer_upon_a_file_that_is_older_than_layers(self) -> None:
        """The field as it is becomes the base, for its strokes have no layers; muted ones stay."""
        before = self.open_older()
        field("Sphere").neural_sculpt.strokes[1].muted = True
        points = vertices(field("Sphere"))
        points[:3] += 7
        field("Sphere").data.vertices.foreach_set("co", points.ravel())
        push_undo("Native")
        ops.absorb()
        self.assert_upon_the_base(before, "Sculpted")
        np.testing.assert_array_equal(vertices(field("Sphere")), points)
        undo()
        undo()
        self.assertEqual(state(field("Sphere")), before)
        bpy.ops.mesh.primitive_cube_add()
        field("Sphere").select_set(True)
        bpy.context.view_layer.objects.active = field("Sphere")
        field("Sphere").neural_sculpt.strokes[1].muted = True
        ops.boolean(operation="UNION")
        self.assert_upon_the_base(before, "Union with Cube")

    def assert_upon_the_base(self, before: tuple[object, ...], name: str) -> None:
        group = field("Sphere").neural_sculpt
        self.assertEqual((group.base_weights, group.weights), (before[0], b""))
        self.assertEqual(names(), ["Two", name])
        self.assert_sum(field("Sphere"))

    def test_a_file_that_is_older_than_layers(self) -> None:
        """It has weights and strokes, whose layers are computed at the first change."""
        before = self.open_older()
        ob = field("Sphere")
        ops.remesh(resolution=20)
        self.assert_sum(ob)
        undo()
        for change in (lambda: self.stroke(0.3, "Three"), lambda: mute("Two")):
            change()
            ob = field("Sphere")
            self.assertEqual(ob.neural_sculpt.weights, b"")
            heard = [item for item in ob.neural_sculpt.strokes if not item.muted]
            self.assertTrue(all(item.layer_id for item in heard))
            self.assert_sum(ob)
            undo()
            self.assertEqual(state(field("Sphere")), before)
        ops.apply_to_base()
        self.assertEqual(field("Sphere").neural_sculpt.base_weights, before[0])

    def test_apply_to_base(self) -> None:
        first, _ = self.stroke(), self.stroke()
        ops.mute_stroke(uid=first)
        total, proxy = expected(self.ob), vertices(self.ob)
        ops.apply_to_base()
        group = self.ob.neural_sculpt
        self.assertEqual([item.uid for item in group.strokes], [first])
        np.testing.assert_array_equal(np.frombuffer(group.base_weights, "<i4"), total)
        np.testing.assert_array_equal(vertices(self.ob), proxy)
        ops.mute_stroke(uid=first)
        self.assert_sum(self.ob)

    def test_absorbed_sculpting_is_an_entry(self) -> None:
        first = self.stroke(name="One")
        ob = self.ob
        points = vertices(ob)
        points[:3] += 7
        ob.data.vertices.foreach_set("co", points.ravel())
        push_undo("Native")
        ops.absorb()
        self.assertEqual(names(), ["One", "Sculpted"])
        np.testing.assert_array_equal(vertices(ob), points)
        self.assert_sum(ob)
        uid = ob.neural_sculpt.strokes[1].uid
        for refused in (ops.duplicate_stroke, ops.edit_stroke):
            self.assert_fails("absorbed from other brushes", refused, uid=uid)
        absorbed = ob.neural_sculpt.strokes[1].layer
        ops.mute_stroke(uid=first)
        ops.set_strength(uid=uid, strength=0.5)
        ops.move_stroke(uid=uid, direction="UP")
        self.assertEqual(names(), ["Sculpted", "One"])
        self.assertEqual(ob.neural_sculpt.strokes[0].layer, absorbed)
        self.assert_sum(ob)
        ops.delete_stroke(uid=uid)
        self.assertEqual(names(), ["One"])
        self.assert_sum(ob)

    def test_a_field_of_a_network_only(self) -> None:
        ops.choose_solver(solver="NETWORK")
        uid = self.stroke()
        group = self.ob.neural_sculpt
        self.assertEqual(group.strokes[0].layer, b"")
        self.assertNotEqual(group.weights, b"")
        self.assert_sum(self.ob)
        self.assertFalse(ops.choose_solver.poll())
        drawn = expected(self.ob)
        self.stroke()
        ops.mute_stroke(uid=group.strokes[1].uid)
        np.testing.assert_array_equal(expected(self.ob), drawn)
        self.assert_sum(self.ob)
        ops.mute_stroke(uid=uid)
        np.testing.assert_array_equal(expected(self.ob), np.arange(-1, 23))
        self.assertEqual(group.weights, b"")
        ops.mute_stroke(uid=uid)
        ops.apply_to_base()
        ops.delete_stroke()
        ops.choose_solver(solver="LOCAL")
        self.stroke()
        self.assert_sum(self.ob)

    def test_random_sequences(self) -> None:
        for seed in range(SEQUENCES):
            with self.subTest(seed=seed):
                self.random_sequence(random.Random(seed))

    def random_sequence(self, rng: random.Random) -> None:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        push_undo("Start")
        for kind in ("SPHERE", "TORUS"):
            add(kind)
        push_undo("Fields")
        done, undone = 0, 0
        for _ in range(STEPS):
            bpy.context.view_layer.objects.active = field(rng.choice(("Sphere", "Torus")))
            done, undone = self.random_step(rng, done, undone)
            for name in ("Sphere", "Torus"):
                self.assert_sum(field(name))

    def random_step(self, rng: random.Random, done: int, undone: int) -> tuple[int, int]:
        """One thing that an artist may do; how many steps can be undone and redone then."""
        listed = active().neural_sculpt.strokes
        word = rng.choice(("stroke",) * 4 + ("undo", "redo", "mute", "solo", "strength") * 2 + LESS)
        if word == "undo" and done:
            undo()
            return done - 1, undone + 1
        if word == "redo" and undone:
            redo()
            return done + 1, undone - 1
        if word == "file":
            path = str(Path(self.folder) / "random.blend")
            bpy.ops.wm.save_as_mainfile(filepath=path)
            bpy.ops.wm.open_mainfile(filepath=path)
            push_undo("Open")
            return 0, 0
        before = state(active())
        if word == "worker":
            self.session.stop()
        elif word == "stroke" or not len(listed):
            self.stroke(rng.choice((-0.5, 0.5)))
        elif word == "base":
            ops.apply_to_base()
            return done + 1, 0
        elif word in changes:
            changes[word](rng.choice(listed).uid, rng)
        return (done, undone) if state(active()) == before else (done + 1, 0)


LESS = ("delete", "duplicate", "move", "move", "file", "base", "worker")
changes = {
    "mute": lambda uid, rng: ops.mute_stroke(uid=uid),
    "solo": lambda uid, rng: ops.solo_stroke(uid=uid),
    "strength": lambda uid, rng: ops.set_strength(uid=uid, strength=rng.choice((0.0, 0.3, 1.0))),
    "delete": lambda uid, rng: ops.delete_stroke(uid=uid),
    "duplicate": lambda uid, rng: ops.duplicate_stroke(uid=uid),
    "move": lambda uid, rng: ops.move_stroke(uid=uid, direction=rng.choice(("UP", "DOWN"))),
}


def active() -> Object:
    return bpy.context.view_layer.objects.active


def names() -> list[str]:
    return [item.name for item in active().neural_sculpt.strokes]


def mute(name: str) -> None:
    (uid,) = (item.uid for item in active().neural_sculpt.strokes if item.name == name)
    ops.mute_stroke(uid=uid)
