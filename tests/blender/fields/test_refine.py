# SPDX-License-Identifier: GPL-3.0-or-later
"""Refined proxies: strokes, undo, budget, export and native sculpting as on the uniform ones."""

import bpy
import numpy as np
from harness import RESOLUTION, SculptCase, add, arc, module, redo, stroke, undo, vertices

THIN = {"radius": 0.02, "intensity": 0.01}


class Refined(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION, refine=False)
        self.uniform = self.count()
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION, refine=True, most_triangles=200_000)

    def count(self) -> int:
        return len(bpy.context.active_object.data.polygons)

    def test_a_thin_stroke_is_finer_and_undo_and_redo_bring_each_state(self) -> None:
        before = vertices(self.ob)
        stroke(arc(self.ob), **THIN)
        ob = bpy.context.active_object
        count, after = self.count(), vertices(ob)
        self.assertGreater(count, self.uniform + 100)
        self.assertFalse(ob.data.validate())
        undo()
        np.testing.assert_array_equal(vertices(bpy.context.active_object), before)
        redo()
        np.testing.assert_array_equal(vertices(bpy.context.active_object), after)
        self.assertTrue(bpy.context.active_object.neural_sculpt.refine)
        stroke(arc(bpy.context.active_object, tilt=0.5), **THIN)
        self.assertGreater(self.count(), count)
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION, refine=False)
        self.assertLess(self.count(), count)
        self.assertFalse(bpy.context.active_object.neural_sculpt.refine)
        undo()
        self.assertTrue(bpy.context.active_object.neural_sculpt.refine)

    def test_what_is_said_of_the_budget_holds(self) -> None:
        estimate = module("blender.panels.estimate")
        stroke(arc(self.ob), **THIN)
        ob = bpy.context.active_object
        self.assertEqual(estimate.triangles(ob, RESOLUTION, 200_000), 200_000)
        self.assertLess(self.count(), 200_000)
        said = estimate.triangles(ob, RESOLUTION)
        self.assertAlmostEqual(said / self.uniform, 1.0, delta=0.1)

    def test_an_exported_mesh_is_refined_the_same_way(self) -> None:
        stroke(arc(self.ob), **THIN)
        counts = []
        for refine in (False, True):
            path = self.folder / f"{refine}.obj"
            bpy.ops.neural_sculpt.export(filepath=str(path), resolution=RESOLUTION, refine=refine)
            lines = path.read_text().splitlines()
            counts.append(sum(line.startswith("f ") for line in lines))
        self.assertGreater(counts[1], counts[0] + 100)

    def test_what_other_brushes_did_is_absorbed(self) -> None:
        stroke(arc(self.ob), **THIN)
        ob = bpy.context.active_object
        moved = vertices(ob)
        near = np.linalg.norm(moved - moved[np.argmin(moved[:, 1])], axis=1)
        moved *= (1 + 0.05 * np.exp(-((near / 0.15) ** 2)))[:, None]
        ob.data.attributes["position"].data.foreach_set("vector", moved.ravel())
        ob.data.update()
        bpy.ops.neural_sculpt.absorb()
        ob = bpy.context.active_object
        self.assertEqual(len(ob.neural_sculpt.strokes), 2)
        reach = np.linalg.norm(vertices(ob), axis=1).max()
        self.assertAlmostEqual(reach, np.linalg.norm(moved, axis=1).max(), delta=0.01)
