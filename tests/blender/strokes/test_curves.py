# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush and its curve widgets: what they show is what the stroke gets."""

import bpy
import numpy as np
from harness import SculptCase, brush_settings, long, module, push_undo, redo, undo

PROFILE = [(-1.0, 0.0), (-0.6, -0.25), (0.0, 1.0), (0.6, -0.25), (1.0, 0.0)]


class Curves(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.store = module("blender.presets.curve_store")

    @property
    def brush(self) -> bpy.types.PropertyGroup:
        return brush_settings()

    def current(self) -> object:
        return module("blender.scene.brush.current_brush").current_brush(bpy.context)

    def choose_curves(self) -> None:
        self.brush.profile = self.brush.modulation = "CURVE"

    def test_named_brush(self) -> None:
        self.brush.profile, self.brush.modulation = "CUBIC", "INVERSE_CENTRAL"
        self.brush.radius, self.brush.intensity = 0.25, -0.125
        brush = self.current()
        self.assertEqual((brush.profile.name, brush.modulation.name), ("cubic", "inverse_central"))
        self.assertEqual((brush.radius, brush.intensity), (0.25, -0.125))

    @long
    def test_every_shape_of_the_stroke_room_can_be_chosen(self) -> None:
        profile, modulation = module("stroke.profile"), module("stroke.modulation")
        for word, shape in (("profile", profile.Profile), ("modulation", modulation.Modulation)):
            for name in shape.FORMULAS:
                setattr(self.brush, word, name.upper())
                self.assertEqual(getattr(self.current(), word).name, name)

    def test_table_is_what_the_widget_shows(self) -> None:
        self.choose_curves()
        self.store.set_curve("profile", PROFILE)
        self.store.set_curve("modulation", [(0.0, 0.25), (1.0, 0.75)])
        brush = self.current()
        x, y = np.array(PROFILE).T
        np.testing.assert_allclose(brush.profile(-x), y, atol=0.01)
        widget = self.store.mapping("profile")
        for v in np.linspace(-1, 1, 41):
            shown = widget.evaluate(widget.curves[0], v)
            self.assertAlmostEqual(float(brush.profile(-v)), shown, delta=2e-3)
        u = np.linspace(0, 1, 11)
        np.testing.assert_allclose(brush.modulation(u), 0.25 + 0.5 * u, atol=2e-3)

    def test_overshoot_is_clipped(self) -> None:
        self.choose_curves()
        self.store.set_curve("profile", [(-1, 1), (-0.1, 1), (0.1, -1), (1, -1)])
        for point in self.store.mapping("profile").curves[0].points:
            point.handle_type = "AUTO"
        self.store.mapping("profile").update()
        self.assertLessEqual(max(map(abs, self.current().profile.table)), 1.0)

    def test_reload_keeps_the_brush(self) -> None:
        self.set_brush()
        before = self.current()
        path = str(self.folder / "brush.blend")
        bpy.ops.outliner.orphans_purge(do_recursive=True)
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.assertNotEqual(self.current(), before)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(self.current(), before)

    def test_undo_and_redo_leave_the_brush(self) -> None:
        for name in ("One", "Two"):
            bpy.data.objects.new(name, None)
            push_undo(name)
        first = self.current()
        self.set_brush()
        before = self.current()
        self.assertNotEqual(before, first)
        for step in (undo, undo, redo, redo):
            step()
            self.assertEqual(self.current(), before)

    def test_undo_to_before_there_was_a_brush_leaves_it(self) -> None:
        """The extension was enabled in between."""
        for brush in [brush for brush in bpy.data.brushes if brush.name.startswith(".")]:
            bpy.data.brushes.remove(brush)
        for name in ("One", "Two"):
            bpy.data.objects.new(name, None)
            push_undo(name)
        module("blender.scene.brush.kept_brush").ensure()
        push_undo("Enabled")
        self.set_brush()
        before = self.current()
        for step in (undo, undo, redo, redo):
            step()
            self.assertEqual(self.current(), before)

    def test_the_brush_of_an_older_file_is_taken_over(self) -> None:
        old = bpy.context.scene.neural_sculpt
        old.radius, old.profile, old.modulation, old.ends = 0.3, "CURVE", "CURVE", "FLAT"
        old.curves = bpy.data.node_groups.new(".neural_sculpt_curves", "ShaderNodeTree")
        for name in self.store.BOUNDS:
            node = old.curves.nodes.new("ShaderNodeFloatCurve")
            node.name = name
            node.mapping.clip_min_x = node.mapping.clip_min_y = -1
            node.mapping.curves[0].points[0].location = (self.store.BOUNDS[name][0], 0.25)
            node.mapping.update()
        for brush in [brush for brush in bpy.data.brushes if brush.name.startswith(".")]:
            bpy.data.brushes.remove(brush)
        path = str(self.folder / "old.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.ops.wm.open_mainfile(filepath=path)
        brush = self.current()
        self.assertAlmostEqual(brush.radius, 0.3)
        self.assertEqual(self.brush.ends, "FLAT")
        for table in (brush.profile.table[::-1], brush.modulation.table):
            self.assertAlmostEqual(table[0], 0.25, places=3)
            self.assertAlmostEqual(table[-1], 1.0, places=3)

    def set_brush(self) -> None:
        """Set all that can be seen in a frozen brush."""
        self.choose_curves()
        self.brush.radius, self.brush.intensity = 0.3, -0.2
        self.store.set_curve("profile", PROFILE, ["VECTOR"] * len(PROFILE))
        self.store.set_curve("modulation", [(0.0, 0.25), (1.0, 0.75)])
