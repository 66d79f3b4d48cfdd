# SPDX-License-Identifier: GPL-3.0-or-later
"""A result that comes while one of Blender's brushes is down, or an object is held by the mouse,
waits for the end of that: Blender would crash, or undo lead to something half done."""

from collections.abc import Callable

import bpy
import numpy as np
from drawing import (
    SECONDS,
    WindowCase,
    enter_sculpt_mode,
    field,
    middle,
    operate,
    take_native_brush,
    undo,
)
from harness import long, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from test_mask_brush import choose_mask_brush, masks

ANSWERED = 3.0  # seconds in which the worker has its result, and what must not happen would


class InHand(WindowCase):
    absorbs_live = True

    def wait_for_result(self, came: Callable[[], bool]) -> Steps:
        """Let the worker go on; its result does not come."""
        self.assertTrue(hand.window().modal_operators)
        self.go_on()
        yield ANSWERED
        self.assertFalse(came())

    def brush(self, came: Callable[[], bool]) -> Steps:
        """A stroke of Blender's brush from top to bottom, in the midst of which a result is there,
        which comes behind it."""
        meridian = [(0, -self.size * np.cos(t), self.size * np.sin(t)) for t in (-0.8, 0.3)]
        first, *others = map(tuple, np.linspace(*hand.to_window(meridian), 14))
        hand.move(first)
        hand.press(first)
        for number, place in enumerate(others):
            yield hand.DRAWN
            hand.move(place)
            if number == len(others) // 2:
                yield from self.wait_for_result(came)
        hand.release(others[-1])
        yield from hand.until(came, SECONDS, "the result")
        yield from self.idle()

    @long
    def test_a_new_field_while_another_one_is_sculpted(self) -> Steps:
        yield from self.add()
        self.stop_worker()
        operate(bpy.ops.neural_sculpt.add, kind="TORUS")
        yield from enter_sculpt_mode()
        take_native_brush("Draw")
        yield 3 * hand.DRAWN
        before = vertices(field())
        yield from self.brush(lambda: "Torus" in bpy.data.objects)
        yield from self.strokes_are(1)
        self.assertTrue((vertices(field()) != before).any())

    def test_a_neural_stroke_while_a_mask_is_painted(self) -> Steps:
        """Without live absorption, too."""
        yield from self.add()
        field().neural_sculpt.live = False
        self.stop_worker()
        yield from hand.drag(hand.to_window(self.arc(0.7)))
        yield from enter_sculpt_mode()
        choose_mask_brush()
        yield 3 * hand.DRAWN
        yield from self.brush(lambda: len(field().neural_sculpt.strokes) == 1)
        self.assertFalse(field().neural_sculpt.strokes[0].muted)
        self.assertGreater(masks().max(), 0)

    @long
    def test_a_strength_that_was_typed_before_a_brush_is_put_down(self) -> Steps:
        """Of a muted stroke, which the worker is not asked about. It is applied when it rests."""
        yield from self.add()
        yield from self.draw(self.arc(0.7))
        operate(bpy.ops.neural_sculpt.mute_stroke)
        yield from self.idle()
        yield from enter_sculpt_mode()
        choose_mask_brush()
        yield 3 * hand.DRAWN
        self.stop_worker()
        bpy.context.window_manager.neural_sculpt_strength = 0.5
        yield from self.brush(lambda: field().neural_sculpt.strokes[0].strength == 0.5)
        self.assertGreater(masks().max(), 0)

    @long
    def test_a_neural_stroke_while_its_object_is_moved(self) -> Steps:
        """Undo of the move leads to where the object stood."""
        yield from self.add()
        self.stop_worker()
        yield from hand.drag(hand.to_window(self.arc()))
        x, y = middle()
        hand.move((x, y))
        hand.tap("G", (x, y))
        yield 3 * hand.DRAWN
        hand.move((x + 60, y))
        yield 3 * hand.DRAWN
        yield from self.wait_for_result(lambda: len(field().neural_sculpt.strokes) == 1)
        self.assertGreater(field().location.x, 0)
        hand.tap("RET", (x + 60, y))
        yield from self.strokes_are(1)
        moved = field().location.x
        self.assertGreater(moved, 0)
        yield from undo()
        self.assertEqual((len(field().neural_sculpt.strokes), field().location.x), (0, moved))
        yield from undo()
        self.assertEqual(field().location.x, 0)
