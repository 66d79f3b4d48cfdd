# SPDX-License-Identifier: GPL-3.0-or-later
"""Neural Boolean with its dialog: the viewport shows what each operation comes to before it is
confirmed, and while the worker is at it, and Ctrl Z takes it back."""

import os
import signal

import bpy
import numpy as np
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
from harness import long, module, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

SIDE = 0.6  # of the cube, in radii of the sphere


class BooleanDialog(WindowCase):
    def beside(self, *location: float) -> Steps:
        """A sphere field, active, and a cube that is selected, too; the location is in radii."""
        yield from self.add()
        bpy.ops.mesh.primitive_cube_add(
            size=SIDE * self.size, location=[self.size * x for x in location]
        )
        hand.window().view_layer.objects.active = field()
        field().select_set(True)
        bpy.ops.ed.undo_push(message="Cube")

    def open(self, place: hand.Pixel) -> Steps:
        """The dialog, and wait for its preview."""
        hand.move(place)
        yield hand.DRAWN
        operate(bpy.ops.neural_sculpt.boolean)
        yield from self.seen()

    def seen(self) -> Steps:
        """The viewport, when the dialog's preview is there."""
        yield 2 * hand.DRAWN
        yield from hand.until(lambda: self.session.behind is None, SECONDS, "a preview")
        return (yield from still_picture())

    @long
    def test_what_it_comes_to_is_seen_before_it_is_confirmed(self) -> Steps:
        """And nothing else has changed after Esc."""
        yield from self.beside(1, 0, 0)
        before, plain = state(field()), (yield from still_picture())
        place = corner()
        for _ in range(2):
            yield from self.open(place)
            union = yield from still_picture()
            hand.save_png(PICTURES / "boolean_union_seen.png", union)
            yield from click(place)
            hand.tap("D", place)
            difference = yield from self.seen()
            hand.save_png(PICTURES / "boolean_difference_seen.png", difference)
            yield from click(place)
            hand.tap("I", place)
            intersection = yield from self.seen()
            hand.save_png(PICTURES / "boolean_intersection_seen.png", intersection)
            areas = [colored(picture) for picture in (intersection, difference, union)]
            self.assertGreater(areas[0], 0.003)
            self.assertGreater(areas[1], 3 * areas[0])
            self.assertGreater(areas[2], 1.02 * areas[1])
            hand.tap("ESC", place)
            self.assertLess(colored((yield from still_picture())), max(0.01, colored(plain)))
            self.assertEqual(state(field()), before)

    def test_why_it_comes_to_nothing_is_told(self) -> Steps:
        """A cube that reaches out of the field's box; its difference does not."""
        yield from self.beside(1.4, 0, 0)
        place = corner()
        yield from self.open(place)
        picture = yield from still_picture()
        hand.save_png(PICTURES / "boolean_problem.png", picture)
        self.assertLess(colored(picture), 0.02)
        self.assertIn("leave the box", hint())
        yield from click(place)
        hand.tap("D", place)
        picture = yield from self.seen()
        self.assertGreater(colored(picture), 0.1)
        self.assertIsNone(hint())
        yield from click(place)
        hand.tap("U", place)
        yield from self.seen()
        self.assertIn("leave the box", hint())
        hand.tap("ESC", place)
        yield 3 * hand.DRAWN
        self.assertIsNone(hint())

    def test_difference(self) -> Steps:
        yield from self.beside(0, -1, 0)
        before = state(field())
        plain = yield from still_picture()
        self.assertLess(colored(plain), 0.02)
        x, y = middle()
        yield from self.open((x, y))
        yield from click((x, y))  # the operation is under the mouse
        hand.save_png(PICTURES / "boolean_operations.png", (yield from still_picture()))
        hand.tap("D", (x, y))  # for Difference
        yield from self.seen()
        self.stop_worker()  # or a busy Blender would not see the job before its end
        hand.tap("RET", corner())
        yield from hand.until(lambda: bool(self.session.jobs), SECONDS, "a job")
        yield from self.preview()
        shown = yield from still_picture()
        hand.save_png(PICTURES / "boolean_preview.png", shown)
        self.assertGreater(colored(shown), 0.1)
        self.assertTrue(self.session.jobs)
        self.go_on()
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
        """Let the worker go on to its first preview, and rest then."""
        job, seen = self.session.jobs[0], []
        show = job.preview

        def stop(preview: object) -> None:
            show(preview)
            seen.append(True)
            os.kill(self.worker, signal.SIGSTOP)

        job.preview = stop
        self.go_on()
        yield from hand.until(lambda: bool(seen), SECONDS, "a preview")
        yield 3 * hand.DRAWN


def hint() -> str | None:
    """What the status bar says while something is going on."""
    return module("blender.panels.status_bar").shown_hint()


def colored(picture: np.ndarray) -> float:
    """The share of the viewport that has the color of a preview."""
    place = hand.region()
    part = picture[-place.y - place.height : -place.y, place.x : place.x + place.width].astype(int)
    return float((part[..., 0] - part[..., 2] > 60).mean())
