# SPDX-License-Identifier: GPL-3.0-or-later
"""The points of a stroke of the history are edited, and by F and Shift F its radius and intensity:
the surface shows where it will be, and the brush of the next stroke stays what it was."""

import bpy
import numpy as np
from drawing import (
    INTENSITY,
    PICTURES,
    RADIUS,
    SECONDS,
    WindowCase,
    field,
    middle,
    operate,
    undo,
)
from harness import brush_settings, long, module, state, strokes_of
from in_blender import simulated_input as hand
from in_blender.simulated_input import Pixel, Steps

changed_stroke = module("blender.viewport.changed_stroke")
WIDER, HIGHER = 0.05, -0.1  # what is added to the radius and the intensity


class EditPoints(WindowCase):
    def begin(self) -> Steps:
        """Edit the points of a stroke; the pixel in its middle."""
        yield from self.add()
        yield from self.draw(self.arc())
        self.drawn = state(field())
        (x, y), *_ = hand.to_window([(0, -self.size, 0)])
        self.pixels = hand.to_window([(1, -self.size, 0)])[0][0] - x
        hand.move((x, y + 60))
        yield hand.DRAWN
        operate(bpy.ops.neural_sculpt.draw, uid=field().neural_sculpt.strokes[0].uid)
        yield 3 * hand.DRAWN
        return x, y + 60

    def resize(self, at: Pixel, by: float, held: hand.Held = (), key: str = "LEFTMOUSE") -> Steps:
        """Press F, move by model units, and end it."""
        hand.tap("F", at, held)
        yield hand.DRAWN
        to = at[0] + by * self.pixels, at[1]
        hand.move(to)
        yield 3 * hand.DRAWN
        self.amid = changed_stroke.shown()
        hand.tap(key, to)
        yield 3 * hand.DRAWN
        hand.move(at)
        yield 3 * hand.DRAWN

    def test_radius_and_intensity(self) -> Steps:
        at = yield from self.begin()
        self.assertIsNone(changed_stroke.shown())
        yield from self.resize(at, WIDER)
        self.assertAlmostEqual(self.amid.stroke.brush.radius, RADIUS + WIDER, delta=3e-3)
        widths = [
            np.linalg.norm(r.points[:, 0] - r.points[:, -1], axis=1) for r in self.amid.ribbons
        ]
        self.assertAlmostEqual(np.median(widths[0]), 2 * (RADIUS + WIDER), delta=0.02)
        yield from self.resize(at, HIGHER, ("shift",))
        yield from self.resize(at, 0.1, key="ESC")  # as before
        brush = changed_stroke.shown().stroke.brush
        self.assertAlmostEqual(brush.radius, RADIUS + WIDER, delta=3e-3)
        self.assertAlmostEqual(brush.intensity, INTENSITY + HIGHER, delta=3e-3)
        hand.save_png(PICTURES / "edit_points_lengths.png", hand.screen_pixels())
        self.assertEqual(state(field()), self.drawn)
        hand.tap("RET", at)
        yield from hand.until(lambda: state(field()) != self.drawn, SECONDS, "a replay")
        yield from self.idle()
        self.assertIsNone(changed_stroke.shown())
        (stroke,) = strokes_of(field())
        self.assertAlmostEqual(stroke["radius"], brush.radius, places=6)
        self.assertAlmostEqual(stroke["intensity"], brush.intensity, places=6)
        self.assert_raised(self.arc(), by=brush.intensity)
        self.assertAlmostEqual(brush_settings().radius, RADIUS, places=6)
        self.assertAlmostEqual(brush_settings().intensity, INTENSITY, places=6)
        yield from self.resize(at, WIDER)  # the artist's own again
        self.assertAlmostEqual(brush_settings().radius, RADIUS + WIDER, delta=3e-3)
        yield from undo()
        self.assertEqual(state(field()), self.drawn)

    @long
    def test_another_field_is_active_by_now(self) -> Steps:
        """As when one that was fitted meanwhile is ready: the points reach their own."""
        at = yield from self.begin()
        yield from self.resize(at, WIDER)
        operate(bpy.ops.neural_sculpt.add, kind="TORUS")
        yield from hand.until(lambda: "Torus" in bpy.data.objects, SECONDS, "another field")
        self.assertEqual(bpy.context.active_object, bpy.data.objects["Torus"])
        hand.tap("RET", at)
        yield from hand.until(lambda: state(field()) != self.drawn, SECONDS, "a replay")
        yield from self.idle()
        self.assertAlmostEqual(strokes_of(field())[0]["radius"], RADIUS + WIDER, delta=3e-3)
        self.assertEqual(strokes_of(bpy.data.objects["Torus"]), [])

    @long
    def test_the_stroke_has_left_the_history(self) -> Steps:
        """Nothing is replayed, and a sentence says why."""
        at = yield from self.begin()
        yield from self.resize(at, WIDER)
        operate(bpy.ops.neural_sculpt.apply_to_base, "EXEC_DEFAULT")
        yield from self.idle()
        applied = state(field())
        hand.tap("RET", at)
        yield 3 * hand.DRAWN
        self.assertFalse(self.session.jobs)
        self.assertEqual(state(field()), applied)
        self.assertIsNone(changed_stroke.shown())

    @long
    def test_a_menu_maximizes_the_area(self) -> Steps:
        """The operator's own area is gone then, and beside all areas the mouse has none."""
        at = yield from self.begin()
        yield from self.resize(at, WIDER)
        full = {"window": hand.window(), "area": hand.view_area()}
        with bpy.context.temp_override(**full, region=hand.region()):
            bpy.ops.screen.screen_full_area(use_hide_panels=False)
        yield 3 * hand.DRAWN
        height, _, _ = hand.screen_pixels().shape
        for x in (400, 420):
            hand.move((x, height - 3))
            yield hand.DRAWN
        at = middle()
        hand.move(at)
        yield hand.DRAWN
        hand.tap("RET", at)
        yield from hand.until(lambda: state(field()) != self.drawn, SECONDS, "a replay")
        yield from self.idle()
        self.assertAlmostEqual(strokes_of(field())[0]["radius"], RADIUS + WIDER, delta=3e-3)

    def test_escape_leaves_the_stroke_as_it_was(self) -> Steps:
        at = yield from self.begin()
        yield from self.resize(at, WIDER)
        hand.tap("LEFT_BRACKET", at)
        yield 3 * hand.DRAWN
        brush = changed_stroke.shown().stroke.brush
        self.assertAlmostEqual(brush.radius, 0.8 * (RADIUS + WIDER), delta=3e-3)
        hand.tap("ESC", at)
        yield 3 * hand.DRAWN
        yield from self.idle()
        self.assertIsNone(changed_stroke.shown())
        self.assertEqual(state(field()), self.drawn)
        hand.tap("RIGHT_BRACKET", at)
        yield 3 * hand.DRAWN
        self.assertAlmostEqual(brush_settings().radius, 1.25 * RADIUS, places=5)

    def test_a_point_that_is_dragged_is_followed(self) -> Steps:
        """By the ribbon, while the surface still has the stroke where it was."""
        yield from self.begin()
        ends = hand.to_window(self.arc()[[-1]])[0]
        above = hand.to_window(self.arc(0.5)[[-1]])[0]
        hand.move(ends)
        yield hand.DRAWN
        hand.press(ends)
        for share in (0.3, 0.6, 1.0):
            yield hand.DRAWN
            hand.move(tuple(np.array(ends) + share * (np.array(above) - ends)))
        yield 3 * hand.DRAWN
        ribbon = changed_stroke.shown().ribbons[0].points
        away = np.linalg.norm(ribbon.reshape(-1, 3) - self.arc(0.5)[-1], axis=1)
        self.assertLess(away.min(), 0.1)
        hand.save_png(PICTURES / "edit_points_dragged.png", hand.screen_pixels())
        hand.release(above)
        hand.tap("ESC", above)
        yield 3 * hand.DRAWN
        self.assertIsNone(changed_stroke.shown())
        self.assertEqual(state(field()), self.drawn)
