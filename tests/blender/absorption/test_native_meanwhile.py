# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist does to the proxy by other means while a stroke waits is never lost, nor is the
stroke, and no preview stays behind."""

import os
import signal

import bmesh
import bpy
import numpy as np
from harness import field, module, push_undo, redo, state, stroke, undo, vertices
from test_preview import SquareCase

preview = module("blender.scene.mesh.preview").preview


class Meanwhile(SquareCase):
    """On the square of the previews."""

    def listed(self) -> list[tuple[str, bool]]:
        return [(item.name, item.muted) for item in field("Sphere").neural_sculpt.strokes]

    def edited(self) -> bool:
        return module("blender.scene.mesh.native_edits").edited(field("Sphere"))

    def pull_in_edit_mode(self) -> None:
        """Move the first vertex, where the stroke is not, and the one in its middle."""
        bm = bmesh.from_edit_mesh(field("Sphere").data)
        bm.verts.ensure_lookup_table()
        for index in (0, self.middle()):
            bm.verts[index].co.z += 0.5
        bmesh.update_edit_mesh(field("Sphere").data)

    def middle(self) -> int:
        return int(np.linalg.norm(self.flat - (0, 0.11, 0), axis=1).argmin())

    def pulled(self) -> np.ndarray:
        points = self.flat.copy()
        points[[0, self.middle()], 2] += 0.5
        return points

    def test_a_native_edit_is_not_overwritten_and_the_stroke_is_kept(self) -> None:
        self.draw()
        points = vertices(field("Sphere"))
        points[[0, self.middle()], 2] += 0.5  # on what is previewed, as a brush does
        field("Sphere").data.vertices.foreach_set("co", points.ravel())
        push_undo("Native Brush")
        self.assertTrue(self.edited())
        self.finish()
        self.assertIn("Absorb takes that into the field", self.session.last_error)
        self.assertIn("One is in the history, muted.", self.session.last_error)
        np.testing.assert_allclose(vertices(field("Sphere")), self.pulled(), atol=1e-6)
        self.assertTrue(self.edited())
        self.assertEqual(self.listed(), [("One", True)])
        undo()
        self.assertEqual(self.listed(), [])

    def test_a_replay_and_a_new_proxy_do_not_overwrite_one_either(self) -> None:
        bpy.ops.neural_sculpt.remesh(resolution=40)
        points = self.pulled()
        field("Sphere").data.vertices.foreach_set("co", points.ravel())
        self.finish()
        self.assertIn("sculpted by other brushes meanwhile", self.session.last_error)
        np.testing.assert_array_equal(vertices(field("Sphere")), points)
        bpy.ops.neural_sculpt.remesh(resolution=40)
        self.finish()
        self.assertFalse(self.edited(), "it was asked for")

    def test_in_edit_mode_the_preview_is_gone_and_the_stroke_comes_afterwards(self) -> None:
        self.draw()
        self.assert_shown()
        bpy.ops.object.mode_set(mode="EDIT")
        self.say("go")
        self.pump(lambda: "this mode" in self.session.jobs[0].message)
        bm = bmesh.from_edit_mesh(field("Sphere").data)
        np.testing.assert_array_equal([v.co[:] for v in bm.verts], self.flat)
        self.assertEqual(self.listed(), [])
        bpy.ops.object.mode_set(mode="OBJECT")
        self.finish()
        self.assertEqual(self.listed(), [("One", False)])

    def test_a_stroke_that_fails_in_edit_mode_is_kept_by_a_step_after_it(self) -> None:
        """Steps of Edit Mode hold the mesh alone, so that undo would have lost it."""
        self.draw()
        bpy.ops.object.mode_set(mode="EDIT")
        for deaths in (1, 2):
            self.pump(lambda: self.session.client is not None and self.session.client.alive)
            os.kill(self.session.client.pid, signal.SIGKILL)
            self.pump(lambda deaths=deaths: self.session.jobs[0].deaths == deaths)
        self.pump(lambda: "this mode" in self.session.jobs[0].message)
        self.assertEqual(self.listed(), [])
        bpy.ops.object.mode_set(mode="OBJECT")
        self.finish()
        self.assertIn("One is in the history, muted.", self.session.last_error)
        self.assertEqual(self.listed(), [("One", True)])
        undo()
        self.assertEqual(self.listed(), [])
        redo()
        self.assertEqual(self.listed(), [("One", True)])

    def test_vertices_moved_in_edit_mode_stay_and_are_a_native_edit(self) -> None:
        self.draw()
        bpy.ops.object.mode_set(mode="EDIT")
        self.say("go")
        self.pump(lambda: "this mode" in self.session.jobs[0].message)
        self.pull_in_edit_mode()
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertTrue(self.edited())
        self.finish()
        self.assertEqual(self.listed(), [("One", True)])
        path = str(self.folder / "field.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        np.testing.assert_allclose(vertices(field("Sphere")), self.pulled(), atol=1e-6)
        self.assertTrue(self.edited())

    def test_vertices_moved_before_the_preview_was_hidden_stay_without_it(self) -> None:
        self.draw()
        bpy.ops.object.mode_set(mode="EDIT")
        self.pull_in_edit_mode()
        bpy.ops.object.mode_set(mode="OBJECT")
        self.session.cancel()
        np.testing.assert_allclose(vertices(field("Sphere")), self.pulled(), atol=1e-6)
        self.assertTrue(self.edited())

    def test_cancelled_in_edit_mode_nothing_stays(self) -> None:
        self.draw()
        bpy.ops.object.mode_set(mode="EDIT")
        self.session.cancel()
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assert_gone()

    def test_a_file_saved_meanwhile_has_the_stroke_muted(self) -> None:
        """And the scene has it once, when its result is there, whether the file could be written or
        not."""
        stroke(np.eye(3), name="One")
        self.finish()
        self.draw("Two")
        before = state(field("Sphere"))
        path = str(self.folder / "field.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
        self.assertEqual(state(field("Sphere")), before)
        with self.assertRaises(RuntimeError):
            bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "no" / "folder.blend"))
        self.assertEqual(state(field("Sphere")), before)
        self.finish()
        self.assertEqual(self.listed(), [("One", False), ("Two", False)])
        undo()
        self.assertEqual(self.listed(), [("One", False)])
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(self.listed(), [("One", False), ("Two", True)])
        bpy.ops.neural_sculpt.mute_stroke(uid=field("Sphere").neural_sculpt.strokes[1].uid)
        self.finish()
        self.assertEqual(self.listed(), [("One", False), ("Two", False)])

    def test_a_linked_duplicate_gets_no_mesh_outside_an_undo_step(self) -> None:
        stroke(np.eye(3), name="One")
        self.finish()
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            bpy.ops.object.duplicate_move_linked(
                OBJECT_OT_duplicate={"linked": True}, TRANSFORM_OT_translate={"value": (2, 0, 0)}
            )
        bpy.context.view_layer.update()
        push_undo("Duplicate Linked")
        field("Sphere.001").location.y = 1.0
        bpy.context.view_layer.update()
        push_undo("Move")
        stroke(np.eye(3), name="Two")
        self.finish()
        for step in (undo, redo, undo, undo, redo, redo):
            step()
            for ob in bpy.data.objects:
                self.assertIn(ob.data, [*bpy.data.meshes])
                self.assertGreater(len(vertices(ob)), 0)
        self.assertEqual(field("Sphere.001").location.y, 1.0)
