# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of Blender's own brushes go into the field by themselves, as one undo step each."""

import os
import signal

import bpy
import numpy as np
import simulated_input as hand
from drawing import (
    SECONDS,
    WindowCase,
    choose_tool,
    edited,
    enter_sculpt_mode,
    field,
    middle,
    moved_since,
    operate,
    redo,
    undo,
)
from harness import EXTENSION, state, vertices
from mathutils.bvhtree import BVHTree
from simulated_input import Steps
from test_first_use import corners

BRUSHES = "brushes/essentials_brushes-mesh_sculpt.blend/Brush/"
CLOSE = 3e-4  # of the brushed mesh, in the mean


class Live(WindowCase):
    absorbs_live = True

    def setUp(self) -> None:
        super().setUp()
        bpy.context.preferences.addons[EXTENSION].preferences.resolution = 160

    def take(self, name: str) -> Steps:
        """Take one of Blender's brushes in hand."""
        choose_tool("builtin.brush")
        given = {"asset_library_type": "ESSENTIALS", "relative_asset_identifier": BRUSHES + name}
        operate(bpy.ops.brush.asset_activate, "EXEC_DEFAULT", **given)
        yield hand.DRAWN

    def names(self) -> list[str]:
        return [item.name for item in field().neural_sculpt.strokes]

    def brush(self, name: str, tilt: float, spread: float = 0.3) -> Steps:
        """Draw with a brush, wait until the field has it, and compare."""
        yield from self.take(name)
        before, count = vertices(field()), len(self.names())
        seen = []

        def moved() -> bool:
            if moved_since(before) and len(self.names()) == count:
                seen[:] = [vertices(field())]
            return len(self.names()) > count

        yield from hand.drag(hand.to_window(self.arc(tilt, spread)), pause=0.02)
        yield from hand.until(moved, SECONDS, f"{name} in the field")
        yield from self.idle()
        self.assertFalse(edited())
        changed = (seen[0] != before).any(1)
        tree = BVHTree.FromPolygons(vertices(field()).tolist(), corners(field()).tolist())
        off = [tree.find_nearest(point)[3] for point in seen[0][changed].tolist()]
        self.assertLess(np.mean(off), CLOSE, name)

    def test_each_stroke_is_an_entry_and_an_undo_step(self) -> Steps:
        yield from self.add()
        yield from self.draw(self.arc(0.6))
        yield from enter_sculpt_mode()
        states = [state(field())]
        for name, *drawn in (("Clay", 0.0), ("Grab", -0.3, 0.1), ("Smooth", 0.1)):
            yield from self.brush(name, *drawn)
            self.assertEqual(field().mode, "SCULPT")
            states.append(state(field()))
        self.assertEqual(self.names()[1:], ["Clay", "Grab", "Smooth"])
        for expected in states[-2::-1]:
            yield from undo()
            self.assertEqual(state(field()), expected)
        for expected in states[1:]:
            yield from redo()
            self.assertEqual(state(field()), expected)

    def test_a_dialog_is_open_when_a_stroke_is_absorbed(self) -> Steps:
        """It shows the field while the brush's step is taken back, and can be used afterwards."""
        yield from self.add()
        yield from self.draw(self.arc(0.6))
        yield from enter_sculpt_mode()
        before = state(field())
        yield from self.take("Clay")
        worker = self.session.client.pid
        os.kill(worker, signal.SIGSTOP)
        self.addCleanup(os.kill, worker, signal.SIGCONT)
        yield from hand.drag(hand.to_window(self.arc(0.0)), pause=0.02)
        yield from hand.until(lambda: bool(self.session.jobs), SECONDS, "a job")
        hand.move(middle())
        operate(bpy.ops.neural_sculpt.edit_stroke)
        yield 3 * hand.DRAWN
        os.kill(worker, signal.SIGCONT)
        yield from hand.until(lambda: self.names()[1:] == ["Clay"], SECONDS, "the brush stroke")
        x, y = middle()
        for step in range(-100, 101, 20):  # over the settings
            hand.move((x, y + step))
            yield hand.DRAWN
        hand.tap("RET", (x, y))
        yield from self.idle()
        yield 3 * hand.DRAWN
        yield from undo()
        if len(self.names()) == 2:  # the dialog has made a step
            yield from undo()
        self.assertEqual(state(field()), before)

    def test_the_switch_is_beside_absorb(self) -> Steps:
        """Off, a stroke stays on the mesh alone; the picture shows the panel."""
        yield from self.add()
        yield from enter_sculpt_mode()
        field().neural_sculpt.live = False
        yield from self.native(0.0)
        self.assertTrue(edited())
        yield from hand.show_tab("Neural Sculpt")
        yield 3 * hand.DRAWN
        self.assertFalse(self.session.jobs)
