# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of Blender's own brushes go into the field by themselves, as one undo step each."""

import os
import signal

import bpy
import numpy as np
from drawing import (
    PICTURES,
    SECONDS,
    WindowCase,
    choose_tool,
    edited,
    enter_sculpt_mode,
    field,
    make_native_brushes,
    middle,
    moved_since,
    operate,
    redo,
    still_picture,
    take_native_brush,
    undo,
)
from harness import EXTENSION, long, module, push_undo, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from mathutils.bvhtree import BVHTree
from test_first_use import corners

CLOSE = 3e-4  # of the brushed mesh, in the mean


class Live(WindowCase):
    absorbs_live = True

    def setUp(self) -> None:
        super().setUp()
        bpy.context.preferences.addons[EXTENSION].preferences.resolution = 112

    def names(self) -> list[str]:
        return [item.name for item in field().neural_sculpt.strokes]

    def brush(self, name: str, tilt: float, spread: float = 0.3) -> Steps:
        """Draw with a brush, wait until the field has it, and compare."""
        take_native_brush(name)
        yield hand.DRAWN
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
        make_native_brushes("Clay", "Grab", "Smooth")
        yield from self.add()
        yield from self.draw(self.arc(0.6))
        yield from enter_sculpt_mode()
        states = [state(field())]
        for name, *drawn in (("Clay", 0.0), ("Grab", -0.3, 0.1), ("Smooth", 0.1)):
            yield from self.brush(name, *drawn)
            self.assertEqual(field().mode, "SCULPT")
            states.append(state(field()))
        self.assertEqual(self.names()[1:], ["Clay", "Grab", "Smooth"])
        yield from self.undo_and_redo(states)

    def test_what_the_field_cannot_hold_is_said_and_shown(self) -> Steps:
        """A Grab that drags the surface over itself: in the panel, and where it is."""
        make_native_brushes("Grab")
        yield from self.add()
        yield from enter_sculpt_mode()
        take_native_brush("Grab")
        yield hand.DRAWN
        count = len(self.names())
        yield from hand.drag(hand.to_window(self.arc(0.0, 1.1)[7:]), pause=0.02)
        yield from hand.until(lambda: len(self.names()) > count, SECONDS, "Grab in the field")
        yield from self.idle()
        reports, ring = module("blender.session.reports"), module("blender.viewport.worst_place")
        report = reports.report_of(field())
        self.assertEqual(len(reports.notes_of(report)), 1)
        yield from hand.show_tab("Neural Sculpt")
        operate(bpy.ops.neural_sculpt.show_worst)
        self.assertTrue(ring.is_shown(field()))
        hand.save_png(PICTURES / "lost.png", (yield from still_picture()))

    @long
    def test_a_mode_that_is_left_at_once_shows_the_normals_of_the_stroke(self) -> Steps:
        if bpy.app.version < (4, 5):
            self.skipTest("this Blender has no such normals")
        make_native_brushes("Clay")
        yield from self.add()
        yield from enter_sculpt_mode()
        before = normals()
        yield from self.brush("Clay", 0.0)
        operate(bpy.ops.object.mode_set, mode="OBJECT")
        push_undo("Object Mode")
        yield 3 * hand.DRAWN
        left = normals()
        self.assertGreater(np.abs(left - before).max(), 0.1)
        yield from undo()
        self.assertEqual(field().mode, "SCULPT")
        yield from undo()
        yield from hand.until(
            lambda: bool((normals() == before).all()), SECONDS, "normals of before"
        )
        yield from redo()
        yield from hand.until(lambda: bool((normals() == left).all()), SECONDS, "normals of after")

    def test_the_worker_has_a_stroke_before_the_window_shows_it(self) -> Steps:
        """And one that ends and is undone in a single turn of Blender's loop is no stroke."""
        make_native_brushes("Clay")
        yield from self.add()
        yield from enter_sculpt_mode()
        take_native_brush("Clay")
        yield 3 * hand.DRAWN
        before = state(field())
        is_at_work = module("blender.session.absorption.brush_results").is_at_work
        shown = []

        def note() -> None:
            if not is_at_work() and moved_since(still) and len(field().neural_sculpt.strokes) == 0:
                shown.append(len(self.session.jobs))

        still = vertices(field())
        handle = bpy.types.SpaceView3D.draw_handler_add(note, (), "WINDOW", "PRE_VIEW")
        try:
            yield from hand.drag(hand.to_window(self.arc(0.0)), pause=0.03)
            yield from self.strokes_are(1)
        finally:
            bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
        self.assertEqual(shown[:1], [1])
        yield from undo()
        self.assertEqual(state(field()), before)
        first, *others = hand.to_window(self.arc(0.0))
        hand.move(first)
        hand.press(first)
        for point in others:
            yield 0.03
            hand.move(point)
        yield 0.03
        hand.release(others[-1])
        hand.tap("Z", others[-1], ("ctrl",))
        yield 5 * hand.DRAWN
        yield from self.idle()
        self.assertEqual(state(field()), before)
        self.assertEqual(self.names(), [])

    def test_changes_are_heard_of_without_a_window(self) -> Steps:
        """As while a file is saved, of which Blender draws a picture."""
        yield from self.add()
        handlers = bpy.app.handlers.depsgraph_update_post
        ours = [each for each in handlers if each.__module__.startswith(EXTENSION)]
        self.assertGreater(len(ours), 0)
        with bpy.context.temp_override(window=None):
            for handler in ours:
                handler(bpy.context.scene)

    def test_a_stroke_undone_before_it_is_absorbed_leaves_nothing(self) -> Steps:
        """Blender up to 4.5 rounds what it takes back, which must not count as sculpted."""
        make_native_brushes("Clay")
        yield from self.add()
        yield from enter_sculpt_mode()
        take_native_brush("Clay")
        yield hand.DRAWN
        before = vertices(field())
        yield from hand.drag(hand.to_window(self.arc(0.0)), pause=0.02)
        yield from hand.until(lambda: moved_since(before), SECONDS, "a native stroke")
        yield from undo()
        yield from self.idle()
        self.assertTrue(np.array_equal(vertices(field()), before))
        self.assertFalse(edited())

    @long
    def test_a_brush_while_a_neural_stroke_is_computed(self) -> Steps:
        """The result comes while the brush is down: both are in the history, the brush first."""
        make_native_brushes("Clay")
        yield from self.add()
        yield from enter_sculpt_mode()
        before = state(field())
        choose_tool()
        yield hand.DRAWN
        worker = self.session.client.pid
        os.kill(worker, signal.SIGSTOP)
        yield from hand.drag(hand.to_window(self.arc(0.6)))
        yield from hand.until(lambda: any(j.strokes for j in self.session.jobs), SECONDS, "a job")
        take_native_brush("Clay")
        yield 3 * hand.DRAWN
        first, *others = hand.to_window(self.arc(0.0))
        hand.move(first)
        hand.press(first)
        os.kill(worker, signal.SIGCONT)
        for point in others:
            yield 2 * hand.DRAWN  # the worker answers meanwhile
            hand.move(point)
        self.assertEqual(self.names(), [])
        hand.release(others[-1])
        yield from self.strokes_are(2)
        self.assertEqual(self.names()[0], "Clay")
        self.assertFalse(any(item.muted for item in field().neural_sculpt.strokes))
        self.assertFalse(edited())
        both = state(field())
        yield from undo()
        self.assertEqual(self.names(), ["Clay"])
        yield from undo()
        self.assertEqual(state(field()), before)
        yield from redo()
        yield from redo()
        self.assertEqual(state(field())[2], both[2])

    @long
    def test_undo_and_redo_of_both_before_either_has_a_result(self) -> Steps:
        """Each press is about one of them."""
        make_native_brushes("Clay")
        yield from self.add()
        yield from enter_sculpt_mode()
        before = state(field())
        choose_tool()
        yield hand.DRAWN
        worker = self.session.client.pid
        os.kill(worker, signal.SIGSTOP)
        self.addCleanup(os.kill, worker, signal.SIGCONT)
        yield from hand.drag(hand.to_window(self.arc(0.6)))
        yield from hand.until(lambda: any(j.strokes for j in self.session.jobs), SECONDS, "a job")
        take_native_brush("Clay")
        yield 3 * hand.DRAWN
        still = vertices(field())
        yield from hand.drag(hand.to_window(self.arc(0.0)), pause=0.02)
        yield from hand.until(lambda: len(self.session.jobs) > 1, SECONDS, "another job")
        for step, neural, native in (
            (undo, True, False),
            (undo, False, False),
            (redo, True, False),
            (redo, True, True),
        ):
            yield from step()
            self.assertEqual(any(job.strokes for job in self.session.jobs), neural)
            names = module("blender.scene.native_steps").names()
            self.assertEqual(any("Clay" in name for name in names), native)
        self.assertTrue(moved_since(still))
        os.kill(worker, signal.SIGCONT)
        yield from self.strokes_are(2)
        yield from self.idle()
        self.assertEqual(self.names()[0], "Clay")
        self.assertFalse(edited())
        for _ in range(2):
            yield from undo()
        self.assertEqual(state(field()), before)

    @long
    def test_a_dialog_is_open_when_a_stroke_is_absorbed(self) -> Steps:
        """It shows the field while the brush's step is taken back, and can be used afterwards."""
        make_native_brushes("Clay")
        yield from self.add()
        yield from self.draw(self.arc(0.6))
        yield from enter_sculpt_mode()
        before = state(field())
        take_native_brush("Clay")
        yield hand.DRAWN
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

    @long
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


def normals() -> np.ndarray:
    """The normals (3 V,) of the proxy; zero in Blenders that have none."""
    mesh = field().data
    flat = np.zeros(3 * len(mesh.vertices), np.float32)
    if "custom_normal" in mesh.attributes:
        mesh.attributes["custom_normal"].data.foreach_get("vector", flat)
    return flat
