# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker that is stopped in mid-job: it is noticed and can be replaced, and no stroke is lost."""

import os
import unittest
from unittest.mock import patch

import bpy
import numpy as np
from harness import SteeredCase, call_as, field, long, module, state, stroke

SILENT = 3.0


@unittest.skipUnless(os.name == "posix", "no process can be stopped")
class HangingWorker(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        self.addCleanup(self.session.stop)
        shorter = patch.object(module("worker.pulse"), "SILENT", SILENT)
        shorter.start()
        self.addCleanup(shorter.stop)
        self.spoil = self.folder / "spoil"

    def listed(self) -> list[tuple[str, bool]]:
        return [(item.name, item.muted) for item in field("Sphere").neural_sculpt.strokes]

    def hang(self, *names: str) -> int:
        """Strokes, in the first of which the worker hangs; its number."""
        self.spoil.write_text("hang once")
        for name in names:
            stroke(np.eye(3), name=name)
        self.say("go")
        self.pump(lambda: self.session.hangs)
        self.assertFalse(self.spoil.exists())
        return self.session.client.pid

    def test_the_panel_says_so_and_restart_loses_nothing(self) -> None:
        hung = self.hang("One", "Two")
        panel = module("blender.panels.worker")
        self.assertEqual(panel.state(), "Not responding")
        self.assertIn("no sign of life", self.session.jobs[0].message)
        self.assertEqual(self.listed(), [])
        self.assertEqual(bpy.ops.neural_sculpt.restart_worker(), {"FINISHED"})
        self.assertNotEqual(self.session.client.pid, hung)
        with self.assertRaises(ProcessLookupError):
            os.kill(hung, 0)
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.listed(), [("One", False), ("Two", False)])

    @long
    def test_cancel_of_its_job_replaces_the_worker(self) -> None:
        before = state(field("Sphere"))
        hung = self.hang("One")
        self.session.cancel()
        with self.assertRaises(ProcessLookupError):
            os.kill(hung, 0)
        self.assertEqual(state(field("Sphere")), before)
        stroke(np.eye(3), name="Two")
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.listed(), [("Two", False)])

    @long
    def test_cancel_of_one_job_keeps_the_others(self) -> None:
        self.hang("One", "Two")
        self.session.cancel_job(self.session.jobs[0])
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.listed(), [("Two", False)])

    @long
    def test_in_the_background_it_is_replaced_once(self) -> None:
        call_as("Script")
        self.say("go")
        self.spoil.write_text("hang once")
        stroke(np.eye(3), name="One")
        self.assertEqual(self.listed(), [("One", False)])

    @long
    def test_in_the_background_the_second_time_is_an_error_and_the_stroke_is_kept(self) -> None:
        call_as("Script")
        self.say("go")
        self.spoil.write_text("hang")
        with self.assertRaisesRegex(RuntimeError, "gave no sign of life.* is in the history"):
            stroke(np.eye(3), name="One")
        self.assertEqual(self.listed(), [("One", True)])
        self.spoil.unlink()
        stroke(np.eye(3), name="Two")
        self.assertEqual(self.listed(), [("One", True), ("Two", False)])
