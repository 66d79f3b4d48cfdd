# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in the background is told where an artist looks."""

import os
import signal

import bpy
import simulated_input as hand
from drawing import SECONDS, WindowCase, field, operate
from harness import collection, state
from simulated_input import Steps


class Notice(WindowCase):
    def test_notice_of_a_worker_that_died_while_it_refined(self) -> Steps:
        yield from self.add()
        operate(bpy.ops.neural_sculpt.stroke, points=collection(self.arc()))

        def refining() -> bool:
            return bool(self.session.jobs) and self.session.jobs[0].quick is not None

        yield from hand.until(refining, SECONDS, "a quick result")
        quick = state(field())
        os.kill(self.session.client.pid, signal.SIGKILL)
        yield from hand.until(lambda: self.session.last_error, SECONDS, "the end of the worker")
        self.assertIn("keeps its quick result", self.session.last_error)
        self.assertEqual(state(field()), quick)
        yield 0.5
        self.assertIn(self.session.last_error, reports())
        operate(bpy.ops.neural_sculpt.stroke, points=collection(self.arc(tilt=0.8)))
        yield from self.strokes_are(2)


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
