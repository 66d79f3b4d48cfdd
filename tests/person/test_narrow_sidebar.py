# SPDX-License-Identifier: GPL-3.0-or-later
"""A sidebar that a person makes narrow by its edge, which simulated input does not always move."""

import bpy
from drawing import PICTURES, SECONDS, WindowCase, corner, field, still_picture
from hands import PersonHands, mouse, person
from harness import long
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from row_buttons import BUTTON, SCALE, eyes

NARROW = 130  # pixels


class NarrowSidebar(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        view = bpy.context.preferences.view
        self.addCleanup(setattr, view, "ui_scale", view.ui_scale)
        view.ui_scale = SCALE

    @long
    def test_a_narrow_sidebar(self) -> Steps:
        """The names keep most of their rows, what was in them is below, and works there."""
        if bpy.app.version < (5, 0, 0):
            self.skipTest("its edge does not move on a virtual screen")
        yield from self.add()
        hands = PersonHands(self, 0)
        for _ in range(2):
            yield from hands.neural()
        yield from hand.show_tab("Neural Sculpt")
        yield from still_picture("UI")
        wide = hand.region("UI").width
        yield from drag_edge(wide - NARROW)
        self.assertLess(hand.region("UI").width, NARROW + 20)
        buttons = yield from eyes(lambda: person(*mouse(corner())))
        hand.save_png(PICTURES / "narrow_sidebar.png", (yield from still_picture("UI")))
        x, y = buttons[0]
        person(*mouse((x - 3 * BUTTON * SCALE, y)), "sleep", "0.2", "click", "1")
        chosen = lambda: field().neural_sculpt.active_stroke == 0  # noqa: E731
        yield from hand.until(chosen, SECONDS, "a row that was clicked")
        yield from drag_edge(NARROW - wide)
        self.assertGreater(hand.region("UI").width, wide - 20)


def drag_edge(way: float) -> Steps:
    """Drag the left edge of the sidebar to the right, pixels."""
    region = hand.region("UI")
    x, y, width = region.x + 1, region.y + region.height / 2, region.width
    person(*mouse((x, y)), "sleep", "0.5", "mousedown", "1")
    for share in (0.25, 0.5, 0.75, 1.0):
        person("sleep", "0.1", *mouse((x + share * way, y)))
    person("sleep", "0.1", "mouseup", "1")
    yield from hand.until(lambda: hand.region("UI").width != width, SECONDS, "another width")
    yield from still_picture("UI")
