# SPDX-License-Identifier: GPL-3.0-or-later
"""New fields where nothing can be put into the collection that is meant: it is linked from another
file."""

from unittest.mock import patch

import bpy
from bpy.types import Collection
from harness import SteeredCase, add, call_as, module, undo

MESH, LINKED = "Head", "Assets"


class LinkedCollection(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        call_as("Script")

    def link(self) -> Collection:
        """A collection of another file, with a mesh, in the scene."""
        path = str(self.folder / "library.blend")
        bpy.ops.mesh.primitive_cube_add()
        mesh = bpy.context.active_object
        mesh.name, mesh["part"] = MESH, "head"
        bpy.context.collection.objects.unlink(mesh)
        collection = bpy.data.collections.new(LINKED)
        collection.objects.link(mesh)
        bpy.data.libraries.write(path, {collection})
        bpy.data.objects.remove(mesh)
        bpy.data.collections.remove(collection)
        with bpy.data.libraries.load(path, link=True) as (_, wanted):
            wanted.collections = [LINKED]
        bpy.context.scene.collection.children.link(wanted.collections[0])
        bpy.context.view_layer.update()
        return wanted.collections[0]

    def test_the_field_of_a_linked_mesh_is_in_the_active_collection(self) -> None:
        source = self.link().objects[MESH]
        bpy.context.view_layer.objects.active = source
        with patch.object(module("blender.notice"), "tell") as told:
            self.assertEqual(bpy.ops.neural_sculpt.from_mesh(preset="DRAFT"), {"FINISHED"})
        self.assertIn("is rendered as well", told.call_args_list[0].args[0])
        ob = bpy.context.active_object
        self.assertEqual((ob.name, ob["part"]), (f"{MESH} Field", "head"))
        self.assertEqual([*ob.users_collection], [bpy.context.collection])
        self.assertTrue(source.hide_get())
        undo()
        self.assertNotIn(f"{MESH} Field", bpy.data.objects)

    def test_a_field_is_added_while_a_linked_collection_is_active(self) -> None:
        linked = self.link()
        layer = bpy.context.view_layer.layer_collection.children[LINKED]
        bpy.context.view_layer.active_layer_collection = layer
        self.assertEqual(bpy.context.collection, linked)
        ob = add("TORUS")
        self.assertEqual([*ob.users_collection], [bpy.context.scene.collection])
