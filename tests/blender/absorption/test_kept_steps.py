# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes whose steps stay in Blender's history: the field follows them back and forth."""

# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false

import random
from unittest.mock import patch

import bpy
import numpy as np
import test_brush_results
from harness import arc, long, module, push_undo, redo, state, stroke, undo, vertices
from test_brush_results import NAMES
from test_live_absorption import KEPT, BrushCase, brush

sculpt_steps = module("blender.scene.sculpt_steps")
kept_steps = module("blender.scene.kept_steps")


class KeptResults(test_brush_results.BrushResults):
    """What holds of strokes that become steps of ours holds of these."""

    keeps = True

    def setUp(self) -> None:
        if not KEPT:
            self.skipTest("this Blender rounds what it takes back")
        super().setUp()

    def test_one_at_a_time_and_nothing_is_seen_of_it(self) -> None:
        """Nothing is pushed, and the mesh is not evaluated."""
        self.brush_all()
        evaluated: list[bool] = []

        def note(_: object, graph: bpy.types.Depsgraph) -> None:
            evaluated.extend(update.is_updated_geometry for update in graph.updates)

        handlers = bpy.app.handlers.depsgraph_update_post
        bpy.context.view_layer.update()
        handlers.append(note)
        self.addCleanup(handlers.remove, note)
        polls, history = 0, sculpt_steps.steps()
        while not self.session.rests:
            self.session.poll_once()
            bpy.context.view_layer.update()
            polls += 1
            self.assertEqual(self.names(), NAMES[:polls])
        self.assertEqual(polls, len(NAMES))
        self.assertEqual(sculpt_steps.steps(), history)
        self.assertFalse(any(evaluated))
        np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
        self.assert_all_are_steps(NAMES)

    def test_redo_has_the_rest_come_in_first(self) -> None:
        """There is none."""

    def test_a_file_that_is_saved_as_steps_are_taken_back(self) -> None:
        """None is."""

    def test_a_stroke_between_them_follows(self) -> None:
        self.come_in(2)
        with self.at_work():
            brush("Smooth", 10)
        self.look()
        sculpted = vertices(self.ob())
        self.finish()
        self.assert_is(sculpted)
        self.assert_all_are_steps([*NAMES, "Smooth"])

    def test_a_stroke_between_them_is_undone(self) -> None:
        """It is in the field as soon as it has a result, whether it was redone or not."""
        self.come_in(2)
        brush("Smooth", 10)
        smooth = vertices(self.ob())
        self.look()
        undo()
        np.testing.assert_array_equal(vertices(self.ob()), self.sculpted)
        self.finish()
        self.assertEqual(self.names(), NAMES)
        redo()
        np.testing.assert_array_equal(vertices(self.ob()), smooth)
        self.look()
        self.finish()
        self.assert_all_are_steps([*NAMES, "Smooth"])
