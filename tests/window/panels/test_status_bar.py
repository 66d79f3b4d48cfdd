# SPDX-License-Identifier: GPL-3.0-or-later
"""The status bar while the mouse is over the view: what the tool's keys do, what can be done with
control points, and how many strokes wait."""

import os
import signal

import numpy as np
from drawing import PICTURES, SECONDS, WindowCase, choose_tool, middle, still_picture
from harness import long, module
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

HEIGHT = 22  # pixels of the status bar
TONE = 60  # of 255; letters differ by more from what they stand on


class StatusBar(WindowCase):
    def test_hints(self) -> Steps:
        """Of the tool at rest, while control points are edited, and of another tool."""
        yield from self.add()
        rest = yield from self.bar("rest")
        hand.tap("P", middle())
        yield 2 * hand.DRAWN
        points = yield from self.bar("points")
        hand.tap("ESC", middle())
        yield 2 * hand.DRAWN
        np.testing.assert_array_equal((yield from self.bar("rest_again")), rest)
        hand.tap("F", middle())
        yield 2 * hand.DRAWN
        radius = yield from self.bar("radius")
        hand.tap("ESC", middle())
        choose_tool("builtin.select_box")
        other = yield from self.bar("other")
        texts = [rest, points, radius, other]
        for number, one in enumerate(texts):
            self.assertGreater(letters(one), 100)
            for another in texts[:number]:
                self.assertTrue((one != another).any())

    @long
    def test_strokes_that_wait(self) -> Steps:
        """Drawn faster than the worker takes them in, they are counted."""
        yield from self.add()
        rest = yield from self.bar("none_waits")
        worker = self.session.client.pid
        os.kill(worker, signal.SIGSTOP)
        self.addCleanup(os.kill, worker, signal.SIGCONT)
        count = module("blender.panels.status_bar").strokes_that_wait
        bars = []
        for number, tilt in enumerate((-0.6, 0.0, 0.6), 1):
            yield from hand.drag(hand.to_window(self.arc(tilt)), pause=0.02)
            yield from hand.until(lambda expected=number: count() == expected, SECONDS, "a stroke")
            yield 3 * hand.DRAWN
            bars.append((yield from self.bar(f"{number}_wait")))
        self.assertGreater(letters(bars[1]), letters(rest))
        self.assertTrue((bars[1] != bars[2]).any())
        os.kill(worker, signal.SIGCONT)
        yield from self.strokes_are(3)
        self.assertEqual(count(), 0)

    def bar(self, name: str) -> Steps:
        """A picture of the status bar (HEIGHT, W, 3) while the mouse is over the middle."""
        hand.move(middle())
        yield 2 * hand.DRAWN
        picture = yield from still_picture()
        bar = picture[-HEIGHT:]
        hand.save_png(PICTURES / f"status_bar_{name}.png", bar)
        return bar


def letters(bar: np.ndarray) -> int:
    """How many pixels are of letters."""
    ground = np.median(bar.reshape(-1, 3), axis=0)
    return int((np.abs(bar - ground).max(axis=2) > TONE).sum())
