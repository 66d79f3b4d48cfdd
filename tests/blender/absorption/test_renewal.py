# SPDX-License-Identifier: GPL-3.0-or-later
"""A stroke that stretches the proxy, or leaves it off the field, keeps its step and its vertices;
the field's own proxy comes when the artist rests, and no press of Ctrl Z is about that alone."""

from collections.abc import Callable
from unittest.mock import patch

import bpy
import numpy as np
from harness import arc, module, push_undo, redo, state, stroke, undo, vertices
from mathutils.bvhtree import BVHTree
from test_live_absorption import BrushCase, brush

sculpt_steps = module("blender.scene.sculpt_steps")
go_on = module("blender.session.absorption.renewal").go_on
SPARE = module("blender.scene.mesh.spare_mesh").SPARE


class Renewal(BrushCase):
    def setUp(self) -> None:
        if not module("blender.scene.kept_steps").EXACT:
            self.skipTest("this Blender rounds what it takes back")
        super().setUp()
        self.enterContext(self.as_in_a_window())
        self.enterContext(patch.object(self.results, "SEEN_OFF", 0.0))  # every stroke is off
        self.enterContext(patch.multiple(module("blender.scene.next_proxy"), SECONDS=-1.0, LARGE=0))

    def absorb(self, name: str, right: float, apart: float = 8.0) -> np.ndarray:
        """Brush, and let the field have it; the vertices as they were brushed."""
        brush(name, right, apart)
        sculpted = vertices(self.ob())
        self.look()
        self.finish()
        return sculpted

    def look_again(self, step: Callable[[], None]) -> tuple[object, ...]:
        step()
        return state(self.ob())

    def test_the_stroke_keeps_its_step_and_the_rest_brings_the_fields_proxy(self) -> None:
        before, first = state(self.ob()), sculpt_steps.active()
        sculpted = self.absorb("Clay", 0)
        np.testing.assert_array_equal(vertices(self.ob()), sculpted)
        self.assertEqual(self.names(), ["Clay"])
        active = sculpt_steps.active()
        self.assertTrue(sculpt_steps.is_native(active))
        revision = self.ob().neural_sculpt.revision
        self.rest()
        self.assertEqual(self.ob().neural_sculpt.revision, revision)
        self.assertFalse(self.edited())
        renewed = state(self.ob())
        self.assertFalse(np.array_equal(vertices(self.ob()), sculpted))
        points = vertices(self.ob()).tolist()
        bpy.ops.neural_sculpt.remesh(resolution=192)  # which is made from nothing
        self.finish()
        corners = module("blender.scene.mesh.proxy_mesh").corners_of(self.ob().data)
        tree = BVHTree.FromPolygons(vertices(self.ob()).tolist(), corners.tolist())
        self.assertLess(max(tree.find_nearest(point)[3] for point in points), 2e-4)
        undo()
        self.assertEqual(state(self.ob()), renewed)
        for _ in range(2):
            self.assertEqual(self.look_again(undo), before)
            self.assertEqual(sculpt_steps.active(), first)
            self.assertEqual(self.look_again(redo), renewed)

    def test_what_the_field_cannot_hold_is_told_and_its_place_is_known(self) -> None:
        """Of a Grab that drags the surface over itself, and of no other."""
        told = self.enterContext(patch.object(module("blender.notice"), "tell"))
        reports = module("blender.session.reports")
        self.absorb("Grab", -30)
        told.assert_not_called()
        report = reports.report_of(self.ob())
        self.assertEqual((reports.notes_of(report), reports.worst_places(report)), ([], []))
        before = vertices(self.ob())
        sculpted = self.absorb("Grab", 30, apart=40.0)
        told.assert_called_once()
        self.assertIn("cannot hold all of Grab", told.call_args.args[0])
        report = reports.report_of(self.ob())
        (note,) = reports.notes_of(report)
        self.assertIn("folds over itself", note)
        self.assertTrue(bpy.ops.neural_sculpt.show_worst.poll())
        moved = sculpted[(sculpted != before).any(axis=1)]
        for place in reports.worst_places(report):
            self.assertLess(np.linalg.norm(moved - place, axis=1).min(), 1e-3)
        self.rest()
        self.assertFalse(np.array_equal(vertices(self.ob()), sculpted))
        self.assertEqual(reports.notes_of(reports.report_of(self.ob())), [note])
        undo()
        self.assertEqual(reports.notes_of(reports.report_of(self.ob())), [])

    def test_it_comes_once(self) -> None:
        self.absorb("Clay", 0)
        self.rest()
        history = sculpt_steps.steps()
        self.rest()
        self.assertEqual(sculpt_steps.steps(), history)

    def test_strokes_upon_it(self) -> None:
        states = [state(self.ob())]
        for name, right in (("Clay", -30), ("Grab", 10), ("Clay", 30)):
            self.absorb(name, right)
            self.rest()
            states.append(state(self.ob()))
        self.assertEqual(len(self.names()), 3)
        self.undo_and_redo(states, lambda: state(self.ob()))
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03, name="Neural")
        self.finish()
        states.append(state(self.ob()))
        self.undo_and_redo(states, lambda: state(self.ob()))

    def test_it_cuts_off_nothing_that_can_be_redone(self) -> None:
        self.absorb("Clay", -30)
        once = state(self.ob())
        self.absorb("Grab", 30)
        twice = state(self.ob())
        undo()
        self.rest()
        self.assertEqual(state(self.ob()), once)
        redo()
        self.assertEqual(state(self.ob()), twice)
        self.rest()
        self.assertNotEqual(state(self.ob()), twice)

    def test_a_mode_that_was_left_and_what_brushes_did_since(self) -> None:
        before = state(self.ob())
        self.absorb("Clay", 0)
        brush("Clay", 60)  # nobody has looked
        sculpted = vertices(self.ob())
        self.rest()
        np.testing.assert_array_equal(vertices(self.ob()), sculpted)
        self.look()
        self.finish()
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="OBJECT")
        self.rest()
        self.assertFalse(self.edited())
        renewed = state(self.ob())
        self.ob().location.x = 1.0
        push_undo("Move")
        self.assertEqual(self.look_again(undo), renewed)
        undo()
        self.assertEqual(self.ob().mode, "SCULPT")
        np.testing.assert_array_equal(vertices(self.ob()), sculpted)
        undo()
        self.assertEqual(self.look_again(undo), before)
        for _ in range(3):
            redo()
        self.assertEqual(self.ob().mode, "OBJECT")
        self.assertEqual(state(self.ob()), renewed)

    def test_masks_stay(self) -> None:
        brush("Mask", 60)
        self.look()
        self.absorb("Clay", -20)
        masked = self.masked()
        self.assertGreater(len(masked), 10)
        self.rest()
        self.assertLess(farthest(masked, self.masked()), 1e-5)

    def test_what_hangs_on_the_mesh_stays_and_nothing_is_left_over(self) -> None:
        ob, mesh = self.ob(), self.ob().data
        mesh.name, mesh["number"] = "Head", 7
        mesh.materials.append(bpy.data.materials.new("Clay"))
        ob.vertex_groups.new(name="All").add(range(len(mesh.vertices)), 0.5, "REPLACE")
        color = mesh.color_attributes.new("Color", "BYTE_COLOR", "CORNER")
        color.data.foreach_set("color", np.ones(4 * len(mesh.loops), np.float32))
        driver = ob.driver_add("location", 0).driver
        target = driver.variables.new().targets[0]
        target.id_type, target.id, target.data_path = "MESH", mesh, '["number"]'
        push_undo("Dress")
        self.look()
        meshes = len(bpy.data.meshes)
        before = len(mesh.vertices)
        self.absorb("Grab", 0)
        self.rest()
        ob, mesh = self.ob(), self.ob().data
        self.assertNotEqual(len(mesh.vertices), before)
        self.assertEqual((mesh.name, mesh["number"], mesh.users), ("Head", 7, 1))
        self.assertEqual([each.name for each in mesh.materials], ["Clay"])
        self.assertEqual(ob.animation_data.drivers[0].driver.variables[0].targets[0].id, mesh)
        self.assertEqual([group.name for group in ob.vertex_groups], ["All"])
        self.assertTrue(all(vertex.groups[0].weight == 0.5 for vertex in mesh.vertices))
        self.assertEqual(mesh.color_attributes["Color"].data_type, "BYTE_COLOR")
        colors = np.empty(4 * len(mesh.loops), np.float32)
        mesh.color_attributes["Color"].data.foreach_get("color", colors)
        self.assertTrue((colors == 1).all())
        self.assertEqual(len(bpy.data.meshes), meshes)

    def half_way(self) -> int:
        """Absorb a stroke, and begin with another proxy; how many meshes there were before."""
        meshes = len(bpy.data.meshes)
        self.absorb("Clay", -60)
        self.pump(lambda: go_on() is not None and len(bpy.data.meshes) > meshes)
        return meshes

    def test_what_is_painted_between_two_pieces(self) -> None:
        meshes = self.half_way()
        brush("Mask", 60)
        masked = self.masked()  # vertices, some of which Clay had moved off the field
        self.assertGreater(len(masked), 10)
        self.look()
        self.rest()
        self.assertNotIn(module("blender.scene.mesh.proxy_mesh").STRETCHED, self.ob().data)
        self.assertLess(farthest(masked, self.masked()), 5e-3)  # a third of the way between two
        self.assertEqual(len(bpy.data.meshes), meshes)

    def test_a_stroke_between_two_pieces(self) -> None:
        meshes = self.half_way()
        self.absorb("Clay", 60)
        self.rest()
        self.assertEqual(self.names(), ["Clay", "Clay"])
        self.assertEqual(len(bpy.data.meshes), meshes)

    def test_undo_between_two_pieces(self) -> None:
        before = state(self.ob())
        meshes = self.half_way()
        self.assertEqual(self.look_again(undo), before)
        self.rest()
        self.assertEqual(state(self.ob()), before)
        self.assertEqual(len(bpy.data.meshes), meshes)

    def test_a_file_that_is_saved_between_two_pieces(self) -> None:
        """It has the proxy and no other mesh, and is as good as any."""
        before = state(self.ob())
        meshes = self.half_way()
        absorbed = vertices(self.ob())
        path = str(self.folder / "saved.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
        with bpy.data.libraries.load(path) as (held, _):
            self.assertEqual(len(held.meshes), meshes)
        self.rest()
        self.assertEqual(self.look_again(undo), before)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(len(bpy.data.meshes), meshes)
        self.assertEqual(self.names(), ["Clay"])
        self.assertFalse(self.edited())
        np.testing.assert_array_equal(vertices(self.ob()), absorbed)

    def test_steps_that_are_pushed_between_two_pieces(self) -> None:
        """Undo and redo to them leave no mesh over."""
        meshes = self.half_way()
        for x in (1.0, 2.0):
            self.ob().location.x = x
            push_undo("Move")
            self.assertGreater(len(bpy.data.meshes), meshes)
        for step in (undo, redo, undo, undo, redo, redo):
            step()
            self.assertEqual(len(bpy.data.meshes), meshes)
            self.assertNotIn(SPARE, self.ob().data)
        self.rest()
        renewed = state(self.ob())
        undo()
        self.assertEqual(self.look_again(redo), renewed)
        self.assertEqual(len(bpy.data.meshes), meshes)
        self.assertNotIn(SPARE, self.ob().data)

    def masked(self) -> np.ndarray:
        """The vertices that are masked."""
        mask = module("blender.scene.mesh.brush_attributes").read(self.ob().data)[".sculpt_mask"]
        return vertices(self.ob())[mask > 0.2]


def farthest(points: np.ndarray, others: np.ndarray) -> float:
    """The longest way from one of some points (N, 3) to the nearest of others (M, 3)."""
    order = np.argsort(others[:, 0])
    most = 0.0
    for point in points:
        low, high = np.searchsorted(others[order, 0], (point[0] - 0.01, point[0] + 0.01))
        near = others[order[low:high]]
        most = max(most, float(np.linalg.norm(near - point, axis=1).min(initial=1.0)))
    return most
