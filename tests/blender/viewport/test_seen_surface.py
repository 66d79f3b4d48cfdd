# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh in the scene is met where the viewport shows it."""

import bpy
from harness import SculptCase, module, push_undo, undo, vertices


class SeenSurface(SculptCase):
    """A mesh in the scene, a ball of radius 1, is met as the viewport shows it."""

    def setUp(self) -> None:
        super().setUp()
        bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1)
        push_undo("Ball")

    def top(self) -> float | None:
        """Where a ray from above meets it."""
        grid = module("blender.scene.mesh.seen_surface").grid_of(bpy.context.active_object)
        found = None if grid is None else grid.cast((0, 0, 9), (0, 0, -1))
        return None if found is None else round(float(found[0][2]), 4)

    def scale(self, size: float) -> None:
        ob = bpy.context.active_object
        ob.data.attributes["position"].data.foreach_set("vector", (size * vertices(ob)).ravel())
        ob.data.update()

    def test_follows_each_change(self) -> None:
        self.assertEqual(self.top(), 1.0)
        self.scale(2)
        self.assertEqual(self.top(), 2.0)
        push_undo("Twice")
        bpy.context.active_object.location.z = 5
        self.assertEqual(self.top(), 2.0, "in the object's own space")
        bpy.context.active_object.modifiers.new("Up", "DISPLACE").strength = 0.5
        self.assertAlmostEqual(self.top(), 2.25, places=2)  # its middle level is 0.5
        push_undo("Displaced")
        undo()
        self.assertEqual(self.top(), 2.0)
        undo()
        self.assertEqual(self.top(), 1.0)
        bpy.context.active_object.data.clear_geometry()
        self.assertIsNone(self.top())

    def test_is_not_met_while_it_is_hidden(self) -> None:
        self.assertEqual(self.top(), 1.0)
        bpy.context.active_object.hide_set(True)
        self.assertIsNone(self.top())
