# SPDX-License-Identifier: GPL-3.0-or-later
"""A sphere field is added, stroked by the worker, undone, saved, copied: the artist's way."""

import json
import shutil

import bpy
import numpy as np
from geometry import to_path
from harness import (
    RESOLUTION,
    SculptCase,
    add,
    arc,
    brush_settings,
    field,
    module,
    push_undo,
    redo,
    state,
    stroke,
    strokes_of,
    undo,
    vertices,
)

RADIUS, INTENSITY = 0.15, 0.06


class Add(SculptCase):
    def test_sphere(self) -> None:
        bpy.context.scene.cursor.location = (1.0, 2.0, 3.0)
        ob = add("SPHERE")
        size = np.linalg.norm(vertices(ob), axis=1)
        self.assertLess(np.ptp(size), 0.02)
        self.assertEqual(tuple(ob.location), (1.0, 2.0, 3.0))
        group = ob.neural_sculpt
        self.assertEqual(group.weights, b"", "the field is its base")
        self.assertEqual(len(group.revision), 32)
        self.assertEqual(group.resolution, RESOLUTION)
        self.assertEqual(strokes_of(ob), [])
        self.assertTrue(ob.select_get())
        for face in list(ob.data.polygons)[::50]:
            self.assertGreater(face.normal.dot(face.center), 0, "outside is outside")

    def test_the_size_of_its_network_is_told(self) -> None:
        """Of two layers between 3 coordinates and 1 value; what is damaged has none to tell."""
        group = add("SPHERE").neural_sculpt
        weights, header_of = group.base_weights, module("blender.scene.field_header").header_of
        first, second = header_of(bpy.context.active_object).widths
        numbers = 4 * first + (first + 1) * second + second + 1
        head = 8 + int.from_bytes(weights[:8], "little")
        self.assertEqual(len(weights) - head, 4 * numbers)
        endless = b'{"detail": {"shape": [1e999]}, "layers.0.bias": {"shape": [1]}}'
        long = b"{%s}" % b" ".ljust(1 << 20)
        for damaged in (
            *(b"", weights[:7], weights[:head], b"\xff" * 99),
            *(len(text).to_bytes(8, "little") + text for text in (b"[]", endless, long)),
        ):
            group.base_weights, group.base_id = damaged, ""
            found = header_of(bpy.context.active_object).widths
            self.assertIn(found, ((), (first, second)))

    def test_every_primitive(self) -> None:
        for kind in module("blender.operators.fields.add").PRIMITIVES:
            ob = add(kind)
            self.assertLess(np.abs(vertices(ob)).max(), 0.9, kind)
            self.assertGreater(np.ptp(vertices(ob), axis=0).max(), 0.8, kind)

    def test_undo_takes_it_away_and_redo_brings_it_back(self) -> None:
        before = state(add())
        undo()
        self.assertEqual(len(bpy.data.objects), 0)
        redo()
        self.assertEqual(state(field("Sphere")), before)


class Drawn(SculptCase):
    """A sphere, and a path over its top."""

    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")
        self.size = float(np.linalg.norm(vertices(self.ob), axis=1).mean())
        self.path = arc(self.ob)

    def stroke(self, path: np.ndarray, **given: object) -> None:
        result = stroke(path, **{"radius": RADIUS, "intensity": INTENSITY, **given})
        self.assertEqual(result, {"FINISHED"})

    def heights(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the vertices over the old sphere, and their distances from the stroke."""
        points = vertices(self.ob)
        size = np.linalg.norm(points, axis=1)
        return size - self.size, to_path(points / size[:, None] * self.size, self.path)


class FinalStroke(Drawn):
    def test_raises_the_surface_under_it_and_nowhere_else(self) -> None:
        self.stroke(self.path, name="Ridge")
        height, distance = self.heights()
        ridge, far = height[distance < 0.15 * RADIUS], height[distance > 1.6 * RADIUS]
        self.assertGreater(len(ridge), 5)
        self.assertAlmostEqual(float(np.median(ridge)), INTENSITY, delta=0.25 * INTENSITY)
        self.assertLess(float(np.abs(far).mean()), 0.1 * INTENSITY)
        (kept,) = strokes_of(self.ob)
        self.assertEqual(kept["name"], "Ridge")
        self.assertEqual(kept["radius"], np.float32(RADIUS))
        np.testing.assert_allclose(kept["points"], self.path, atol=1e-6)

    def test_its_report_follows(self) -> None:
        with self.as_in_a_window():
            self.stroke(self.path)
            self.finish()
            self.pump(lambda: self.session.behind is None)
        report = json.loads(self.ob.neural_sculpt.report)
        self.assertLess(report["tube_mean"], 0.25 * INTENSITY)


class Stroke(Drawn):
    def setUp(self) -> None:
        super().setUp()

    def test_negative_intensity_carves(self) -> None:
        self.stroke(self.path, intensity=-INTENSITY)
        height, distance = self.heights()
        self.assertLess(float(np.median(height[distance < 0.15 * RADIUS])), -0.6 * INTENSITY)

    def test_undo_and_redo_are_exact_between_native_steps(self) -> None:
        states = [state(self.ob)]
        self.stroke(self.path)
        states.append(state(field("Sphere")))
        field("Sphere").location.x += 2.0
        bpy.context.view_layer.update()
        push_undo("Move")
        states.append(state(field("Sphere")))
        self.stroke(arc(self.ob, tilt=1.2), intensity=-INTENSITY)
        states.append(state(field("Sphere")))
        self.assertEqual(len(set(states)), 4)
        self.undo_and_redo(states, lambda: state(field("Sphere")))

    def test_survives_save_and_load_and_goes_on(self) -> None:
        self.stroke(self.path)
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION, refine=False)
        before = state(self.ob)
        path = str(self.folder / "field.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(state(field("Sphere")), before)
        bpy.ops.neural_sculpt.remesh(resolution=RESOLUTION, refine=False)
        ob = field("Sphere")
        self.assertEqual(state(ob)[:5], before[:5], "base and layer give the same proxy")
        proxy = np.frombuffer(before[5], np.float32).reshape(-1, 3)
        np.testing.assert_allclose(vertices(ob), proxy, atol=5e-3)

    def test_append(self) -> None:
        self.stroke(self.path)
        before = state(self.ob)
        path, library = str(self.folder / "field.blend"), str(self.folder / "library.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        shutil.copy(path, library)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        with bpy.data.libraries.load(library) as (_, wanted):
            wanted.objects = ["Sphere"]
        bpy.context.collection.objects.link(wanted.objects[0])
        bpy.context.view_layer.objects.active = wanted.objects[0]
        bpy.context.view_layer.update()
        self.assertEqual(state(field("Sphere")), before)
        self.stroke(arc(field("Sphere"), tilt=1.2))
        self.assertEqual(len(strokes_of(field("Sphere"))), 2)

    def test_a_linked_field_is_refused(self) -> None:
        path, library = str(self.folder / "field.blend"), str(self.folder / "library.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        shutil.copy(path, library)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        with bpy.data.libraries.load(library, link=True) as (_, wanted):
            wanted.objects = ["Sphere"]
        bpy.context.collection.objects.link(wanted.objects[0])
        bpy.context.view_layer.objects.active = wanted.objects[0]
        with self.assertRaisesRegex(RuntimeError, "linked"):
            self.stroke(self.path)

    def test_copies_part_ways(self) -> None:
        """A full copy and one that shares the mesh: a stroke changes the active object alone."""
        full, sharing = self.ob.copy(), self.ob.copy()
        full.data = self.ob.data.copy()
        for copy in (full, sharing):
            bpy.context.collection.objects.link(copy)
        others = [state(full), state(sharing)]
        self.stroke(self.path)
        self.assertEqual([state(full), state(sharing)], others)
        self.assertEqual(len(strokes_of(self.ob)), 1)
        self.assertNotEqual(vertices(self.ob).tobytes(), vertices(full).tobytes())

    def test_two_fields(self) -> None:
        first = state(self.ob)
        torus = add("TORUS")
        second = state(torus)
        bpy.context.view_layer.objects.active = self.ob
        self.stroke(self.path)
        self.assertNotEqual(state(self.ob), first)
        self.assertEqual(state(torus), second)

    def test_a_renamed_object_and_another_scene(self) -> None:
        with self.as_in_a_window():
            self.stroke(self.path)
            self.ob.name = "Planet"
            bpy.ops.scene.new(type="EMPTY")
            self.finish()
        self.assertEqual(len(strokes_of(field("Planet"))), 1)

    def test_a_stroke_file_is_one_step(self) -> None:
        path = arc(self.ob, tilt=1.2).tolist()
        shape = {"radius": RADIUS, "intensity": INTENSITY, "modulation": {"name": "central"}}
        strokes = [
            {"points": self.path.tolist(), "name": "One", **shape},
            {
                "points": path,
                "name": "Two",
                **shape,
                "profile": {"points": [[-1, 0], [0, 1], [1, 0]]},
            },
        ]
        before = state(self.ob)
        bpy.ops.neural_sculpt.stroke(stroke_json=json.dumps({"version": 1, "strokes": strokes}))
        self.assertEqual([kept["name"] for kept in strokes_of(self.ob)], ["One", "Two"])
        undo()
        self.assertEqual(state(field("Sphere")), before)

    def test_brush_of_the_scene_and_pressure(self) -> None:
        brush = brush_settings()
        brush.radius, brush.intensity = 0.2, -0.03
        brush.profile, brush.modulation = "CURVE", "LINEAR"
        points = [
            {"name": "", "location": p, "radius_factor": 1.0, "intensity_factor": f}
            for p, f in zip(self.path.tolist(), np.linspace(0.2, 1, 9).tolist(), strict=True)
        ]
        bpy.ops.neural_sculpt.stroke(points=points)
        (kept,) = strokes_of(self.ob)
        self.assertAlmostEqual(kept["radius"], 0.2, places=6)
        self.assertAlmostEqual(kept["intensity"], -0.03, places=6)
        self.assertEqual(len(kept["profile"]["table"]), 257)
        self.assertEqual(kept["modulation"], {"name": "linear"})
        np.testing.assert_allclose(kept["intensity_factors"], np.linspace(0.2, 1, 9), atol=1e-6)
        self.assertNotIn("radius_factors", kept)

    def test_remesh_changes_the_proxy_alone(self) -> None:
        before, count = state(self.ob), len(vertices(self.ob))
        bpy.ops.neural_sculpt.remesh(resolution=2 * RESOLUTION)
        self.assertGreater(len(vertices(self.ob)), 3 * count)
        self.assertEqual(state(self.ob)[:5], before[:5])
        self.assertEqual(self.ob.neural_sculpt.resolution, 2 * RESOLUTION)
        undo()
        self.assertEqual(state(field("Sphere")), before)

    def test_scene_units(self) -> None:
        brush = brush_settings()
        self.ob.scale = (2.0, 2.0, 2.0)
        bpy.context.view_layer.update()
        brush.radius = 0.1
        self.assertAlmostEqual(brush.scene_radius, 0.2, places=6)
        brush.scene_intensity = 0.1
        self.assertAlmostEqual(brush.intensity, 0.05, places=6)
