# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons in the rows of the history, found in pictures of the sidebar."""

from collections.abc import Callable

from drawing import changed, field, still_picture
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

BUTTON = 20  # pixels of a button without words
SCALE = 0.6  # of the interface, so that all panels are in sight


def eyes(take_mouse_away: Callable[[], None]) -> Steps:
    """Where in the window the button is, in each row, that mutes its stroke."""
    pictures, found = [], []
    strokes = field().neural_sculpt.strokes
    for muted in (None, *range(len(strokes))):
        for number, item in enumerate(strokes):
            item.muted = number == muted
        hand.region("UI").tag_redraw()
        take_mouse_away()
        pictures.append((yield from still_picture("UI")))
    strokes[len(strokes) - 1].muted = False
    for picture in pictures[1:]:
        _, bottom, right, top = changed(pictures[0], picture, hand.region("UI"), least=10)
        found.append((right - 0.5 * BUTTON * SCALE, (bottom + top) / 2))
    return found
