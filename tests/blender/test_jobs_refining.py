# SPDX-License-Identifier: GPL-3.0-or-later
"""Between a stroke's quick result and its final one: everything that an artist may do meanwhile."""

import os

import bpy
import numpy as np
from bpy.types import Object
from harness import SteeredCase, field, push_undo, redo, state, stroke, undo, vertices


class Refining(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        self.before = state(self.ob)

    def quick_stroke(self, name: str = "One") -> tuple[object, ...]:
        """Draw a stroke; its quick result."""
        stroke(np.eye(3), name=name)
        self.until_quick()
        return state(field("Sphere"))

    def final_of(self, quick: tuple[object, ...], ob: Object | None = None) -> tuple[object, ...]:
        """Let the worker finish; what the object is then, which was `quick`."""
        self.finish()
        self.assertEqual(self.session.last_error, "")
        final = state(ob or field("Sphere"))
        self.assertNotEqual(final[0], quick[0], "the weights are refined")
        self.assertNotEqual(final[3], quick[3], "the revision tells them apart")
        self.assertEqual(final[1:3], quick[1:3], "base and strokes stay")
        return final

    def test_the_final_result_is_no_undo_step(self) -> None:
        quick = self.quick_stroke()
        self.assertEqual([item.name for item in field("Sphere").neural_sculpt.strokes], ["One"])
        final = self.final_of(quick)
        undo()
        self.assertEqual(state(field("Sphere")), self.before)
        redo()
        self.assertEqual(state(field("Sphere")), final)

    def test_undone_meanwhile_it_comes_back_refined(self) -> None:
        quick = self.quick_stroke()
        undo()
        self.assertEqual(state(field("Sphere")), self.before)
        self.finish()
        self.assertEqual(state(field("Sphere")), self.before)
        redo()
        self.final_of(quick)

    def test_cancelled_the_quick_result_stays(self) -> None:
        quick = self.quick_stroke()
        bpy.ops.neural_sculpt.cancel()
        self.assertFalse(self.session.jobs)
        self.finish()
        self.assertEqual(state(field("Sphere")), quick)
        undo()
        redo()
        self.assertEqual(state(field("Sphere")), quick)

    def test_the_next_stroke_does_not_wait(self) -> None:
        first = self.quick_stroke()
        stroke(np.eye(3), name="Two")
        self.assertEqual([job.label for job in self.session.jobs], ["Two"])
        self.until_quick()
        second = state(field("Sphere"))
        self.final_of(second)
        undo()
        self.assertEqual(state(field("Sphere")), first)
        undo()
        self.assertEqual(state(field("Sphere")), self.before)

    def test_a_stroke_that_waits_ends_the_refinement(self) -> None:
        stroke(np.eye(3), name="One")
        stroke(np.eye(3), name="Two")
        self.until_quick()
        self.assertEqual([job.label for job in self.session.jobs], ["Two"])
        self.assertEqual(len(field("Sphere").neural_sculpt.strokes), 2)

    def test_a_new_proxy_waits_for_the_final_result(self) -> None:
        quick = self.quick_stroke()
        bpy.ops.neural_sculpt.remesh(resolution=32)
        self.finish()
        remeshed = self.final_of(quick)
        self.assertEqual(field("Sphere").neural_sculpt.resolution, 32)
        undo()
        final = state(field("Sphere"))
        self.assertEqual(final[:5], remeshed[:5])
        self.assertNotEqual(final[5], remeshed[5])
        redo()
        self.assertEqual(state(field("Sphere")), remeshed)

    def test_an_export_waits_for_the_final_result(self) -> None:
        path = self.folder / "field.safetensors"
        quick = self.quick_stroke()
        bpy.ops.neural_sculpt.export(filepath=str(path))
        self.final_of(quick)
        self.assertEqual(path.read_bytes(), field("Sphere").neural_sculpt.weights)

    def test_the_worker_is_killed(self) -> None:
        quick = self.quick_stroke()
        os.kill(self.session.client.pid, 9)
        self.pump(lambda: self.session.last_error != "")
        self.assertIn("One keeps its quick result. The worker stopped", self.session.last_error)
        self.assertEqual(state(field("Sphere")), quick)
        self.final_of(self.quick_stroke("Two"))

    def test_every_copy_is_refined(self) -> None:
        quick = self.quick_stroke()
        ob = field("Sphere")
        full = ob.copy()
        full.data = ob.data.copy()
        other = bpy.data.scenes.new("Other")
        other.collection.objects.link(full)
        ob.name = "Renamed"
        bpy.context.window.scene = other
        final = self.final_of(quick, field("Renamed"))
        self.assertEqual(state(full), final)

    def test_deleted_and_brought_back(self) -> None:
        quick = self.quick_stroke()
        bpy.data.objects.remove(field("Sphere"))
        push_undo("Delete")
        self.finish()
        undo()
        self.final_of(quick)
        redo()
        self.assertNotIn("Sphere", bpy.data.objects)

    def test_saved_meanwhile(self) -> None:
        path = str(self.folder / "field.blend")
        quick = self.quick_stroke()
        bpy.ops.wm.save_as_mainfile(filepath=path)
        self.final_of(quick)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(state(field("Sphere")), quick)
        push_undo("Loaded")
        bpy.context.view_layer.objects.active = field("Sphere")
        self.final_of(self.quick_stroke("Two"))

    def test_another_file_is_opened(self) -> None:
        self.quick_stroke()
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.assertFalse(self.session.jobs)
        self.finish()
        self.assertEqual(len(bpy.data.objects), 0)

    def test_in_edit_mode_the_quick_result_stays(self) -> None:
        quick = self.quick_stroke()
        bpy.ops.object.mode_set(mode="EDIT")
        self.finish()
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertEqual(state(field("Sphere")), quick)

    def test_what_was_done_to_the_mesh_by_hand_stays(self) -> None:
        quick = self.quick_stroke()
        field("Sphere").data.vertices[0].co.x += 0.1
        push_undo("By hand")
        by_hand = vertices(field("Sphere"))
        self.finish()
        np.testing.assert_array_equal(vertices(field("Sphere")), by_hand)
        self.assertEqual(state(field("Sphere"))[:5], quick[:5])
        undo()
        self.final_of(quick)
        redo()
        np.testing.assert_array_equal(vertices(field("Sphere")), by_hand)
        self.assertEqual(state(field("Sphere"))[1:3], quick[1:3])
