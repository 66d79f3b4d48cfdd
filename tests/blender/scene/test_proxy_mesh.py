# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays written into a mesh: geometry, normals, bounds, materials, and when that is refused."""

from typing import Any

import bpy
import numpy as np
from harness import SculptCase, module, push_undo, redo, undo, vertices


def octahedron(size: float = 1.0, dtype: type = np.float32) -> tuple[np.ndarray, ...]:
    """Vertices, unit normals and triangles of an octahedron, seen from outside."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype)
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return size * points, points, np.array(faces, np.int32)


class ProxyMesh(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.proxy = module("blender.scene.mesh.proxy_mesh")
        self.mesh = bpy.data.meshes.new("Proxy")
        self.ob = bpy.data.objects.new("Proxy", self.mesh)
        bpy.context.collection.objects.link(self.ob)

    def fill(self, *arrays: np.ndarray, smooth: bool = True) -> None:
        """Fill the mesh."""
        self.proxy.fill(self.mesh, self.geometry(*arrays, smooth=smooth))

    def geometry(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        triangles: np.ndarray,
        smooth: bool = True,
    ) -> Any:
        """What to fill a mesh with; its edges are found one by one."""
        places: dict[tuple[int, int], int] = {}
        corner_edges = [
            [
                places.setdefault((min(ends), max(ends)), len(places))
                for ends in ((a, b), (b, c), (c, a))
            ]
            for a, b, c in triangles.tolist()
        ]
        edges = np.array([*places], triangles.dtype)
        arrays = points, normals, triangles, edges, np.array(corner_edges)
        return self.proxy.geometry(*arrays, smooth=smooth)

    def test_geometry(self) -> None:
        points, normals, triangles = octahedron(2.0)
        self.fill(points, normals, triangles)
        np.testing.assert_array_equal(vertices(self.ob), points)
        faces = [tuple(face.vertices) for face in self.mesh.polygons]
        self.assertEqual(faces, [tuple(face) for face in triangles.tolist()])
        self.assertEqual(len(self.mesh.edges), 12)
        self.assertFalse(self.mesh.validate(verbose=True), "the mesh was valid")
        self.assertTrue(all(face.use_smooth for face in self.mesh.polygons))
        for face in self.mesh.polygons:
            self.assertGreater(face.normal.dot(face.center), 0)

    def test_flat_and_smooth_again(self) -> None:
        for smooth in (False, True, False):
            self.fill(*octahedron(), smooth=smooth)
            self.assertEqual({face.use_smooth for face in self.mesh.polygons}, {smooth})

    def test_triangles_begin_where_the_last_ended(self) -> None:
        for count in (2, 8, 3):
            points, normals, triangles = octahedron()
            self.fill(points, normals, triangles[:count])
            starts = [face.loop_start for face in self.mesh.polygons]
            self.assertEqual(starts, list(range(0, 3 * count, 3)))

    def test_normals_are_those_of_the_field(self) -> None:
        points, normals, triangles = octahedron()
        tilted = normals + np.float32([0.3, 0.1, 0.2])
        tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
        self.fill(points, tilted, triangles)
        if bpy.app.version < (4, 5, 0):
            self.assertFalse(self.mesh.has_custom_normals)
            return
        flat = np.empty(3 * len(self.mesh.loops), np.float32)
        self.mesh.corner_normals.foreach_get("vector", flat)
        np.testing.assert_allclose(flat.reshape(-1, 3), tilted[triangles.ravel()], atol=1e-6)

    def test_bounds_follow_every_time(self) -> None:
        for size in (1.0, 3.0, 0.5):
            self.fill(*octahedron(size))
            bpy.context.view_layer.update()
            np.testing.assert_allclose(self.ob.dimensions, [2 * size] * 3, rtol=1e-6)

    def test_materials_stay(self) -> None:
        self.fill(*octahedron())
        self.mesh.materials.append(bpy.data.materials.new("Clay"))
        self.fill(*octahedron(2.0))
        self.assertEqual([material.name for material in self.mesh.materials], ["Clay"])

    def test_other_dtypes_and_layouts(self) -> None:
        points, normals, triangles = octahedron(1.5, np.float64)
        self.fill(np.asfortranarray(points), normals, triangles.astype(np.int64))
        np.testing.assert_array_equal(vertices(self.ob), points)

    def test_read_is_the_inverse(self) -> None:
        points, normals, triangles = octahedron()
        self.fill(points, normals, triangles)
        read_points, read_triangles = self.proxy.read(self.mesh)
        np.testing.assert_array_equal(read_points, points)
        np.testing.assert_array_equal(read_triangles, triangles)

    def test_a_spare_mesh_is_in_no_file_and_undo_leaves_none_over(self) -> None:
        """Whatever comes between its pieces; and to show it is one step."""
        spare_mesh = module("blender.scene.mesh.spare_mesh")
        self.fill(*octahedron())
        push_undo("Proxy")
        spare = spare_mesh.SpareMesh(self.geometry(*octahedron(2.0)), True)
        self.assertTrue(spare.work(self.ob))
        path = str(self.folder / "saved.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
        with bpy.data.libraries.load(path) as (held, _):
            self.assertEqual(held.meshes, ["Proxy"])
        for x in (1.0, 2.0):
            bpy.data.objects["Proxy"].location.x = x
            push_undo("Move")
        for step in (undo, redo):
            step()
            self.assertEqual([mesh.name for mesh in bpy.data.meshes], ["Proxy"])
        spare = spare_mesh.SpareMesh(self.geometry(*octahedron(2.0)), True)
        while spare.work(bpy.data.objects["Proxy"]):
            pass
        spare.show(bpy.data.objects["Proxy"])
        spare_mesh.sweep()
        push_undo("Show")
        for step, size in ((undo, 1.0), (redo, 2.0)):
            step()
            (mesh,) = bpy.data.meshes
            self.assertEqual((mesh.name, mesh.users), ("Proxy", 1))
            self.assertNotIn(spare_mesh.SPARE, mesh)
            np.testing.assert_array_equal(vertices(bpy.data.objects["Proxy"]), octahedron(size)[0])

    def test_refused_in_edit_mode_and_with_shape_keys(self) -> None:
        self.fill(*octahedron())
        self.assertEqual(self.proxy.why_locked(self.ob), "")
        bpy.context.view_layer.objects.active = self.ob
        bpy.ops.object.mode_set(mode="EDIT")
        self.assertIn("Edit Mode", self.proxy.why_locked(self.ob))
        bpy.ops.object.mode_set(mode="OBJECT")
        self.ob.shape_key_add(name="Basis")
        self.assertIn("shape keys", self.proxy.why_locked(self.ob))
