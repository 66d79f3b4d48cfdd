# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in the background is told where an artist looks."""

import os
import signal

import bpy
from drawing import WindowCase, operate
from harness import collection, module
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class Notice(WindowCase):
    def test_notice_of_a_worker_that_died(self) -> Steps:
        yield from self.add()
        operate(bpy.ops.neural_sculpt.stroke, points=collection(self.arc()))
        os.kill(self.session.client.pid, signal.SIGKILL)
        yield from self.strokes_are(1)
        yield 0.5
        self.assertIn("is sent to a new worker", reports())

    def test_notices_that_come_together_are_one_report(self) -> Steps:
        """Blender shows the last report alone."""
        notice = module("blender.notice")
        notice.tell("One thing.")
        notice.tell("Another thing.")
        notice.tell("One thing.")
        yield 0.5
        notice.tell("Later.")
        yield 0.5
        shown = reports().splitlines()
        self.assertTrue(any(line.endswith("One thing. Another thing.") for line in shown), shown)
        self.assertTrue(shown[-1].endswith("Later."), shown)


def reports() -> str:
    """What Blender has shown in the status bar."""
    area = hand.view_area()
    area.type = "INFO"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=hand.window(), area=area, region=region):
        bpy.ops.info.select_all(action="SELECT")
        bpy.ops.info.report_copy()
    area.type = "VIEW_3D"
    return hand.window().id_data.clipboard
