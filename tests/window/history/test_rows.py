# SPDX-License-Identifier: GPL-3.0-or-later
"""The history's rows by clicks: a row is chosen and shown on the surface, muted, soloed."""

import bpy
import numpy as np
from drawing import (
    INTENSITY,
    PICTURES,
    SECONDS,
    WindowCase,
    changed,
    click,
    corner,
    field,
    still_picture,
    uncovered,
)
from harness import long, module, state
from in_blender import simulated_input as hand
from in_blender.simulated_input import Pixel, Steps
from row_buttons import BUTTON, SCALE, eyes

TONE = 50  # of 255; a filled star is brighter by more


def to_corner() -> None:
    """Take the mouse off the rows."""
    hand.move(corner())


class Rows(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        view = bpy.context.preferences.view
        self.addCleanup(setattr, view, "ui_scale", view.ui_scale)
        view.ui_scale = SCALE

    def three_strokes(self) -> Steps:
        """One that raises, one that carves, and one that smooths both; the list in sight."""
        yield from self.add()
        self.paths = self.arc(0.5), self.arc(-0.5), self.arc(0.0, 0.2)
        yield from self.draw(self.paths[0])
        yield from self.draw(self.paths[1], ("ctrl",))
        yield from self.draw(self.paths[2], ("shift",))
        yield from hand.show_tab("Neural Sculpt")

    def test_a_row_is_chosen_by_a_click(self) -> Steps:
        """The stroke is shown on the surface where it runs; the rows' pictures are three."""
        yield from self.three_strokes()
        buttons = yield from eyes(to_corner)
        hand.move(corner())
        plain = yield from still_picture()
        before = state(field())
        for number in (0, 1, 2):
            x, y = buttons[number]
            yield from click((x - 5 * BUTTON * SCALE, y))
            self.assertEqual(field().neural_sculpt.active_stroke, number)
            hand.move(corner())
            shown = yield from still_picture()
            hand.save_png(PICTURES / f"row_{number}_chosen.png", shown)
            left, bottom, right, top = changed(plain, shown, uncovered())
            ends = hand.to_window(self.paths[number][[0, -1]])
            self.assertAlmostEqual(left, ends[0][0], delta=20)
            self.assertAlmostEqual(right, ends[1][0], delta=20)
            height = hand.to_window([self.paths[number][7]])[0][1]
            self.assertTrue(bottom - 20 <= height <= top + 20, (bottom, height, top))
        self.assertEqual(state(field()), before)

    def test_mute_and_solo_by_clicks(self) -> Steps:
        """At once, as no stroke lies on another; the star of the one that is alone is filled."""
        yield from self.add()
        paths = self.arc(0.6), self.arc(0.0), self.arc(-0.6)
        for path in paths:
            yield from self.draw(path)
        yield from hand.show_tab("Neural Sculpt")
        buttons = yield from eyes(to_corner)
        stars = [(x - BUTTON * SCALE, y) for x, y in buttons]
        yield from self.press(buttons[0])
        self.assertEqual(self.muted(), [True, False, False])
        self.assert_raised(*paths[1:])
        yield from self.press(buttons[0])
        self.assertEqual(self.muted(), [False, False, False])
        self.assert_raised(*paths)
        hand.move(corner())
        empty = yield from still_picture("UI")
        yield from self.press(stars[0])
        self.assertEqual(self.muted(), [False, True, True])
        self.assert_raised(paths[0])
        hand.move(corner())
        filled = yield from still_picture("UI")
        hand.save_png(PICTURES / "solo.png", filled)
        for number, star in enumerate(stars):
            brighter = bright(filled, star) - bright(empty, star)
            self.assertEqual(brighter > TONE, number == 0, brighter)
        yield from self.press(stars[0])
        self.assertEqual(self.muted(), [False, False, False])
        self.assert_raised(*paths)

    @long
    def test_the_dialog_names_its_stroke(self) -> Steps:
        """A row is renamed by a click with Ctrl, and its dialog has the name as its title."""
        yield from self.three_strokes()
        buttons = yield from eyes(to_corner)
        x, y = buttons[0][0] - 5 * BUTTON * SCALE, buttons[0][1]
        hand.move((x, y))
        yield 3 * hand.DRAWN
        hand.tap("LEFTMOUSE", (x, y), ("ctrl",))
        yield 3 * hand.DRAWN
        for letter in "Brow":
            hand.tap(letter.upper(), (x, y), ("shift",) if letter.isupper() else (), letter)
            yield hand.DRAWN
        hand.tap("RET", (x, y))
        yield 3 * hand.DRAWN
        self.assertEqual(field().neural_sculpt.strokes[0].name, "Brow")
        yield from click((buttons[0][0] - 2 * BUTTON * SCALE, y))
        shown = module("blender.viewport.changed_stroke").shown
        yield from hand.until(lambda: shown() is not None, SECONDS, "a preview")
        dialog = yield from still_picture()
        hand.save_png(PICTURES / "dialog_with_name.png", dialog)
        self.assertAlmostEqual(shown().stroke.brush.intensity, INTENSITY)
        self.assertEqual(shown().stroke.name, "Brow")
        hand.tap("ESC", (x, y))
        yield from hand.until(lambda: shown() is None, SECONDS, "no preview")

    def press(self, place: Pixel) -> Steps:
        """Click a button of a row, and wait for what it does."""
        before = self.muted()
        yield from click(place)
        yield from hand.until(lambda: self.muted() != before, SECONDS, "another history")
        yield from self.idle()
        yield hand.DRAWN

    def muted(self) -> list[bool]:
        return [item.muted for item in field().neural_sculpt.strokes]


def bright(picture: np.ndarray, place: Pixel) -> float:
    """How bright the middle of a button is."""
    x, row = int(place[0]), picture.shape[0] - int(place[1])
    return float(picture[row - 1 : row + 2, x - 1 : x + 2].mean())
