# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply to Base asks before strokes leave the history: Esc keeps them, Enter does it, and what is
muted stays."""

import bpy
from drawing import PICTURES, WindowCase, field, middle, operate, still_picture, undo
from harness import long, state
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class ApplyToBase(WindowCase):
    def names(self) -> list[str]:
        return [item.name for item in field().neural_sculpt.strokes]

    def ask(self) -> Steps:
        hand.move(middle())
        yield hand.DRAWN
        operate(bpy.ops.neural_sculpt.apply_to_base)
        yield 3 * hand.DRAWN

    @long
    def test_it_asks(self) -> Steps:
        yield from self.add()
        for tilt in (-0.6, 0.0, 0.6):
            yield from self.draw(self.arc(tilt, 0.2))
        names = self.names()
        bpy.ops.neural_sculpt.mute_stroke(uid=field().neural_sculpt.strokes[1].uid)
        yield from self.idle()
        before = state(field())
        yield from self.ask()
        hand.save_png(PICTURES / "apply_to_base.png", (yield from still_picture()))
        self.assertEqual(self.names(), names)
        self.assertFalse(self.session.jobs)
        hand.tap("ESC", middle())
        yield 3 * hand.DRAWN
        yield from self.idle()
        self.assertEqual(state(field()), before)
        yield from self.ask()
        hand.tap("RET", middle())
        yield from hand.until(lambda: len(self.names()) == 1, 60, "another base")
        self.assertEqual(self.names(), [names[1]])
        yield from self.idle()
        yield from undo()
        self.assertEqual(state(field()), before)
        bpy.ops.neural_sculpt.mute_stroke(uid=field().neural_sculpt.strokes[0].uid)
        yield from self.idle()
        yield from self.ask()
        hand.save_png(PICTURES / "apply_one_to_base.png", (yield from still_picture()))
        hand.tap("ESC", middle())
        yield 3 * hand.DRAWN
