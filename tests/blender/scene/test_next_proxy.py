# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy of a result, made ready piece by piece in a window, and what may come between two."""

from collections.abc import Callable
from unittest.mock import patch

import bpy
import numpy as np
from harness import SphereCase, module, push_undo, redo, state, stroke, undo, vertices

SPARE = module("blender.scene.mesh.spare_mesh").SPARE


class NextProxy(SphereCase):
    def setUp(self) -> None:
        super().setUp()
        next_proxy = module("blender.scene.next_proxy")
        self.enterContext(patch.multiple(next_proxy, LARGE=0, SECONDS=-1.0))  # a piece in each poll
        self.shown = self.enterContext(patch.object(next_proxy, "show", wraps=next_proxy.show))

    def sculpt(self) -> None:
        stroke(self.line)
        self.finish()

    def begin(self, change: Callable[[], object]) -> None:
        """Ask for a change, and begin with the mesh that it brings."""
        change()
        self.pump(self.spares)

    def spares(self) -> list[str]:
        return [mesh.name for mesh in bpy.data.meshes if SPARE in mesh]

    def remesh(self) -> None:
        bpy.ops.neural_sculpt.remesh(resolution=64)

    def check_clean(self) -> None:
        """One mesh, that of the field, under its own name."""
        self.assertEqual(self.spares(), [])
        self.assertEqual([mesh.name for mesh in bpy.data.meshes if mesh.users], ["Sphere"])
        self.assertNotIn(SPARE, self.ob().data)

    def test_strokes_are_as_without_it_and_each_is_one_step(self) -> None:
        """Bit for bit what a script gets, in both modes; and undone and redone."""
        before = vertices(self.ob())
        self.sculpt()
        expected = vertices(self.ob())
        normals = module("blender.scene.mesh.proxy_mesh").normals_of
        turned = normals(self.ob().data)
        self.assertEqual([call.args[0].name for call in self.shown.call_args_list], ["Sphere"])
        undo()
        for mode in ("OBJECT", "SCULPT"):
            with self.subTest(mode=mode), self.as_in_a_window():
                bpy.ops.object.mode_set(mode=mode)
                push_undo(mode)
                ours = self.ob().data.session_uid
                self.sculpt()
                self.assertNotEqual(self.ob().data.session_uid, ours)  # it was made ahead
                np.testing.assert_array_equal(vertices(self.ob()), expected)
                if turned is not None:
                    np.testing.assert_array_equal(normals(self.ob().data), turned)
                self.check_clean()
                after = state(self.ob())
                undo()
                np.testing.assert_array_equal(vertices(self.ob()), before)
                redo()
                self.assertEqual(state(self.ob()), after)
                undo()
                self.check_clean()

    def test_what_is_cancelled_leaves_nothing(self) -> None:
        before = state(self.ob())
        with self.as_in_a_window():
            self.begin(self.remesh)
            self.session.cancel()
        self.check_clean()
        self.assertEqual(state(self.ob()), before)

    def test_what_is_done_between_two_pieces_counts(self) -> None:
        with self.as_in_a_window():
            self.begin(self.remesh)
            group = self.ob().vertex_groups.new(name="All")
            group.add(range(len(self.ob().data.vertices)), 0.25, "REPLACE")
            push_undo("Paint")
            self.finish()
        mesh = self.ob().data
        self.assertEqual({each.groups[0].weight for each in mesh.vertices}, {0.25})
        self.check_clean()

    def test_undo_and_redo_between_two_pieces(self) -> None:
        """The result waits after undo, for it would cut off what can be redone."""
        self.ob().location.x = 1.0
        push_undo("Move")
        with self.as_in_a_window():
            self.begin(self.remesh)
            undo()
            self.assertEqual(self.spares(), [])
            redo()
            self.finish()
        self.assertEqual(self.ob().location.x, 1.0)
        self.assertEqual(self.ob().neural_sculpt.resolution, 64)
        self.check_clean()

    def test_a_mesh_that_another_object_shares_meanwhile_stays_with_it(self) -> None:
        before = vertices(self.ob())
        with self.as_in_a_window():
            self.begin(self.remesh)
            other = bpy.data.objects.new("Other", self.ob().data)
            bpy.context.collection.objects.link(other)
            self.finish()
        np.testing.assert_array_equal(vertices(bpy.data.objects["Other"]), before)
        self.assertNotEqual(len(vertices(self.ob())), len(before))
        self.assertEqual(self.spares(), [])

    def test_a_mesh_that_is_purged_between_two_pieces(self) -> None:
        with self.as_in_a_window():
            self.begin(self.remesh)
            for mesh in [mesh for mesh in bpy.data.meshes if not mesh.users]:
                bpy.data.meshes.remove(mesh)
            self.finish()
        self.assertEqual(self.ob().neural_sculpt.resolution, 64)
        self.check_clean()

    def test_among_many_objects_it_is_filled_as_it_is(self) -> None:
        """Blender would look at the relations of all."""
        for number in range(module("blender.scene.next_proxy").MOST_OBJECTS):
            bpy.data.objects.new(f"Empty {number}", None)
        with self.as_in_a_window():
            ours = self.ob().data.session_uid
            self.remesh()
            self.finish()
        self.assertEqual(self.ob().data.session_uid, ours)
        self.assertEqual(self.ob().neural_sculpt.resolution, 64)

    def test_a_mode_that_is_entered_meanwhile(self) -> None:
        """In Weight Paint brushes refer to the mesh, which is filled as it is there."""
        with self.as_in_a_window():
            self.begin(self.remesh)
            bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
            push_undo("Weight Paint")
            ours = self.ob().data.session_uid
            self.finish()
            self.assertEqual(self.ob().data.session_uid, ours)
            self.assertEqual(self.ob().neural_sculpt.resolution, 64)
        self.check_clean()
