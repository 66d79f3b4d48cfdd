# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist does while a field is made."""

import bpy
import numpy as np
from harness import SteeredCase, add, field, push_undo, redo, stroke, undo


class FitMeanwhile(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        bpy.ops.mesh.primitive_cube_add()
        self.source = bpy.context.active_object
        self.place = bpy.data.collections.new("Figures")
        bpy.context.scene.collection.children.link(self.place)
        self.place.objects.link(self.source)
        bpy.context.collection.objects.unlink(self.source)
        bpy.context.view_layer.objects.active = self.source
        bpy.ops.ed.undo_push(message="Cube")
        self.assertEqual(bpy.ops.neural_sculpt.from_mesh(preset="DRAFT"), {"FINISHED"})

    def test_the_artist_works_at_another_field(self) -> None:
        """That stays the active one, to which buttons and keys go."""
        bpy.context.view_layer.objects.active = self.ob
        stroke(np.eye(3), name="One")
        self.finish()
        self.assertTrue(self.source.hide_get())
        self.assertEqual(bpy.context.active_object, self.ob)
        bpy.ops.neural_sculpt.delete_stroke()
        self.finish()
        self.assertEqual(len(self.ob.neural_sculpt.strokes), 0)

    def test_the_artist_sculpts_another_field(self) -> None:
        """The mesh does not lie in the new field, and undo brings it back."""
        bpy.context.view_layer.objects.active = self.ob
        bpy.ops.object.mode_set(mode="SCULPT")
        push_undo("Sculpt Mode")
        self.finish()
        self.assertTrue(self.source.hide_get())
        self.assertEqual((bpy.context.active_object, bpy.context.mode), (self.ob, "SCULPT"))
        undo()
        self.assertNotIn("Cube Field", bpy.data.objects)
        self.assertFalse(bpy.data.objects["Cube"].hide_get())

    def test_the_artist_sculpts_the_mesh_itself(self) -> None:
        bpy.ops.object.mode_set(mode="SCULPT")
        push_undo("Sculpt Mode")
        self.finish()
        self.assertIn("Cube Field", bpy.data.objects)
        self.assertFalse(self.source.hide_get())
        self.assertEqual(bpy.context.active_object, self.source)

    def test_what_was_undone_can_be_redone(self) -> None:
        """The field waits for that, or for what the artist does instead."""
        bpy.data.objects["Cube"].location.x = 1.0
        push_undo("Move")
        undo()
        self.finish()
        self.assertNotIn("Cube Field", bpy.data.objects)
        redo()
        self.assertEqual(bpy.data.objects["Cube"].location.x, 1.0)
        undo()
        push_undo("Something else")
        self.pump(lambda: not self.session.jobs)
        self.assertIn("Cube Field", bpy.data.objects)

    def test_the_artist_waits(self) -> None:
        self.finish()
        self.assertEqual(bpy.context.active_object, field("Cube Field"))
        self.assertEqual(bpy.context.selected_objects, [field("Cube Field")])

    def test_another_scene_is_shown(self) -> None:
        """The field is beside its mesh all the same, which is hidden there."""
        first, other = bpy.context.scene, bpy.data.scenes.new("Other")
        bpy.context.window.scene = other
        self.finish()
        self.assertEqual([*field("Cube Field").users_collection], [self.place])
        self.assertTrue(self.source.hide_get(view_layer=first.view_layers[0]))
        self.assertIsNone(bpy.context.active_object)
        bpy.context.window.scene = first
        undo()
        self.assertNotIn("Cube Field", bpy.data.objects)
        self.assertFalse(bpy.data.objects["Cube"].hide_get())


class AddMeanwhile(SteeredCase):
    def test_another_scene_is_shown(self) -> None:
        """The field is at the cursor of the scene in which it was asked for."""
        first, other = bpy.context.scene, bpy.data.scenes.new("Other")
        add("TORUS")
        bpy.context.window.scene = other
        self.finish()
        self.assertEqual([*field("Torus").users_scene], [first])
        self.assertIsNone(bpy.context.active_object)
