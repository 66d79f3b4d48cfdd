# SPDX-License-Identifier: GPL-3.0-or-later
"""Neural Boolean with its dialog: an operation is chosen, the viewport shows what is being made
while the worker is at it, and Ctrl Z takes it back."""

import os
import signal

import bpy
import numpy as np
import simulated_input as hand
from drawing import (
    PICTURES,
    SECONDS,
    STILL,
    WindowCase,
    click,
    corner,
    field,
    middle,
    operate,
    still_picture,
    undo,
)
from harness import state, vertices
from simulated_input import Steps

SIDE = 0.6  # of the cube, in radii of the sphere


class BooleanDialog(WindowCase):
    def test_difference(self) -> Steps:
        yield from self.add()
        bpy.ops.mesh.primitive_cube_add(size=SIDE * self.size, location=(0, -self.size, 0))
        hand.window().view_layer.objects.active = field()
        field().select_set(True)
        bpy.ops.ed.undo_push(message="Cube")
        before = state(field())
        plain = yield from still_picture()
        self.assertLess(colored(plain), 0.02)
        x, y = middle()
        hand.move((x, y))
        operate(bpy.ops.neural_sculpt.boolean)
        yield 5 * hand.DRAWN
        yield from click((x, y))  # the operation is under the mouse
        hand.save_png(PICTURES / "boolean_operations.png", (yield from still_picture()))
        hand.tap("D", (x, y))  # for Difference
        yield 3 * hand.DRAWN
        hand.tap("RET", corner())
        yield from hand.until(lambda: bool(self.session.jobs), SECONDS, "a job")
        yield from self.preview()
        shown = yield from still_picture()
        hand.save_png(PICTURES / "boolean_preview.png", shown)
        self.assertGreater(colored(shown), 0.1)
        os.kill(self.worker, signal.SIGCONT)
        yield from self.strokes_are(1)
        self.assertEqual(field().neural_sculpt.strokes[0].name, "Difference from Cube")
        points = vertices(field())
        inside = np.abs(points - (0, -self.size, 0)).max(axis=1) < SIDE * self.size / 2 - STILL
        self.assertFalse(inside.any())
        yield from undo()
        self.assertEqual(state(field()), before)
        picture = yield from still_picture()
        self.assertLess(colored(picture), 0.02)

    def preview(self) -> Steps:
        """Wait for the first preview, and let the worker rest then."""
        self.worker = self.session.client.pid
        job, seen = self.session.jobs[0], []
        show = job.preview

        def stop(preview: object) -> None:
            show(preview)
            seen.append(True)
            os.kill(self.worker, signal.SIGSTOP)

        job.preview = stop
        self.addCleanup(os.kill, self.worker, signal.SIGCONT)
        yield from hand.until(lambda: bool(seen), SECONDS, "a preview")
        yield 3 * hand.DRAWN


def colored(picture: np.ndarray) -> float:
    """The share of the viewport that has the color of a preview."""
    place = hand.region()
    part = picture[-place.y - place.height : -place.y, place.x : place.x + place.width].astype(int)
    return float((part[..., 0] - part[..., 2] > 60).mean())
