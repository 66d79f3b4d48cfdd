# SPDX-License-Identifier: GPL-3.0-or-later
"""The dialog Edit Stroke: the surface shows what it would do, and nothing of that stays."""

import bpy
from drawing import (
    INTENSITY,
    PICTURES,
    SECONDS,
    WindowCase,
    changed,
    corner,
    field,
    middle,
    operate,
    redo,
    still_picture,
    undo,
)
from harness import long, module, state
from in_blender import simulated_input as hand
from in_blender.simulated_input import Pixel, Steps

ROW = 26  # pixels from one setting of the dialog to the next

changed_stroke = module("blender.viewport.changed_stroke")


class EditStroke(WindowCase):
    @long
    def test_a_preview_that_leaves_nothing(self) -> Steps:
        """The surface shows what is set, until Esc, Cancel beside the dialog, or another file."""
        yield from self.add()
        before = state(field())
        yield from self.draw(self.arc())
        drawn = state(field())
        for leave, at in (("ESC", None), ("LEFTMOUSE", corner())):
            hand.move(corner())
            plain = yield from still_picture()
            radius = yield from self.open()
            self.assertEqual(self.shown_intensity(), INTENSITY)
            yield from self.carve(radius)
            picture = yield from still_picture()
            _, bottom, right, top = changed(plain, picture, hand.region())
            path = hand.to_window(self.arc())
            self.assertLess(bottom, path[7][1])
            self.assertGreater(top, path[7][1])
            self.assertAlmostEqual(right, path[-1][0], delta=25)
            hand.save_png(PICTURES / "edit_stroke_dialog.png", picture)
            hand.move(corner())
            yield 3 * hand.DRAWN
            self.assertIsNotNone(changed_stroke.shown())  # the mouse alone closes no dialog
            hand.tap(leave, at or radius)
            yield from hand.until(is_gone, SECONDS, "no preview")
            hand.move(corner())
            after = yield from still_picture()
            with self.assertRaises(AssertionError):
                changed(plain, after, hand.region())
            self.assertEqual(state(field()), drawn)
        yield from undo()
        self.assertEqual(state(field()), before)
        yield from redo()
        self.assertEqual(state(field()), drawn)
        yield from self.open()
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        yield 3 * hand.DRAWN
        self.assertTrue(is_gone())

    def test_ok(self) -> Steps:
        """The preview makes way for the field, which is as it showed."""
        yield from self.add()
        yield from self.draw(self.arc())
        drawn = state(field())
        yield from self.carve((yield from self.open()))
        hand.move(middle())
        yield hand.DRAWN
        hand.tap("RET", corner())
        yield from hand.until(is_gone, SECONDS, "no preview")
        yield from self.idle()
        self.assertTrue(is_gone())
        self.assert_raised(self.arc(), by=-INTENSITY)
        yield from undo()
        self.assertEqual(state(field()), drawn)

    def open(self) -> Steps:
        """Open the dialog for the only stroke, with its radius under the mouse; where that is."""
        x, y = hand.to_window([(-self.size, 0, self.size)])[0]
        hand.move((x, y))
        yield hand.DRAWN
        operate(bpy.ops.neural_sculpt.edit_stroke)
        yield from hand.until(lambda: not is_gone(), SECONDS, "a preview")
        yield 3 * hand.DRAWN
        return x, y

    def carve(self, radius: Pixel) -> Steps:
        """Type a minus over the intensity, which is below the radius."""
        x, y = radius
        for step in range(0, ROW + 1, 2):
            hand.move((x, y - step))
            yield hand.DRAWN
        hand.tap("MINUS", (x, y - ROW))
        yield from hand.until(
            lambda: self.shown_intensity() == -INTENSITY, SECONDS, "a preview that carves"
        )

    def shown_intensity(self) -> float:
        """What the dialog has now."""
        return round(changed_stroke.shown().stroke.brush.intensity, 6)


def is_gone() -> bool:
    """Whether there is no preview."""
    return changed_stroke.shown() is None
