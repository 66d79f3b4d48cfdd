# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush and its curve widgets: what they show is what the stroke gets."""

import bpy
import numpy as np
from harness import SculptCase, add, arc, module, push_undo, redo, stroke, undo

PROFILE = [(-1.0, 0.0), (-0.6, -0.25), (0.0, 1.0), (0.6, -0.25), (1.0, 0.0)]


class Curves(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.store = module("blender.presets.curve_store")

    @property
    def brush(self) -> bpy.types.PropertyGroup:
        return bpy.context.scene.neural_sculpt

    def current(self) -> object:
        return module("blender.scene.brush").current_brush(bpy.context)

    def choose_curves(self) -> None:
        self.brush.profile = self.brush.modulation = "CURVE"

    def test_named_brush(self) -> None:
        self.brush.profile, self.brush.modulation = "CUBIC", "INVERSE_CENTRAL"
        self.brush.radius, self.brush.intensity = 0.25, -0.125
        brush = self.current()
        self.assertEqual((brush.profile.name, brush.modulation.name), ("cubic", "inverse_central"))
        self.assertEqual((brush.radius, brush.intensity), (0.25, -0.125))

    def test_every_shape_of_the_stroke_room_can_be_chosen(self) -> None:
        profile, modulation = module("stroke.profile"), module("stroke.modulation")
        for word, shape in (("profile", profile.Profile), ("modulation", modulation.Modulation)):
            for name in shape.FORMULAS:
                setattr(self.brush, word, name.upper())
                self.assertEqual(getattr(self.current(), word).name, name)

    def test_choosing_the_curve_makes_it_once(self) -> None:
        self.assertIsNone(self.brush.curves)
        self.choose_curves()
        tree = self.brush.curves
        self.brush.profile = "LINEAR"
        self.brush.profile = "CURVE"
        self.assertEqual(self.brush.curves, tree)
        self.assertEqual(len(bpy.data.node_groups), 1)

    def test_table_is_what_the_widget_shows(self) -> None:
        self.choose_curves()
        self.store.set_curve(self.brush.curves, "profile", PROFILE)
        self.store.set_curve(self.brush.curves, "modulation", [(0.0, 0.25), (1.0, 0.75)])
        brush = self.current()
        x, y = np.array(PROFILE).T
        np.testing.assert_allclose(brush.profile(x), y, atol=0.01)
        widget = self.store.mapping(self.brush.curves, "profile")
        for v in np.linspace(-1, 1, 41):
            shown = widget.evaluate(widget.curves[0], v)
            self.assertAlmostEqual(float(brush.profile(v)), shown, delta=2e-3)
        u = np.linspace(0, 1, 11)
        np.testing.assert_allclose(brush.modulation(u), 0.25 + 0.5 * u, atol=2e-3)

    def test_overshoot_is_clipped(self) -> None:
        self.choose_curves()
        self.store.set_curve(self.brush.curves, "profile", [(-1, 1), (-0.1, 1), (0.1, -1), (1, -1)])
        for point in self.store.mapping(self.brush.curves, "profile").curves[0].points:
            point.handle_type = "AUTO"
        self.store.mapping(self.brush.curves, "profile").update()
        self.assertLessEqual(max(map(abs, self.current().profile.table)), 1.0)

    def test_undo_and_reload_keep_the_curve(self) -> None:
        self.choose_curves()
        self.store.set_curve(self.brush.curves, "profile", PROFILE)
        push_undo("Curve")
        before = self.current()
        self.store.set_curve(self.brush.curves, "profile", [(-1, 0), (1, 1)])
        push_undo("Other curve")
        undo()
        self.assertEqual(self.current(), before)
        path = str(self.folder / "curves.blend")
        bpy.ops.outliner.orphans_purge(do_recursive=True)
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(self.current(), before)

    def test_curves_made_outside_an_undo_step_do_not_dangle(self) -> None:
        for name in ("One", "Two"):
            bpy.data.objects.new(name, None)
            push_undo(name)
        self.choose_curves()
        for step in (undo, redo, undo, redo):
            step()
            self.assertIn(self.brush.curves, [None, *bpy.data.node_groups])
            self.assertEqual(len(self.current().profile.table), 257)

    def test_curves_follow_undo_and_redo(self) -> None:
        push_undo("Before")
        self.assertEqual(bpy.ops.neural_sculpt.make_curves(), {"FINISHED"})
        self.assertIsNotNone(self.brush.curves)
        self.store.set_curve(self.brush.curves, "profile", PROFILE)
        push_undo("Shape")
        bpy.data.objects.new("One", None)
        push_undo("One")
        shaped = self.store.table(self.brush.curves, "profile")
        undo()
        self.assertEqual(self.store.table(self.brush.curves, "profile"), shaped)
        undo()
        self.assertNotEqual(self.store.table(self.brush.curves, "profile"), shaped)
        undo()
        self.assertIsNone(self.brush.curves)
        redo()
        redo()
        redo()
        self.assertEqual(self.store.table(self.brush.curves, "profile"), shaped)

    def test_editing_a_stroke_makes_no_curves_by_itself(self) -> None:
        scene = bpy.context.scene
        ob = add("SPHERE")
        self.assertIsNotNone(scene.neural_sculpt.curves, "a new field's undo step has them")
        stroke(arc(ob), radius=0.1, intensity=0.03)
        scene.neural_sculpt.curves = None
        bpy.data.node_groups.remove(bpy.data.node_groups[0])
        push_undo("As in an old file")
        self.assertEqual(bpy.ops.neural_sculpt.edit_stroke(profile="CURVE"), {"FINISHED"})
        self.assertEqual(len(bpy.data.node_groups), 0)
        undo()
        redo()

    def test_a_copied_scene_has_curves_of_its_own(self) -> None:
        self.choose_curves()
        self.store.set_curve(self.brush.curves, "profile", PROFILE)
        first, before = bpy.context.scene, self.current()
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            bpy.ops.scene.new(type="FULL_COPY")
        bpy.ops.mesh.primitive_cube_add()  # any update; a window updates what it shows
        bpy.context.view_layer.update()
        self.assertNotEqual(bpy.context.scene, first)
        self.assertEqual(self.current(), before)
        self.store.set_curve(self.brush.curves, "profile", [(-1, 0), (1, 1)])
        bpy.context.window_manager.windows[0].scene = first
        self.assertEqual(self.current(), before)
