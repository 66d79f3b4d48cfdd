# SPDX-License-Identifier: GPL-3.0-or-later
"""Remeshing: what it costs is said before, and all that is not the proxy stays."""

import bpy
import numpy as np
from harness import RESOLUTION, SculptCase, add, arc, in_world, module, stroke, undo, vertices


class Remesh(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")

    def test_the_triangles_are_as_many_as_was_said(self) -> None:
        estimate = module("blender.panels.estimate")
        said = estimate.triangles(self.ob, 2 * RESOLUTION)
        kept, passing = estimate.memory(self.ob, 2 * RESOLUTION)
        bpy.ops.neural_sculpt.remesh(resolution=2 * RESOLUTION)
        self.assertAlmostEqual(said / len(self.ob.data.polygons), 1.0, delta=0.1)
        self.assertEqual(self.ob.neural_sculpt.resolution, 2 * RESOLUTION)
        self.assertTrue(50 * said < kept < passing)

    def test_shading_stays_as_it_was_chosen(self) -> None:
        """Through strokes and undo: smooth by the field's normals, or each triangle flat."""
        ops = bpy.ops.neural_sculpt
        self.assertGreater(self.bend(), 0.01)
        ops.remesh(resolution=RESOLUTION, smooth=False)
        self.assertLess(self.bend(), 1e-5)
        stroke(arc(self.ob))
        self.assertLess(self.bend(), 1e-5)
        ops.remesh(resolution=RESOLUTION, smooth=True)
        self.assertGreater(self.bend(), 0.01)
        undo()
        self.assertLess(self.bend(), 1e-5)
        self.assertFalse(bpy.context.active_object.neural_sculpt.smooth)

    def bend(self) -> float:
        """How far the normals at the corners of a triangle are from its own, in the mean."""
        mesh = bpy.context.active_object.data
        corners = np.empty(3 * len(mesh.loops), np.float32)
        mesh.corner_normals.foreach_get("vector", corners)
        a, b, c = vertices(bpy.context.active_object)[self.triangles(mesh)].swapaxes(0, 1)
        own = np.cross(b - a, c - a)
        own /= np.linalg.norm(own, axis=1, keepdims=True)
        return float(np.linalg.norm(corners.reshape(-1, 3, 3) - own[:, None], axis=2).mean())

    def triangles(self, mesh: bpy.types.Mesh) -> np.ndarray:
        """Vertices (F, 3) of the triangles."""
        flat = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", flat)
        return flat.reshape(-1, 3)

    def test_place_materials_and_modifiers_stay_through_every_rebuild(self) -> None:
        self.ob.data.materials.append(bpy.data.materials.new("Clay"))
        self.ob.modifiers.new("Twice", "ARRAY").count = 2
        self.ob.location = (1.0, 2.0, 3.0)
        self.ob.scale = (2.0, 2.0, 2.0)
        bpy.context.view_layer.update()
        place = in_world(self.ob).mean(0)
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION + 16, refine=False)
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
