# SPDX-License-Identifier: GPL-3.0-or-later
"""The field that a stroke is drawn on is the one under the mouse, where it can become active."""

from types import SimpleNamespace
from unittest.mock import patch

import bpy
from bpy.types import Object
from harness import SteeredCase, add, call_as, module
from mathutils import Vector

draw = module("blender.operators.strokes.draw")
view = module("blender.viewport.view")


class TurnToField(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        call_as("Script")
        self.other = add("TORUS")
        mesh = self.other.data
        mesh.clear_geometry()
        mesh.from_pydata([(-9, -9, 30), (9, -9, 30), (0, 9, 30)], [], [(0, 1, 2)])
        bpy.context.view_layer.objects.active = self.ob

    def turned(self) -> Object:
        """What a press is drawn on, in a view from above."""
        region = SimpleNamespace(type="WINDOW", data=SimpleNamespace(), x=0, y=0, width=9, height=9)
        area = SimpleNamespace(type="VIEW_3D", regions=[region])
        origin, down = Vector((0, 0, 60)), Vector((0, 0, -1))
        with (
            patch.object(view, "RegionView3D", SimpleNamespace),
            patch.object(view.view3d_utils, "region_2d_to_origin_3d", lambda *_: origin),
            patch.object(view.view3d_utils, "region_2d_to_vector_3d", lambda *_: down),
        ):
            context = SimpleNamespace(
                mode="OBJECT",
                area=area,
                scene=bpy.context.scene,
                evaluated_depsgraph_get=bpy.context.evaluated_depsgraph_get,
            )
            return draw._turn_to(context, (4, 4), self.ob)

    def test_another_field_becomes_active(self) -> None:
        self.assertEqual(self.turned(), self.other)
        self.assertEqual(bpy.context.active_object, self.other)

    def test_an_instance_of_a_field_does_not(self) -> None:
        """The field itself is in a collection that is not in the view layer."""
        collection = bpy.data.collections.new("Assets")
        bpy.context.scene.collection.children.link(collection)
        bpy.context.scene.collection.objects.unlink(self.other)
        collection.objects.link(self.other)
        bpy.context.view_layer.layer_collection.children["Assets"].exclude = True
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        bpy.context.scene.collection.objects.link(instance)
        bpy.context.view_layer.objects.active = self.ob
        bpy.context.view_layer.update()
        self.assertEqual(self.turned(), self.ob)
        self.assertEqual(bpy.context.active_object, self.ob)
