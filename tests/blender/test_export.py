# SPDX-License-Identifier: GPL-3.0-or-later
"""Export: each kind of file read back, and what cannot be written."""

import bpy
import numpy as np
from harness import SculptCase, add, in_world, vertices


class Export(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("TORUS")
        self.weights = self.ob.neural_sculpt.weights

    def export(self, name: str) -> str:
        path = str(self.folder / name)
        self.assertEqual(bpy.ops.neural_sculpt.export(filepath=path), {"FINISHED"})
        self.assertTrue((self.folder / name).stat().st_size)
        return path

    def test_networks(self) -> None:
        before = vertices(self.ob)
        for name in ("field.safetensors", "field.pth"):
            path = self.export(name)
            bpy.ops.neural_sculpt.add(kind="FILE", filepath=path)
            ob = bpy.context.active_object
            self.assertIsNot(ob, self.ob)
            self.assertEqual(ob.neural_sculpt.source, name)
            self.assertEqual(len(vertices(ob)), len(before))
            np.testing.assert_allclose(vertices(ob), before, atol=1e-5)
            bpy.context.view_layer.objects.active = self.ob

    def test_meshes(self) -> None:
        self.ob.location = (0.0, 0.0, 5.0)
        bpy.ops.mesh.primitive_cube_add()
        cube = bpy.context.active_object
        bpy.context.view_layer.objects.active = self.ob
        count, faces = len(self.ob.data.vertices), len(self.ob.data.polygons)
        readers = {"obj": bpy.ops.wm.obj_import, "ply": bpy.ops.wm.ply_import}
        readers["stl"] = bpy.ops.wm.stl_import
        for suffix, read in readers.items():
            path = self.export(f"proxy.{suffix}")
            self.assertTrue(cube.select_get(), "the selection is as it was")
            self.assertFalse(self.ob.select_get())
            read(filepath=path)
            ob = bpy.context.active_object
            self.assertEqual(len(ob.data.vertices), count, suffix)
            self.assertEqual(len(ob.data.polygons), faces, suffix)
            bpy.context.view_layer.update()
            for end in (np.min, np.max):  # the order of the vertices is the exporter's own
                np.testing.assert_allclose(
                    end(in_world(ob), 0), end(in_world(self.ob), 0), atol=1e-4
                )
            bpy.data.objects.remove(ob)
            bpy.context.view_layer.objects.active = self.ob
            cube.select_set(True)

    def test_refused(self) -> None:
        export = bpy.ops.neural_sculpt.export
        self.assert_fails("no folder", export, filepath=str(self.folder / "no" / "x.pth"))
        self.assert_fails("cannot be exported", export, filepath=str(self.folder / "x.docx"))
        for name in ("taken.safetensors", "taken.pth", "taken.obj", "taken.ply", "taken.stl"):
            (self.folder / name).mkdir()
            self.assert_fails("taken", export, filepath=str(self.folder / name))
        self.assertEqual(self.ob.neural_sculpt.weights, self.weights)

    def test_needs_a_field(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        with self.assertRaisesRegex(RuntimeError, "Select a neural field"):
            bpy.ops.neural_sculpt.export(filepath=str(self.folder / "x.pth"))
