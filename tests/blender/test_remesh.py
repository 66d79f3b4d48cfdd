# SPDX-License-Identifier: GPL-3.0-or-later
"""Remeshing: what it costs is said before, and all that is not the proxy stays."""

import bpy
import numpy as np
from harness import RESOLUTION, SculptCase, add, arc, in_world, module, stroke, vertices


class Remesh(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.solve_quickly()
        self.ob = add("SPHERE")

    def test_the_triangles_are_as_many_as_was_said(self) -> None:
        estimate = module("blender.estimate")
        said = estimate.triangles(self.ob, 2 * RESOLUTION)
        kept, passing = estimate.memory(self.ob, 2 * RESOLUTION)
        bpy.ops.neural_sculpt.remesh(resolution=2 * RESOLUTION)
        self.assertAlmostEqual(said / len(self.ob.data.polygons), 1.0, delta=0.1)
        self.assertEqual(self.ob.neural_sculpt.resolution, 2 * RESOLUTION)
        self.assertTrue(50 * said < kept < passing)

    def test_place_materials_and_modifiers_stay_through_every_rebuild(self) -> None:
        self.ob.data.materials.append(bpy.data.materials.new("Clay"))
        self.ob.modifiers.new("Twice", "ARRAY").count = 2
        self.ob.location = (1.0, 2.0, 3.0)
        self.ob.scale = (2.0, 2.0, 2.0)
        bpy.context.view_layer.update()
        place = in_world(self.ob).mean(0)
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION + 16)
        stroke(arc(self.ob))
        ob = bpy.context.active_object
        self.assertEqual([slot.material.name for slot in ob.material_slots], ["Clay"])
        self.assertEqual([(m.name, m.count) for m in ob.modifiers], [("Twice", 2)])
        np.testing.assert_allclose(in_world(ob).mean(0), place, atol=0.1)
        shown = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
        self.assertEqual(len(shown.data.polygons), 2 * len(ob.data.polygons))

    def test_bounds_are_those_of_the_proxy(self) -> None:
        for resolution in (RESOLUTION, RESOLUTION // 2):
            bpy.ops.neural_sculpt.remesh(resolution=resolution)
            bpy.context.view_layer.update()
            box = np.array(self.ob.bound_box)
            np.testing.assert_allclose(box.min(0), vertices(self.ob).min(0), atol=1e-6)
            np.testing.assert_allclose(box.max(0), vertices(self.ob).max(0), atol=1e-6)

    def test_a_locked_proxy_says_why(self) -> None:
        bpy.ops.object.mode_set(mode="EDIT")
        with self.assertRaisesRegex(RuntimeError, "Leave Edit Mode"):
            bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION)
