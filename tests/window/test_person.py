# SPDX-License-Identifier: GPL-3.0-or-later
"""A stroke as a person draws it: through the screen's own mouse and keyboard, by xdotool.

The program that started Blender runs the lines that begin with `xdotool`.
"""

import simulated_input as hand
from drawing import WindowCase, field, middle
from harness import state
from simulated_input import Steps


class Person(WindowCase):
    def test_person(self) -> Steps:
        yield from self.add()
        before = state(field())
        path = self.arc()
        person("search", "--onlyvisible", "--class", "Blender", "windowfocus")
        points = hand.to_window(path)
        person(*mouse(points[0]), "sleep", "0.2", "mousedown", "1")
        for point in points[1:]:
            person(*mouse(point), "sleep", "0.05")
        person("mouseup", "1")
        yield from self.strokes_are(1)
        self.assert_raised(path)
        person(*mouse(middle()), "key", "ctrl+z")
        yield from hand.until(lambda: state(field()) == before, 30, "the field without the stroke")


def person(*words: str) -> None:
    """Ask for input."""
    print("xdotool", *words, flush=True)


def mouse(place: hand.Pixel) -> tuple[str, ...]:
    """Move the mouse there; the screen's rows are counted from the top."""
    height = hand.screen_pixels().shape[0]
    return "mousemove", str(int(place[0])), str(height - int(place[1]))
