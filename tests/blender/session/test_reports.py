# SPDX-License-Identifier: GPL-3.0-or-later
"""Reports of strokes come after their results and belong to their revisions."""

import json

import bpy
import numpy as np
from harness import SteeredCase, field, long, module, redo, stroke, undo
from test_live_absorption import view


class Reports(SteeredCase):
    def stroke(self, name: str) -> None:
        stroke(np.eye(3), name=name)
        self.finish()

    def report(self) -> str:
        """The name of the stroke that the object's report is of."""
        return json.loads(field("Sphere").neural_sculpt.report or "{}").get("stroke", "")

    def measured(self) -> None:
        self.say("measured")
        self.pump(lambda: self.session.behind is None)
        (self.folder / "measured").unlink()

    def test_it_follows_the_result_and_hinders_nothing(self) -> None:
        self.stroke("One")
        self.assertEqual(len(field("Sphere").neural_sculpt.strokes), 1)
        self.assertEqual(self.report(), "")
        self.pump(lambda: self.session.behind.status == "running")
        is_measured_now = module("blender.session.reports").is_measured_now
        self.assertTrue(is_measured_now(field("Sphere")))
        self.assertFalse(self.session.jobs)
        self.assertIsNone(self.session.slow_job())
        self.assertFalse(bpy.ops.neural_sculpt.cancel.poll())
        self.stroke("Two")
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.report(), "")
        self.measured()
        self.assertEqual(self.report(), "Two")
        self.assertFalse(is_measured_now(field("Sphere")))

    def test_undo_and_redo_show_that_of_their_revision(self) -> None:
        for name in ("One", "Two"):
            self.stroke(name)
            self.measured()
        undo()
        self.assertEqual(self.report(), "One")
        undo()
        self.assertEqual(self.report(), "")
        redo()
        self.assertEqual(self.report(), "One")
        redo()
        self.assertEqual(self.report(), "Two")

    def test_what_was_not_measured_is_so_after_undo(self) -> None:
        self.stroke("One")
        self.stroke("Two")
        undo()
        self.measured()
        self.assertEqual(self.report(), "One")

    def test_it_comes_after_what_came_before_it(self) -> None:
        """A job that changes no field cancels the measure; a second one is cancelled itself."""
        self.stroke("One")
        self.pump(lambda: self.session.behind.status == "running")
        bpy.ops.neural_sculpt.remesh(resolution=32)
        self.finish()
        bpy.ops.neural_sculpt.remesh(resolution=64)
        bpy.ops.neural_sculpt.cancel()
        self.measured()
        self.assertEqual(self.report(), "One")

    def test_it_is_saved(self) -> None:
        self.stroke("One")
        self.measured()
        path = str(self.folder / "one.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(self.report(), "One")

    @long
    def test_a_report_that_cannot_be_had_is_no_error(self) -> None:
        self.stroke("One")
        self.pump(lambda: self.session.behind.status == "running")
        self.session.client.stop()
        self.pump(lambda: self.session.behind is None)
        self.assertEqual(self.session.last_error, "")
        self.stroke("Two")
        self.assertEqual(len(field("Sphere").neural_sculpt.strokes), 2)

    def test_nan_in_a_file_is_no_report(self) -> None:
        reports = module("blender.session.reports")
        large = "1" + 400 * "0"  # an integer that is no float
        place = f'{{"untouched_normal_max": 1, "untouched_worst": [0, 0, {large}]}}'
        for text in ('{"mean": NaN}', '{"mean": [-Infinity]}', '{"mean": 1e999}', place):
            field("Sphere").neural_sculpt.report = text
            self.assertEqual(reports.report_of(field("Sphere")), {})
        field("Sphere").neural_sculpt.report = '{"error_mean": 0.5}'
        self.assertEqual(reports.report_of(field("Sphere")), {"error_mean": 0.5})

    def test_the_worst_place_is_shown_until_the_field_changes(self) -> None:
        show, mark = bpy.ops.neural_sculpt.show_worst, module("blender.viewport.worst_place")
        ob = field("Sphere")
        with self.assertRaisesRegex(RuntimeError, "not measured"):
            show()
        ob.neural_sculpt.report = '{"untouched_normal_max": 0.5, "untouched_worst": [0, 1, 2]}'
        self.assertFalse(mark.is_shown(ob))
        for shown in (True, False, True):
            show()
            self.assertEqual(mark.is_shown(ob), shown)
        self.stroke("One")
        self.assertFalse(mark.is_shown(field("Sphere")))

    def test_the_view_stays_where_the_field_is_hidden(self) -> None:
        """Blender has not evaluated it."""
        ob = field("Sphere")
        ob.hide_viewport = True
        bpy.context.view_layer.update()
        camera = view()["area"].spaces.active.region_3d
        before = camera.view_matrix.copy()
        module("blender.viewport.worst_place").face(ob, (0.0, 0.0, 1.0), camera)
        self.assertEqual(camera.view_matrix, before)

    def test_the_worst_places_of_a_fit_are_shown(self) -> None:
        mark = module("blender.viewport.worst_place")
        ob = field("Sphere")
        ob.neural_sculpt.report = '{"error_max": 0.01, "worst": [[0, 1, 0], [0, 0, -1]]}'
        bpy.ops.neural_sculpt.show_worst()
        self.assertTrue(mark.is_shown(ob))
        bpy.ops.neural_sculpt.show_worst()
        self.assertFalse(mark.is_shown(ob))

    def test_a_worst_place_that_is_none(self) -> None:
        worst = module("blender.session.reports").worst_places
        known = {"untouched_normal_max": 0.5, "untouched_worst": [0, 1, 2.5]}
        self.assertEqual(worst(known), [(0.0, 1.0, 2.5)])
        for wrong in ({"untouched_normal_max": 0.0}, {"untouched_normal_max": "1"}):
            self.assertEqual(worst(known | wrong), [])
        for place in (None, [0, 1], [0, 1, "2"], "012", {}):
            self.assertEqual(worst(known | {"untouched_worst": place}), [], place)
            self.assertEqual(worst({"worst": [place, [1, 2, 3]]}), [(1.0, 2.0, 3.0)], place)
        for places in (None, {}, "012", 7):
            self.assertEqual(worst({"worst": places}), [])
