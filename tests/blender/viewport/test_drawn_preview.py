# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface under the pen: it is shown, lets go, and nothing is left of it, whatever Blender does
meanwhile."""

from dataclasses import replace

import bpy
import numpy as np
from geometry import to_path
from harness import field, module, push_undo, state, undo, vertices
from test_preview import LINE, THERE, SquareCase

preview = module("blender.scene.mesh.preview").preview
preview_attributes = module("blender.scene.mesh.preview_attributes")
seen_surface = module("blender.scene.mesh.seen_surface")
Brush = module("stroke.brush").Brush
Kind = module("stroke.stroke").Kind
Profile = module("stroke.profile").Profile
Stroke = module("stroke.stroke").Stroke

BRUSH = Brush(0.15, 0.06, Profile("linear"))


class UnderThePen(SquareCase):
    def setUp(self) -> None:
        super().setUp()
        self.addCleanup(preview.give_up)
        self.stroke = Stroke(np.linspace(LINE[0], LINE[-1], 13), BRUSH)

    def pen(self, count: int = 13) -> bool:
        """The pen has passed so many of the points."""
        shown = preview.draw(
            field("Sphere"), replace(self.stroke, points=self.stroke.points[:count])
        )
        while not preview.catch_up():
            pass
        return shown

    def assert_raised(self, count: int = 13, upon: float = 0.0) -> None:
        """By the profile around the part of the line that was passed."""
        line = self.stroke.points[:count]
        line = np.vstack([line, line[-1:] + np.array(1e-9)])
        height = 0.06 * np.maximum(1 - to_path(self.flat, line) / 0.15, 0)
        np.testing.assert_allclose(self.heights(), height + upon, atol=1e-5)

    def test_it_grows_and_is_given_up(self) -> None:
        for count in (1, 2, 5, 13, 7):
            self.assertTrue(self.pen(count))
            self.assert_raised(count)
        preview.give_up()
        self.assert_gone()

    def test_the_pen_is_on_the_surface_below(self) -> None:
        self.pen()
        point, _ = seen_surface.grid_of(field("Sphere")).cast((0.0, 0.11, 1.0), (0, 0, -1))
        self.assertEqual(point[2], 0.0)
        preview.give_up()
        point, _ = seen_surface.grid_of(field("Sphere")).cast((0.0, 0.11, 1.0), (0, 0, -1))
        self.assertEqual(point[2], 0.0)

    def test_lifted_it_waits_for_its_result_where_it_is(self) -> None:
        self.pen()
        job = module("blender.session.stroke_jobs").edit_job(field("Sphere"), (self.stroke,))
        preview.let_go()
        self.session.submit(job)
        preview.settle()
        self.assert_raised()
        point, _ = seen_surface.grid_of(field("Sphere")).cast((0.0, 0.11, 1.0), (0, 0, -1))
        self.assertAlmostEqual(point[2], 0.06, places=2)
        self.session.cancel()
        self.assert_gone()

    def test_its_mask_is_that_of_the_surface_below(self) -> None:
        """And not of what the pen has raised, which the field knows nothing of."""
        masked = (self.flat[:, 1] < 0.1).astype(np.float32)  # on one side of the line
        mesh = field("Sphere").data
        mesh.attributes.new(".sculpt_mask", "FLOAT", "POINT")
        mesh.attributes[".sculpt_mask"].data.foreach_set("value", masked)
        self.pen()
        self.assertGreater(self.heights().max(), 0.05)
        frozen = module("blender.scene.mesh.protect").protected(field("Sphere"), self.stroke)
        under = to_path(self.flat, LINE) < 0.15
        free = under & (self.flat[:, 1] > 0.15)  # two edges from what is masked
        mask = frozen.mask
        np.testing.assert_array_equal(mask(self.flat[free]), 0)
        np.testing.assert_array_equal(mask(self.flat[under & (masked == 1)]), 1)

    def test_upon_one_that_waits(self) -> None:
        """Which goes and comes back; then its result takes the mesh away, and the pen goes on."""
        self.draw()
        waiting = self.heights()
        self.pen()
        self.assertAlmostEqual(self.heights().max(), 0.12, delta=0.004)
        point, _ = seen_surface.grid_of(field("Sphere")).cast((0.0, 0.11, 1.0), (0, 0, -1))
        self.assertAlmostEqual(point[2], waiting.max(), delta=0.003)
        preview.give_up()
        np.testing.assert_array_equal(self.heights(), waiting)
        self.stroke = replace(self.stroke, points=THERE)
        self.pen()
        self.finish()
        self.assertTrue(preview_attributes.is_previewed(field("Sphere").data))
        preview.give_up()
        self.assertFalse(preview_attributes.is_previewed(field("Sphere").data))
        self.assertFalse(module("blender.scene.mesh.native_edits").edited(field("Sphere")))

    def test_a_waiting_one_is_cancelled_meanwhile(self) -> None:
        self.draw()
        self.pen()
        self.session.cancel()
        self.assert_raised()
        preview.give_up()
        self.assert_gone()

    def test_it_is_in_no_undo_step_of_ours(self) -> None:
        self.pen()
        module("blender.scene.undo_step").push_undo("Ours")
        self.assertEqual(self.heights().max(), 0.0)
        self.pen()
        self.assert_raised()
        undo()
        self.assert_raised()  # the pen is still down
        preview.give_up()
        self.assert_gone()

    def test_undo_and_redo_of_other_things_meanwhile(self) -> None:
        field("Sphere").location.x = 1.0
        push_undo("Move")
        self.pen()
        undo()
        self.assertEqual(field("Sphere").location.x, 0.0)
        self.assert_raised()
        self.pen(5)
        self.assert_raised(5)
        field("Sphere").location.x = 2.0
        push_undo("Move")  # Blender's own step, with the stroke in it
        preview.give_up()
        undo()
        self.assert_gone()

    def test_it_is_not_saved(self) -> None:
        path = str(self.folder / "field.blend")
        self.pen()
        bpy.ops.wm.save_as_mainfile(filepath=path)
        self.assert_raised()
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assert_gone()
        self.assertTrue(self.pen())  # the next stroke on what was loaded
        self.assert_raised()
        preview.give_up()
        self.assert_gone()

    def test_another_mode(self) -> None:
        self.pen()
        bpy.ops.object.mode_set(mode="EDIT")
        preview.refresh()
        self.assertFalse(self.pen())
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assert_gone()
        self.assertTrue(self.pen())
        self.assert_raised()

    def test_what_the_artist_moves_meanwhile_stays_moved(self) -> None:
        self.pen(5)
        moved = vertices(field("Sphere"))
        moved[0, 2] += 0.5
        field("Sphere").data.vertices.foreach_set("co", moved.ravel())
        self.pen(13)
        preview.give_up()
        now = vertices(field("Sphere"))
        self.assertEqual(now[0, 2], 0.5)
        np.testing.assert_array_equal(now[1:], self.flat[1:])

    def test_what_cannot_show_it(self) -> None:
        """Other kinds of strokes, and a mesh that two objects share."""
        ob = field("Sphere")
        self.assertFalse(preview.draw(ob, replace(self.stroke, kind=Kind.SMOOTH)))
        bpy.data.objects.new("Other", ob.data)
        self.assertFalse(self.pen())
        self.assert_gone()

    def test_the_extension_is_disabled_meanwhile(self) -> None:
        self.pen()
        display = module("blender.panels.session_display")
        display.unregister()
        self.addCleanup(display.register)
        self.assert_gone()

    def test_normals_come_back(self) -> None:
        if bpy.app.version < (4, 5, 0):
            self.skipTest("this Blender knows no free normals")
        mesh = field("Sphere").data
        mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        up = np.tile(np.float32((0, 0, 1)), len(self.flat))
        mesh.attributes["custom_normal"].data.foreach_set("vector", up)
        seen = np.empty_like(up)
        self.pen()
        mesh.attributes["custom_normal"].data.foreach_get("vector", seen)
        self.assertLess(seen.reshape(-1, 3)[:, 2].min(), 0.95)
        preview.give_up()
        mesh.attributes["custom_normal"].data.foreach_get("vector", seen)
        np.testing.assert_array_equal(seen, up)
        self.assertEqual(state(field("Sphere")), self.before)
