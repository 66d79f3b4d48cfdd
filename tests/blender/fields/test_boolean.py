# SPDX-License-Identifier: GPL-3.0-or-later
"""Booleans of a field with a mesh and with another field, as one entry and one undo step."""

import bpy
import numpy as np
from bpy.types import Object
from harness import SculptCase, SteeredCase, add, field, long, module, stroke, undo, vertices

PREVIEW = ("operators.fields.boolean_preview", "panels.status_bar")


def select(*objects: Object) -> None:
    """Only these; the last one is active."""
    bpy.ops.object.select_all(action="DESELECT")
    for ob in objects:
        ob.select_set(True)
    bpy.context.view_layer.objects.active = objects[-1]


class Booleans(SculptCase):
    @long
    def test_a_mesh_is_cut_out_and_comes_back(self) -> None:
        ob = add("SPHERE")
        name, before = ob.name, vertices(ob)
        bpy.ops.mesh.primitive_cube_add(size=2, location=(0, 0, 1.2))
        cube = bpy.context.object
        bpy.ops.ed.undo_push(message="Cube")
        select(cube, ob)
        done = bpy.ops.neural_sculpt.boolean(operation="DIFFERENCE")
        self.assertEqual(done, {"FINISHED"})
        self.assertAlmostEqual(vertices(ob)[:, 2].max(), 0.2, delta=2e-3)
        (entry,) = ob.neural_sculpt.strokes
        self.assertEqual((entry.name, entry.data), ("Difference from Cube", ""))
        self.assertTrue(cube.hide_get())
        bpy.ops.neural_sculpt.mute_stroke(uid=entry.uid)
        self.assertAlmostEqual(vertices(ob)[:, 2].max(), 0.6, delta=1e-3)
        undo()
        undo()
        np.testing.assert_array_equal(vertices(field(name)), before)
        self.assertFalse(bpy.data.objects["Cube"].hide_get())

    @long
    def test_another_field_is_united_where_it_is(self) -> None:
        ob, other = add("SPHERE"), add("SPHERE")
        other.location, other.scale = (0.5, 0, 0), (0.5, 0.5, 0.5)
        bpy.context.view_layer.update()
        select(other, ob)
        bpy.ops.neural_sculpt.boolean(operation="UNION", blend=0.05)
        self.assertAlmostEqual(vertices(ob)[:, 0].max(), 0.8, delta=2e-3)
        self.assertAlmostEqual(vertices(ob)[:, 0].min(), -0.6, delta=2e-3)

    def test_a_field_that_is_deleted_meanwhile_ends_the_job_in_a_sentence(self) -> None:
        """Whether a preview or the result comes first."""
        ob, other = add("SPHERE"), add("TORUS")
        select(other, ob)
        with self.as_in_a_window():
            bpy.ops.neural_sculpt.boolean(operation="UNION")
            worker = self.session.client.pid
            bpy.data.objects.remove(ob)
            self.finish()
        self.assertIn("the object is gone", self.session.last_error)
        self.assertEqual(self.session.client.pid, worker)

    def test_what_cannot_be_combined_is_refused(self) -> None:
        ob = add("SPHERE")
        select(ob)
        with self.assertRaisesRegex(RuntimeError, "another field or mesh"):
            bpy.ops.neural_sculpt.boolean()
        bpy.ops.mesh.primitive_cube_add(size=1, location=(0.8, 0, 0))
        select(bpy.context.object, ob)
        with self.assertRaisesRegex(RuntimeError, "leave the box"):
            bpy.ops.neural_sculpt.boolean(operation="UNION")

    def test_an_object_without_size_or_place_is_refused_at_once(self) -> None:
        ob, other = add("SPHERE"), add("TORUS")
        select(other, ob)
        for each in (ob, other):
            for scale, location in (((1, 1, 0), 0.0), ((1, 1, 1), np.nan), ((1e20,) * 3, 0.0)):
                each.scale, each.location.x = scale, location
                bpy.context.view_layer.update()
                self.assert_fails(f"{each.name} has no size", bpy.ops.neural_sculpt.boolean)
            each.scale, each.location = (1, 1, 1), (0, 0, 0)


class Preview(SteeredCase):
    """Of the dialog: where nothing can be shown, the status bar says why."""

    def test_an_object_without_size_has_the_sentence_of_the_operator(self) -> None:
        self.ob.scale.z = 0.0
        bpy.context.view_layer.update()
        preview, hint = (module(f"blender.{name}") for name in PREVIEW)
        refuse_flat = module("blender.scene.extent").refuse_flat
        self.addCleanup(preview.end)
        preview.show(self.ob, ("flat",), lambda: refuse_flat(self.ob))
        self.pump(lambda: self.session.behind is None)
        self.assertIn(f"{self.ob.name} has no size along an axis", hint.shown_hint())
        preview.end()
        self.assertIsNone(hint.shown_hint())


class Waiting(SteeredCase):
    """The other object counts as it lies when the Boolean is asked for, however long that waits."""

    def setUp(self) -> None:
        super().setUp()
        stroke(np.eye(3), name="Waits")

    def ask(self, other: Object) -> None:
        select(other, self.ob)
        self.assertEqual(bpy.ops.neural_sculpt.boolean(operation="UNION"), {"FINISHED"})

    def move(self, ob: Object) -> None:
        ob.location.x += 5.0
        bpy.context.view_layer.update()

    def corners(self) -> np.ndarray:
        """Of the mesh that the worker is to get."""
        return self.session.jobs[-1].request().arrays["vertices"]

    def test_a_mesh_is_moved(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        cube = bpy.context.active_object
        self.ask(cube)
        before = self.corners()
        self.move(cube)
        np.testing.assert_array_equal(self.corners(), before)

    def test_another_scene_is_shown(self) -> None:
        """In which the modifiers of the mesh are not evaluated."""
        bpy.ops.mesh.primitive_cube_add()
        cube = bpy.context.active_object
        cube.modifiers.new("Subdivision", "SUBSURF").levels = 2
        self.ask(cube)
        before = self.corners()
        self.assertEqual(len(before), 98)
        bpy.context.window.scene = bpy.data.scenes.new("Other")
        np.testing.assert_array_equal(self.corners(), before)

    def test_a_mesh_is_deleted(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        cube = bpy.context.active_object
        self.ask(cube)
        bpy.data.objects.remove(cube)
        self.finish()
        self.assertEqual(
            [item.name for item in self.ob.neural_sculpt.strokes][1:], ["Union with Cube"]
        )

    def test_a_field_is_moved(self) -> None:
        add("TORUS")
        self.finish()
        other = field("Torus")
        self.ask(other)
        before = self.session.jobs[-1].request().fields["matrix"]
        self.move(other)
        self.assertEqual(self.session.jobs[-1].request().fields["matrix"], before)

    def test_a_field_has_modifiers(self) -> None:
        """It counts as it is seen, as a mesh does; one that is not seen changes nothing."""
        add("TORUS")
        self.finish()
        other = field("Torus")
        modifier = other.modifiers.new("Array", "ARRAY")
        self.ask(other)
        self.assertEqual(len(self.corners()), 2 * len(other.data.vertices))
        modifier.show_viewport = False
        self.ask(other)
        self.assertIn("matrix", self.session.jobs[-1].request().fields)
