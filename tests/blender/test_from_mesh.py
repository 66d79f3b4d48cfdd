# SPDX-License-Identifier: GPL-3.0-or-later
"""A field is fitted to a mesh and takes its place in the scene."""

import bpy
import numpy as np
from bpy.types import Object
from harness import SculptCase, in_world, long, module, push_undo, stroke, undo, vertices
from mathutils import Euler, Matrix, Vector


class FromMesh(SculptCase):
    def fit(self, source: Object, **given: object) -> Object:
        """The new field of the active mesh."""
        bpy.context.view_layer.objects.active = source
        self.assertEqual(
            bpy.ops.neural_sculpt.from_mesh(**{"preset": "DRAFT", **given}), {"FINISHED"}
        )
        return bpy.context.active_object

    def gaps(self, source: Object, ob: Object) -> np.ndarray:
        """Distances of the proxy from the source's surface, by the source's size."""
        inverse = source.matrix_world.inverted()
        points = (Vector(point) for point in in_world(ob)[::7].tolist())
        gaps = [source.closest_point_on_mesh(inverse @ p)[1] - inverse @ p for p in points]
        size = np.ptp(vertices(source), axis=0).max()
        return np.array([gap.length for gap in gaps]) / size

    def test_suzanne(self) -> None:
        bpy.ops.mesh.primitive_monkey_add(location=(1, 2, 3), rotation=(0.3, 0.2, 0.1), size=3)
        source = bpy.context.active_object
        push_undo("Add Suzanne")
        ob = self.fit(source)
        self.assertEqual(ob.name, "Suzanne Field")
        self.assertTrue(source.hide_get())
        self.assertGreater(len(vertices(ob)), 500)
        self.assertLess(np.abs(vertices(ob)).max(), 0.9)
        gaps = self.gaps(source, ob)
        self.assertLess(np.median(gaps), 0.01)
        self.assertLess(np.quantile(gaps, 0.95), 0.03)
        undo()
        self.assertFalse(bpy.data.objects["Suzanne"].hide_get())
        self.assertNotIn("Suzanne Field", bpy.data.objects)

    def test_coincides_under_uneven_scale_and_mirroring(self) -> None:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
        source = bpy.context.active_object
        source.matrix_world = (
            Matrix.Translation((3, -1, 2))
            @ Euler((0.4, 0.7, -0.2)).to_matrix().to_4x4()
            @ Matrix.Diagonal((-2.0, 1.0, 1.5, 1.0))
        )
        bpy.context.view_layer.update()
        ob = self.fit(source)
        x, y, z = ob.matrix_world.to_scale()
        self.assertAlmostEqual(x, y, places=5)
        self.assertAlmostEqual(x, z, places=5)
        low, high = in_world(source).min(0), in_world(source).max(0)
        np.testing.assert_allclose(in_world(ob).min(0), low, atol=0.15)
        np.testing.assert_allclose(in_world(ob).max(0), high, atol=0.15)
        middle = np.array(ob.matrix_world.inverted() @ source.matrix_world.translation)
        for face in list(ob.data.polygons)[::100]:
            self.assertGreater(np.dot(face.normal, np.array(face.center) - middle), 0)

    def test_modifiers_are_applied(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        source = bpy.context.active_object
        modifier = source.modifiers.new("Array", "ARRAY")
        modifier.relative_offset_displace = (2.0, 0.0, 0.0)
        read = module("blender.operators.fields.from_mesh").read_source
        points, triangles, _ = read(source, bpy.context)
        self.assertEqual((len(points), len(triangles)), (16, 24))
        self.assertEqual(points[:, 0].max(), 5.0)

    def test_materials_and_color_stay(self) -> None:
        """All of them; the proxy has the one that most faces had."""
        bpy.ops.mesh.primitive_cube_add()
        source = bpy.context.active_object
        for name in ("Iron", "Clay", "Glass"):
            source.data.materials.append(bpy.data.materials.new(name))
        source.material_slots[2].link = "OBJECT"
        source.material_slots[2].material = bpy.data.materials.new("Wax")
        for face, index in zip(source.data.polygons, (0, 2, 2, 1, 2, 1), strict=True):
            face.material_index = index
        source.color = (0.25, 0.5, 0.75, 1.0)
        ob = self.fit(source)
        names = [slot.material.name for slot in ob.material_slots]
        self.assertEqual(names, ["Wax", "Iron", "Clay"])
        self.assertEqual({face.material_index for face in ob.data.polygons}, {0})
        self.assertEqual(tuple(ob.color), (0.25, 0.5, 0.75, 1.0))
        count = len(ob.data.vertices)
        _, place, _, _ = ob.closest_point_on_mesh((0.1, -1.0, 0.2))
        stroke(np.array([place]), radius=0.2, intensity=0.1, name="Dab")
        self.assertNotEqual(len(ob.data.vertices), count)
        self.assertEqual([slot.material.name for slot in ob.material_slots], names)

    @long
    def test_same_seed_same_field(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        source = bpy.context.active_object
        source.name = "Cube"
        first = self.fit(source, seed=3)
        second = self.fit(source, seed=3)
        np.testing.assert_array_equal(vertices(first), vertices(second))

    def test_refused(self) -> None:
        fit = bpy.ops.neural_sculpt.from_mesh
        empty = bpy.data.objects.new("Nothing", bpy.data.meshes.new("Nothing"))
        bpy.context.collection.objects.link(empty)
        bpy.context.view_layer.objects.active = empty
        self.assert_fails("no faces", fit)
        bpy.ops.object.light_add()
        with self.assertRaisesRegex(RuntimeError, "Select a mesh"):
            fit()
        count = len(bpy.data.objects)
        bpy.ops.mesh.primitive_plane_add()
        self.assert_fails("open", fit)
        self.assertEqual(len(bpy.data.objects), count + 1)

    def test_good_enough_keeps_what_there_is_and_cancel_drops_it(self) -> None:
        bpy.ops.mesh.primitive_uv_sphere_add()
        source = bpy.context.active_object
        good_enough = bpy.ops.neural_sculpt.good_enough
        with self.assertRaisesRegex(RuntimeError, "No mesh is becoming"):
            good_enough()
        count = len(bpy.data.objects)
        with self.as_in_a_window():
            for end in (bpy.ops.neural_sculpt.cancel, good_enough):
                self.assertEqual(len(bpy.data.objects), count)
                bpy.context.view_layer.objects.active = source
                bpy.ops.neural_sculpt.from_mesh(preset="FINE")
                job, shown = self.session.jobs[0], []
                job.preview = shown.append
                self.pump(lambda shown=shown: shown)
                self.assertIn("vertices", shown[0].arrays)
                self.assertEqual(end(), {"FINISHED"})
                self.finish()
        self.assertEqual(len(bpy.data.objects), count + 1)
        self.assertLess(self.gaps(source, bpy.context.active_object).max(), 0.02)

    def test_a_plane_gets_a_thickness_in_scene_units(self) -> None:
        bpy.ops.mesh.primitive_plane_add(size=2)
        source = bpy.context.active_object
        source.scale = (2, 2, 2)
        bpy.context.view_layer.update()
        thick = {"open_parts": "THICKNESS", "thickness": 0.6}
        ob = self.fit(source, **thick, width="64", solver="NETWORK")
        size = np.ptp(in_world(ob), axis=0)
        np.testing.assert_allclose(size, [4, 4, 0.6], atol=0.1)
        self.assertEqual(ob.neural_sculpt.solver, "NETWORK")
        self.assertLess(len(ob.neural_sculpt.base_weights), 40000)
