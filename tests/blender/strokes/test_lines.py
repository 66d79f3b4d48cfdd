# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of Blender's own tools become strokes: grease pencil, annotations, curves, hair."""

import json
import unittest

import bpy
import numpy as np
from bpy.types import Object
from geometry import to_path
from harness import SculptCase, add, arc, brush_settings, module, strokes_of, undo, vertices
from mathutils import Matrix

ops = bpy.ops.neural_sculpt
PLACE = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.5, 4, "Z") @ Matrix.Scale(2, 4)
LAYER = Matrix.Translation((0, 0, 0.5))
POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 1)], np.float32)
RADII = np.array([0.5, 1.0, 2.0, 1.0], np.float32)
LEGACY = bpy.app.version < (4, 3)


def link(name: str, data: bpy.types.ID, matrix: Matrix = PLACE) -> Object:
    """A selected object."""
    ob = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(ob)
    ob.matrix_world = matrix
    bpy.context.view_layer.update()
    ob.select_set(True)
    return ob


def grease_pencil(*lines: np.ndarray, matrix: Matrix = PLACE) -> Object:
    """An object with these lines in one layer, which is moved by LAYER."""
    if LEGACY:
        data = bpy.data.grease_pencils.new("Pencil")
        layer = data.layers.new("Lines")
        frame = layer.frames.new(1)
        for line in lines:
            stroke = frame.strokes.new()
            stroke.points.add(len(line))
            stroke.points.foreach_set("co", line.ravel())
            stroke.points.foreach_set("pressure", np.resize(RADII, len(line)) / 2)
            stroke.select = False
        layer.location = LAYER.translation
    else:
        v3 = getattr(bpy.data, "grease_pencils_v3", None)
        data = (bpy.data.grease_pencils if v3 is None else v3).new("Pencil")
        layer = data.layers.new("Lines")
        drawing = layer.frames.new(1).drawing
        drawing.add_strokes([len(line) for line in lines])
        flat = np.concatenate(lines).astype(np.float32)
        drawing.attributes["position"].data.foreach_set("vector", flat.ravel())
        for stroke in drawing.strokes:
            for point, radius in zip(stroke.points, np.resize(RADII, 99).tolist(), strict=False):
                point.radius = radius
        layer.translation = LAYER.translation
    return link("Pencil", data, matrix)


def in_world(points: np.ndarray, matrix: Matrix = PLACE) -> np.ndarray:
    place = np.array(matrix)
    return points @ place[:3, :3].T + place[:3, 3]


class Lines(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.reader = module("blender.scene.lines")

    def lines(self) -> list:
        return self.reader.selected_lines(bpy.context)

    def test_grease_pencil(self) -> None:
        grease_pencil(POINTS, POINTS[:2])
        first, second = self.lines()
        wanted = in_world(POINTS, PLACE @ LAYER)
        np.testing.assert_allclose(first.points, wanted, atol=1e-5)
        np.testing.assert_allclose(second.points, wanted[:2], atol=1e-5)
        np.testing.assert_allclose(first.thickness, RADII / 2, atol=1e-6)
        np.testing.assert_allclose(second.thickness, RADII[:2] / 2, atol=1e-6)
        self.assertEqual((first.name, first.closed), ("Pencil", False))

    def test_selected_grease_pencil_strokes(self) -> None:
        ob = grease_pencil(POINTS, POINTS[:2])
        if LEGACY:
            ob.data.layers[0].active_frame.strokes[1].select = True
        else:
            drawing = ob.data.layers[0].current_frame().drawing
            for stroke, chosen in zip(drawing.strokes, (False, True), strict=True):
                stroke.select = chosen
        (line,) = self.lines()
        self.assertEqual(len(line.points), 2)

    def test_hidden_layers_and_parents(self) -> None:
        """A layer with a parent is where that has it, and not where its object is."""
        ob = grease_pencil(POINTS)
        layer = ob.data.layers[0]
        layer.hide = True
        self.assertEqual(self.lines(), [])
        layer.hide = False
        layer.parent = link("Parent", None, Matrix.Translation((5, 0, 0)))
        bpy.context.view_layer.update()
        (line,) = self.lines()
        np.testing.assert_allclose(line.points, in_world(POINTS, LAYER), atol=1e-6)

    @unittest.skipIf(LEGACY, "there are no groups of layers")
    def test_hidden_groups_of_layers(self) -> None:
        data = grease_pencil(POINTS).data
        outer, inner = (data.layer_groups.new(name) for name in ("Outer", "Inner"))
        data.layer_groups.move_to_layer_group(inner, outer)
        data.layers.move_to_layer_group(data.layers[0], inner)
        self.assertEqual(len(self.lines()), 1)
        for group in (inner, outer):
            group.hide = True
            self.assertEqual(self.lines(), [])
            group.hide = False

    def test_curve(self) -> None:
        data = bpy.data.curves.new("Curve", "CURVE")
        data.bevel_depth = 0.2
        poly = data.splines.new("POLY")
        poly.points.add(3)
        for point, place, radius in zip(poly.points, POINTS, RADII, strict=True):
            point.co, point.radius = (*place, 1), radius
        bezier = data.splines.new("BEZIER")
        bezier.bezier_points.add(2)
        bezier.use_cyclic_u = True
        for point, x in zip(bezier.bezier_points, (4, 5, 6), strict=True):
            point.co = (x, (x - 5) ** 2, 0)
            point.handle_left_type = point.handle_right_type = "AUTO"
        link("Curve", data)
        count = len(bpy.data.objects), len(bpy.data.curves)
        first, second = self.lines()
        np.testing.assert_allclose(first.points, in_world(POINTS), atol=1e-5)
        np.testing.assert_allclose(first.thickness, RADII / 2, atol=1e-6)
        self.assertFalse(first.closed)
        self.assertTrue(second.closed)
        self.assertGreater(len(second.points), 20)
        np.testing.assert_allclose(second.thickness, 0.5, atol=1e-6)
        self.assertEqual((len(bpy.data.objects), len(bpy.data.curves)), count, "nothing is left")

    def test_hair(self) -> None:
        data = bpy.data.hair_curves.new("Hair")
        data.add_curves([4, 2])
        flat = np.concatenate([POINTS, POINTS[:2]]).ravel()
        data.attributes["position"].data.foreach_set("vector", flat)
        link("Hair", data)
        first, second = self.lines()
        np.testing.assert_allclose(first.points, in_world(POINTS), atol=1e-5)
        np.testing.assert_allclose(second.points, in_world(POINTS[:2]), atol=1e-5)

    def test_annotations(self) -> None:
        collection = getattr(bpy.data, "annotations", bpy.data.grease_pencils)
        data = collection.new("Notes")
        frame = data.layers.new("Lines").frames.new(1)
        if not hasattr(frame.strokes, "new"):
            raise unittest.SkipTest("this Blender cannot make annotations by script")
        stroke = frame.strokes.new()
        stroke.display_mode = "3DSPACE"
        stroke.points.add(4)
        stroke.points.foreach_set("co", POINTS.ravel())
        word = "annotation" if hasattr(bpy.context.scene, "annotation") else "grease_pencil"
        setattr(bpy.context.scene, word, data)
        (line,) = self.reader.annotation_lines(bpy.context)
        np.testing.assert_allclose(line.points, POINTS, atol=1e-6)

    def test_other_objects_are_passed_over(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        self.assertEqual(self.lines(), [])


class Strokes(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")
        self.path = arc(self.ob)
        brush = brush_settings()
        brush.radius, brush.intensity = 0.15, 0.06

    def test_a_line_above_the_surface_becomes_a_stroke_on_it(self) -> None:
        self.ob.matrix_world = PLACE
        bpy.context.view_layer.update()
        above = (1.1 * self.path).astype(np.float32) - np.array(LAYER.translation, np.float32)
        far = above + np.float32([0, 0, 5])
        grease_pencil(above, far)
        bpy.context.view_layer.objects.active = self.ob
        before = np.linalg.norm(vertices(self.ob), axis=1).mean()
        ops.strokes_from_lines(distance=0.3)
        (kept,) = strokes_of(self.ob)
        self.assertEqual(kept["name"], "Pencil")
        self.assertAlmostEqual(np.linalg.norm(kept["points"], axis=1).mean(), before, delta=0.01)
        self.assertLess(to_path(np.array(kept["points"]), self.path).max(), 0.02)
        factors = np.array(kept["intensity_factors"])
        self.assertLess(factors.min(), 0.6, "thin parts are weaker")
        heights = np.linalg.norm(vertices(self.ob), axis=1) - before
        self.assertGreater(heights.max(), 0.04)
        undo()
        self.assertEqual(strokes_of(bpy.data.objects["Sphere"]), [])

    def test_nothing_to_follow(self) -> None:
        self.assert_fails("Select some", ops.strokes_from_lines)
        self.assert_fails("annotations", ops.strokes_from_lines, source="ANNOTATIONS")
        grease_pencil(self.path.astype(np.float32) + np.float32([0, 0, 9]))
        bpy.context.view_layer.objects.active = self.ob
        self.assert_fails("too far", ops.strokes_from_lines)

    def test_the_field_is_hidden(self) -> None:
        grease_pencil(self.path.astype(np.float32))
        bpy.context.view_layer.objects.active = self.ob
        self.ob.hide_viewport = True
        bpy.context.view_layer.update()
        self.assert_fails("Show it", ops.strokes_from_lines)


class File(SculptCase):
    def test_the_strokes_of_a_file_are_one_step(self) -> None:
        ob = add("SPHERE")
        path = self.folder / "two.json"
        points = (arc(ob, tilt=0.4), arc(ob, tilt=-0.4))
        listed = [
            {"points": p.tolist(), "radius": 0.1, "intensity": 0.05, "name": name}
            for name, p in zip(("Over", "Under"), points, strict=True)
        ]
        path.write_text(json.dumps({"version": 1, "strokes": listed}), encoding="utf-8")
        before = vertices(ob)
        size = np.linalg.norm(before, axis=1).mean()
        ops.strokes_from_file(filepath=str(path))
        self.assertEqual([item.name for item in ob.neural_sculpt.strokes], ["Over", "Under"])
        heights = np.linalg.norm(vertices(ob), axis=1) - size
        for line in points:
            near = to_path(vertices(ob), line[2:-2] * (1 + 0.05 / size)) < 0.02
            self.assertGreater(near.sum(), 5)
            self.assertAlmostEqual(np.median(heights[near]), 0.05, delta=0.01)
        undo()
        np.testing.assert_array_equal(vertices(bpy.context.active_object), before)
