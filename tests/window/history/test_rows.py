# SPDX-License-Identifier: GPL-3.0-or-later
"""The history's rows by clicks: a row is chosen and shown on the surface, muted, soloed; and the
same in a sidebar that was made narrow by its edge."""

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

BUTTON = 20  # pixels of a button without words
SCALE = 0.6  # of the interface, so that all panels are in sight
TONE = 50  # of 255; a filled star is brighter by more
EDGE = 8  # pixels beside the edge of a region that still are on it


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

    def eyes(self) -> Steps:
        """Where the button is in each row of the list that mutes."""
        pictures, found = [], []
        strokes = field().neural_sculpt.strokes
        for muted in (None, *range(len(strokes))):
            for number, item in enumerate(strokes):
                item.muted = number == muted
            hand.region("UI").tag_redraw()
            hand.move(corner())
            pictures.append((yield from still_picture("UI")))
        strokes[len(strokes) - 1].muted = False
        for picture in pictures[1:]:
            _, bottom, right, top = changed(pictures[0], picture, hand.region("UI"), least=10)
            found.append((right - 0.5 * BUTTON * SCALE, (bottom + top) / 2))
        return found

    def test_a_row_is_chosen_by_a_click(self) -> Steps:
        """The stroke is shown on the surface where it runs; the rows' pictures are three."""
        yield from self.three_strokes()
        eyes = yield from self.eyes()
        hand.move(corner())
        plain = yield from still_picture()
        before = state(field())
        for number in (0, 1, 2):
            x, y = eyes[number]
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
        eyes = yield from self.eyes()
        stars = [(x - BUTTON * SCALE, y) for x, y in eyes]
        yield from self.press(eyes[0])
        self.assertEqual(self.muted(), [True, False, False])
        self.assert_raised(*paths[1:])
        yield from self.press(eyes[0])
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
    def test_a_narrow_sidebar(self) -> Steps:
        """Its edge is dragged: the names keep most of their rows, what was in them is below, and
        works there."""
        if bpy.app.version < (5, 0, 0):
            self.skipTest("its edge does not feel simulated input")
        yield from self.three_strokes()
        whole, wide = hand.region(), hand.region("UI").width
        yield from self.drag_edge(whole.x + whole.width - 130)
        scale = bpy.context.preferences.system.ui_scale
        self.assertLess(hand.region("UI").width, 240 * scale)
        eyes = yield from self.eyes()
        picture = yield from still_picture("UI")
        hand.save_png(PICTURES / "narrow_sidebar.png", picture)
        x, y = eyes[0]
        yield from click((x - 3 * BUTTON * SCALE, y))
        self.assertEqual(field().neural_sculpt.active_stroke, 0)
        yield from self.drag_edge(whole.x + whole.width - wide)
        self.assertGreater(hand.region("UI").width, 240 * scale)

    def drag_edge(self, target: float) -> Steps:
        """Drag the left edge of the sidebar to a column of the window.

        A press counts as one on the edge only after Blender has noticed the mouse there, which no
        script can ask for: what was not taken is dragged again.
        """
        for _ in range(5):
            yield from still_picture("UI")
            region = hand.region("UI")
            x, y = region.x + 1, region.y + region.height / 2
            if abs(x - target) < EDGE:
                return
            hand.move((x - 2 * EDGE, y))
            yield 3 * hand.DRAWN
            hand.move((x, y))
            yield 3 * hand.DRAWN
            yield from hand.drag([(float(at), y) for at in np.linspace(x, target, 12)], pause=0.05)
            yield 3 * hand.DRAWN
        raise AssertionError(f"the sidebar's edge stays at {x}, dragged to {target}")

    @long
    def test_the_dialog_names_its_stroke(self) -> Steps:
        """A row is renamed by a click with Ctrl, and its dialog has the name as its title."""
        yield from self.three_strokes()
        eyes = yield from self.eyes()
        x, y = eyes[0][0] - 5 * BUTTON * SCALE, eyes[0][1]
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
        yield from click((eyes[0][0] - 2 * BUTTON * SCALE, y))
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
