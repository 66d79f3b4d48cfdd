# SPDX-License-Identifier: GPL-3.0-or-later
"""Export: each kind of file read back, and what cannot be written."""

import importlib.util
import types
from pathlib import Path

import bpy
import numpy as np
from bpy.types import Mesh, Object
from harness import RESOLUTION, SculptCase, add, in_world, module, stroke, vertices
from mathutils import Euler, Matrix
from mathutils.kdtree import KDTree


def decorate(ob: Object) -> None:
    """As an artist may: the map is what is seen from above; what is high has the second material, a
    color and a group of its own."""
    mesh, points = ob.data, vertices(ob)
    is_high = points[:, 2] > 0
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    for name in ("Clay", "Iron"):
        mesh.materials.append(bpy.data.materials.new(name))
    above = points[corners].reshape(-1, 3, 3)[..., 2].mean(axis=1) > 0
    mesh.polygons.foreach_set("material_index", above.astype(np.int32))
    mesh.uv_layers.new(name="Map").uv.foreach_set("vector", points[corners, :2].ravel())
    color = mesh.color_attributes.new("Color", "BYTE_COLOR", "POINT")
    color.data.foreach_set("color", np.outer(is_high, np.ones(4, np.float32)).ravel())
    group = ob.vertex_groups.new(name="High")
    group.add(np.flatnonzero(is_high).tolist(), 1.0, "REPLACE")


def read_back() -> tuple[np.ndarray, Mesh]:
    """The mesh that was just imported, and its vertices (V, 3) in the scene."""
    ob = bpy.context.active_object
    bpy.context.view_layer.update()
    return in_world(ob), ob.data


class Export(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("TORUS")
        self.base = self.ob.neural_sculpt.base_weights

    def export(self, name: str, **given: object) -> str:
        path = str(self.folder / name)
        self.assertEqual(bpy.ops.neural_sculpt.export(filepath=path, **given), {"FINISHED"})
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

    def test_detail(self) -> None:
        """It travels as .safetensors; .pth files have no place for it."""
        stroke(np.array([[0.5, -0.1, 0.2], [0.5, 0.1, 0.2]]), radius=0.1, intensity=0.05)
        path = self.export("field.safetensors")
        pth = str(self.folder / "field.pth")
        self.assert_fails("onsolidate", bpy.ops.neural_sculpt.export, filepath=pth)
        bpy.ops.neural_sculpt.add(kind="FILE", filepath=path)
        read = vertices(bpy.context.active_object)  # in an order of its own
        self.assertEqual(len(read), len(vertices(self.ob)))
        tree = KDTree(len(read))
        for number, point in enumerate(read):
            tree.insert(point, number)
        tree.balance()
        found = [tree.find(point)[1:] for point in vertices(self.ob)]
        self.assertEqual(len({number for number, _ in found}), len(read))
        self.assertLess(max(distance for _, distance in found), 1e-5)

    def test_gltf_without_blenders_add_on(self) -> None:
        bpy.ops.preferences.addon_disable(module="io_scene_gltf2")
        self.addCleanup(bpy.ops.preferences.addon_enable, module="io_scene_gltf2")
        for name in ("field.glb", "field.gltf"):
            path = str(self.folder / name)
            self.assert_fails("Enable it", bpy.ops.neural_sculpt.export, filepath=path)

    def test_a_field_that_cannot_be_selected(self) -> None:
        """Blender's exporters write what is selected."""
        self.ob.hide_select = True
        count = len(vertices(self.ob))
        path = self.export("field.obj", resolution=RESOLUTION)
        bpy.ops.wm.obj_import(filepath=path)
        self.assertGreater(len(vertices(bpy.context.active_object)), count / 2)

    def test_the_objects_own_name_is_written(self) -> None:
        """And not that of the copy that exporters see; here a field with a name as long as Blender
        allows, too, whose driver disables it in viewports."""
        for name in ("Head", "x" * 63):
            self.ob.name = self.ob.data.name = name
            path = self.export("field.obj", resolution=RESOLUTION)
            self.assertIn(f"o {name}\n", Path(path).read_text())
            path = self.export("field.glb", resolution=RESOLUTION)
            said = Path(path).read_bytes()
            self.assertEqual(said.count(f'"name":"{name}"'.encode()), 2)
            self.assertEqual((self.ob.name, self.ob.data.name), (name, name))
            self.ob.driver_add("hide_viewport").driver.expression = "1"
            bpy.context.view_layer.update()
            self.assertTrue(self.ob.hide_viewport)

    def test_meshes(self) -> None:
        self.ob.location = (0.0, 0.0, 5.0)
        bpy.ops.mesh.primitive_cube_add()
        cube = bpy.context.active_object
        bpy.context.view_layer.objects.active = self.ob
        objects, meshes = len(bpy.data.objects), len(bpy.data.meshes)
        count, faces = len(self.ob.data.vertices), len(self.ob.data.polygons)
        readers = {
            "obj": bpy.ops.wm.obj_import,
            "ply": bpy.ops.wm.ply_import,
            "stl": bpy.ops.wm.stl_import,
            "glb": bpy.ops.import_scene.gltf,
            "gltf": bpy.ops.import_scene.gltf,
        }
        for suffix, read in readers.items():
            path = self.export(f"proxy.{suffix}", resolution=RESOLUTION)
            self.assertTrue(cube.select_get(), "the selection is as it was")
            self.assertFalse(self.ob.select_get())
            self.assertEqual(len(bpy.data.objects), objects)
            self.assertEqual(len(bpy.data.meshes), meshes)
            read(filepath=path)
            ob = bpy.context.active_object
            self.assertEqual(len(ob.data.polygons), faces, suffix)
            if suffix not in ("glb", "gltf"):  # whose importer splits vertices
                self.assertEqual(len(ob.data.vertices), count, suffix)
            bpy.context.view_layer.update()
            for end in (np.min, np.max):  # the order of the vertices is the exporter's own
                np.testing.assert_allclose(
                    end(in_world(ob), 0), end(in_world(self.ob), 0), atol=1e-4
                )
            bpy.data.batch_remove([ob, ob.data])
            bpy.context.view_layer.objects.active = self.ob
            cube.select_set(True)

    def test_a_mesh_finer_than_the_proxy_with_its_material_and_modifier(self) -> None:
        self.ob.data.materials.append(bpy.data.materials.new("Clay"))
        self.ob.modifiers.new("Twice", "ARRAY").count = 2
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION, refine=False)
        path = self.export("fine.obj", resolution=2 * RESOLUTION, refine=False)
        bpy.ops.wm.obj_import(filepath=path)
        ob = bpy.context.active_object
        self.assertAlmostEqual(
            len(ob.data.polygons) / len(self.ob.data.polygons) / 2, 4.0, delta=0.2
        )
        self.assertTrue(ob.data.materials[0].name.startswith("Clay"))

    def test_what_hangs_on_the_proxy_is_on_a_finer_mesh(self) -> None:
        decorate(self.ob)
        fine = {"resolution": 2 * RESOLUTION, "refine": False}
        bpy.ops.wm.obj_import(filepath=self.export("torus.obj", **fine))
        points, mesh = read_back()
        corners = np.array([polygon.vertices[:] for polygon in mesh.polygons])  # (F, 3)
        iron = next(i for i, m in enumerate(mesh.materials) if m.name.startswith("Iron"))
        is_iron = np.array([polygon.material_index == iron for polygon in mesh.polygons])
        is_high = points[corners, 2].mean(axis=1) > 0
        self.assertLess(np.mean(is_iron != is_high), 0.02)
        flat = np.empty(2 * len(mesh.loops), np.float32)
        mesh.uv_layers.active.uv.foreach_get("vector", flat)
        seen_from_above = points[corners.ravel(), :2]
        np.testing.assert_allclose(flat.reshape(-1, 2), seen_from_above, atol=0.02)

        bpy.context.view_layer.objects.active = self.ob
        bpy.ops.wm.ply_import(filepath=self.export("torus.ply", **fine))
        points, mesh = read_back()
        color = np.empty(4 * len(points), np.float32)
        mesh.color_attributes[0].data.foreach_get("color", color)
        self.assertLess(np.mean((color[::4] > 0.5) != (points[:, 2] > 0)), 0.02)

        self.ob.modifiers.new("Mask", "MASK").vertex_group = "High"
        bpy.context.view_layer.objects.active = self.ob
        bpy.ops.wm.obj_import(filepath=self.export("high.obj", **fine))
        above, _ = read_back()
        self.assertAlmostEqual(len(above) / len(points), 0.5, delta=0.05)
        self.assertGreater(above[:, 2].min(), -0.03)

    def test_modifiers_that_leave_nothing(self) -> None:
        self.ob.vertex_groups.new(name="Empty")
        self.ob.modifiers.new("Mask", "MASK").vertex_group = "Empty"
        path, objects = self.folder / "none.obj", len(bpy.data.objects)
        given = {"filepath": str(path), "resolution": RESOLUTION}
        self.assert_fails("leave no face", bpy.ops.neural_sculpt.export, **given)
        self.assertFalse(path.exists())
        self.assertEqual(len(bpy.data.objects), objects)
        self.export("all.obj", resolution=RESOLUTION, modifiers=False)

    def test_modifiers_that_put_instances_in_place_of_the_mesh(self) -> None:
        nodes = bpy.data.node_groups.new("Instance", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            nodes.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        given, instance, made = (
            nodes.nodes.new(kind)
            for kind in ("NodeGroupInput", "GeometryNodeGeometryToInstance", "NodeGroupOutput")
        )
        nodes.links.new(given.outputs[0], instance.inputs[0])
        nodes.links.new(instance.outputs[0], made.inputs[0])
        self.ob.modifiers.new("Nodes", "NODES").node_group = nodes
        for suffix in ("obj", "ply", "stl", "glb"):
            path = self.export(f"instance.{suffix}", resolution=RESOLUTION)
            self.assertGreater(Path(path).stat().st_size, 10_000, suffix)

    def test_a_script_in_edit_mode(self) -> None:
        """In which Blender tells a script nothing of what hangs on the mesh."""
        bpy.ops.object.mode_set(mode="EDIT")
        given = {"filepath": str(self.folder / "torus.obj"), "resolution": RESOLUTION}
        self.assert_fails("Leave Edit Mode", bpy.ops.neural_sculpt.export, **given)
        self.assertEqual(bpy.context.mode, "EDIT_MESH")

    def test_the_artist_stays_in_sculpt_mode(self) -> None:
        """Of another object, or of the field."""
        bpy.ops.mesh.primitive_cube_add()
        for worked_at in (bpy.context.active_object, self.ob):
            for suffix in ("obj", "ply", "stl", "glb"):
                bpy.context.view_layer.objects.active = self.ob
                path = self.folder / f"{worked_at.name}.{suffix}"
                with self.as_in_a_window():
                    bpy.ops.neural_sculpt.export(filepath=str(path), resolution=RESOLUTION)
                    bpy.context.view_layer.objects.active = worked_at
                    bpy.ops.object.mode_set(mode="SCULPT")
                    self.finish()
                self.assertTrue(path.exists(), path.name)
                self.assertEqual(bpy.context.mode, "SCULPT", path.name)
                bpy.ops.object.mode_set(mode="OBJECT")

    def test_without_modifiers_and_as_text(self) -> None:
        self.ob.modifiers.new("Twice", "ARRAY").count = 2
        faces = len(self.ob.data.polygons)
        given = {"resolution": RESOLUTION, "modifiers": False}
        path = self.export("plain.stl", text=True, **given)
        with open(path, encoding="ascii") as file:
            facets = sum(line.split()[:1] == ["facet"] for line in file)
        self.assertEqual(facets, faces)

    def test_the_format_of_the_dialog_is_the_suffix(self) -> None:
        operator = bpy.types.NEURAL_SCULPT_OT_export
        for given, chosen, wanted in (
            ("/a/Torus", "SAFETENSORS", "/a/Torus.safetensors"),
            ("/a/Torus.safetensors", "VDB", "/a/Torus.vdb"),
            ("/a/Torus.OBJ", "OBJ", "/a/Torus.OBJ"),
            ("/a/v1.2", "STL", "/a/v1.2.stl"),
        ):
            shown = types.SimpleNamespace(filepath=given, format=chosen)
            changed = operator.check(shown, bpy.context)
            self.assertEqual(Path(shown.filepath), Path(wanted))
            self.assertEqual(changed, given != wanted)

    def test_every_format_has_a_suffix_of_its_own(self) -> None:
        properties = bpy.ops.neural_sculpt.export.get_rna_type().properties
        kinds = module("blender.operators.fields.export").JOB_KINDS
        names = {f".{item.identifier.lower()}" for item in properties["format"].enum_items}
        self.assertEqual(names, set(kinds))

    def test_level_set(self) -> None:
        path = self.folder / "field.vdb"
        if hasattr(bpy.utils, "expose_bundled_modules"):
            bpy.utils.expose_bundled_modules()
        if importlib.util.find_spec("openvdb") is None:  # before 4.5, and as Debian builds it
            self.assert_fails("no OpenVDB", bpy.ops.neural_sculpt.export, filepath=str(path))
            return
        import openvdb

        self.ob.matrix_world = Matrix.LocRotScale(
            (0.0, 1.0, 5.0), Euler((1.0, 0.0, 0.5)), (2, 2, 2)
        )
        self.export("field.vdb", resolution=64)
        grids, _ = openvdb.readAll(str(path))
        (grid,) = grids
        self.assertEqual(grid.gridClass, openvdb.GridClass.LEVEL_SET)
        voxel = 2 * 2 / 64  # the scale and the box
        self.assertAlmostEqual(grid.background, 3 * voxel, places=6)
        points, _ = grid.convertToQuads()  # in the scene
        low, high = points.min(0), points.max(0)
        np.testing.assert_allclose(low, in_world(self.ob).min(0), atol=voxel)
        np.testing.assert_allclose(high, in_world(self.ob).max(0), atol=voxel)
        values = grid.getConstAccessor()
        self.assertLess(values.getValue((32 + 16, 32, 32)), -1.5 * voxel)  # inside the ring
        self.assertGreater(values.getValue((32, 32, 32)), 1.5 * voxel)  # in its hole
        self.assertLess(grid.activeVoxelCount(), 0.5 * 65**3)

    def test_an_object_without_size_or_place(self) -> None:
        """In whose coordinates nothing can be told; the field itself can be written."""
        for scale, location in (((1, 1, 0), 0.0), ((1, 1, 1), np.nan), ((1e20,) * 3, 0.0)):
            self.ob.scale, self.ob.location.x = scale, location
            bpy.context.view_layer.update()
            path = str(self.folder / "flat.obj")
            self.assert_fails("no size", bpy.ops.neural_sculpt.export, filepath=path)
        self.export("flat.safetensors")

    def test_a_level_set_of_a_flat_or_tiny_object(self) -> None:
        level_set = module("blender.operators.fields.level_set")
        try:
            level_set.check()
        except level_set.SculptError:
            self.skipTest("there is no OpenVDB")
        given = {"filepath": str(self.folder / "torus.vdb"), "resolution": RESOLUTION}
        for scale, sentence in (((1, 1, 0), "no size"), ((1e-5,) * 3, "too small for OpenVDB")):
            self.ob.scale = scale
            bpy.context.view_layer.update()
            self.assert_fails(sentence, bpy.ops.neural_sculpt.export, **given)

    def test_refused(self) -> None:
        export = bpy.ops.neural_sculpt.export
        self.assert_fails("no folder", export, filepath=str(self.folder / "no" / "x.pth"))
        self.assert_fails("cannot be exported", export, filepath=str(self.folder / "x.docx"))
        for suffix in ("safetensors", "pth", "obj", "ply", "stl"):
            path = self.folder / f"taken.{suffix}"
            path.mkdir()
            self.assert_fails("taken", export, filepath=str(path), resolution=RESOLUTION)
        self.assertEqual(self.ob.neural_sculpt.base_weights, self.base)

    def test_what_other_brushes_did_is_not_left_out_in_silence(self) -> None:
        points = vertices(self.ob)
        points[0] *= 1.1
        self.ob.data.vertices.foreach_set("co", points.ravel())
        for name in ("field.safetensors", "mesh.ply"):
            path = self.folder / name
            self.assert_fails("other brushes", bpy.ops.neural_sculpt.export, filepath=str(path))
            self.assertFalse(path.exists())

    def test_needs_a_field(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        with self.assertRaisesRegex(RuntimeError, "Select a neural field"):
            bpy.ops.neural_sculpt.export(filepath=str(self.folder / "x.pth"))
