# SPDX-License-Identifier: GPL-3.0-or-later
"""Booleans of a field with a mesh and with another field, as one entry and one undo step."""

import bpy
import numpy as np
from bpy.types import Object
from harness import SculptCase, add, field, long, undo, vertices


def select(*objects: Object) -> None:
    """Only these; the last one is active."""
    bpy.ops.object.select_all(action="DESELECT")
    for ob in objects:
        ob.select_set(True)
    bpy.context.view_layer.objects.active = objects[-1]


class Booleans(SculptCase):
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
