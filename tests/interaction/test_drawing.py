# SPDX-License-Identifier: GPL-3.0-or-later
"""The state machine of drawing, on a surface that needs no Blender: a square of 200 pixels."""

import unittest

import numpy as np

from tests.interaction.support import module

DRAWING = module("interaction.drawing")
Phase = DRAWING.Phase


class Square:
    """A pixel is a hundredth; beside the square there is nothing."""

    def cast(self, mouse):
        x, y = mouse
        return (x / 100, y / 100, 0.0) if max(abs(x), abs(y)) <= 100 else None

    def project(self, point):
        return point[0] * 100, point[1] * 100


SURFACE = Square()


def begin(mouse=(0.0, 0.0), pressure=1.0, spacing=0.0999, **habits):
    habits = DRAWING.Habits(spacing, **habits)
    return DRAWING.Drawing(habits, SURFACE.cast(mouse), mouse, pressure)


def mice(drawing):
    return [tuple(np.round(SURFACE.project(point), 6)) for point in drawing.line.points]


class Freehand(unittest.TestCase):
    def test_from_press_to_release(self) -> None:
        drawing = begin((-50.0, 0.0), 0.25)
        self.assertIs(drawing.phase, Phase.DRAWING)
        for x in range(-49, 50):
            drawing.move(SURFACE, (float(x), 0.0), 0.75)
        drawing.release(SURFACE, (50.0, 0.0))
        self.assertIs(drawing.phase, Phase.DONE)
        np.testing.assert_allclose(mice(drawing), [(x, 0) for x in range(-50, 51, 10)])
        self.assertEqual(drawing.line.pressures, [0.25] + 10 * [0.75])

    def test_so_far_it_reaches_the_pen(self) -> None:
        """And is at each move what it would be if it ended there."""
        for end in (4.0, 14.0, 16.0, 33.0):
            drawing = begin()
            for x in range(1, int(end) + 1):
                drawing.move(SURFACE, (float(x), 0.0), 0.5)
            seen, kept = drawing.so_far, mice(drawing)
            self.assertEqual(seen.points[-1], (end / 100, 0.0, 0.0))
            self.assertEqual(mice(drawing), kept)
            drawing.release(SURFACE, (end, 0.0))
            self.assertEqual(seen.points, drawing.line.points)
            self.assertEqual(seen.pressures, drawing.line.pressures)
            self.assertIs(drawing.so_far, drawing.line)

    def test_leaving_the_surface_adds_nothing(self) -> None:
        drawing = begin((90.0, 0.0))
        for x in range(91, 200):
            drawing.move(SURFACE, (float(x), 0.0))
        drawing.release(DRAWING.Nowhere(), (300.0, 0.0))
        self.assertIs(drawing.phase, Phase.DONE)
        self.assertEqual(mice(drawing), [(90, 0), (100, 0)])

    def test_stabilizer_holds_the_line_back(self) -> None:
        drawing = begin((0.0, 0.0), rope=20.0)
        for x in range(1, 51):
            drawing.move(SURFACE, (float(x), 0.0))
        drawing.release(SURFACE, (50.0, 0.0))
        self.assertEqual(mice(drawing)[-1], (30, 0))

    def test_keys_of_editing_do_nothing_while_drawing(self) -> None:
        drawing = begin()
        drawing.confirm()
        drawing.remove()
        drawing.press(SURFACE, (20.0, 0.0))
        self.assertIs(drawing.phase, Phase.DRAWING)
        self.assertEqual(mice(drawing), [(0, 0)])

    def test_cancel(self) -> None:
        drawing = begin()
        drawing.cancel()
        self.assertIs(drawing.phase, Phase.CANCELLED)

    def test_to_adjust_it_is_simplified_and_waits(self) -> None:
        drawing = begin((-80.0, 0.0), adjust=True)
        for x in range(-80, 81, 2):
            drawing.move(SURFACE, (float(x), 0.5 * abs(x) - 40))
        drawing.release(SURFACE, (80.0, 0.0))
        self.assertIs(drawing.phase, Phase.EDITING)
        self.assertLess(len(drawing.line.points), 6)
        corner = int(np.argmin(np.abs([x for x, _ in mice(drawing)])))
        drawing.press(SURFACE, mice(drawing)[corner])
        drawing.move(SURFACE, (0.0, 60.0))
        drawing.release(SURFACE, (0.0, 60.0))
        self.assertEqual(mice(drawing)[corner], (0, 60))
        drawing.confirm()
        self.assertIs(drawing.phase, Phase.DONE)


class Again(unittest.TestCase):
    def test_a_stroke_is_edited_by_the_points_that_make_it(self) -> None:
        """A right angle, of which the corner is dragged; a pressure between the ends is kept."""
        across = [(x / 20, 0.0, 0.0) for x in range(11)]
        upward = [(0.5, y / 20, 0.0) for y in range(1, 11)]
        pressures = [1.0] * 15 + [0.5] + [1.0] * 5
        drawing = DRAWING.Drawing.again(DRAWING.Habits(0.1), [*across, *upward], pressures)
        self.assertIs(drawing.phase, Phase.EDITING)
        self.assertEqual(mice(drawing)[0], (0, 0))
        self.assertEqual(mice(drawing)[-1], (50, 50))
        self.assertIn((50, 0), mice(drawing))
        self.assertIn(0.5, drawing.line.pressures)
        self.assertLess(len(drawing.line.points), 8)
        drawing.move(SURFACE, (90.0, 90.0))
        drawing.press(SURFACE, (50.0, 1.0))
        drawing.move(SURFACE, (60.0, -10.0))
        drawing.release(SURFACE, (60.0, -10.0))
        self.assertIn((60, -10), mice(drawing))
        self.assertNotIn((50, 0), mice(drawing))
        drawing.confirm()
        self.assertIs(drawing.phase, Phase.DONE)


class Clicks(unittest.TestCase):
    def clicked(self, *places):
        drawing = begin(places[0], clicks=True)
        drawing.release(SURFACE, places[0])
        for place in places[1:]:
            drawing.press(SURFACE, place)
            drawing.release(SURFACE, place)
        return drawing

    def test_points_in_the_order_of_their_coming(self) -> None:
        drawing = self.clicked((0.0, 0.0), (50.0, 0.0), (50.0, 50.0))
        self.assertIs(drawing.phase, Phase.EDITING)
        self.assertEqual(mice(drawing), [(0, 0), (50, 0), (50, 50)])
        drawing.confirm()
        self.assertIs(drawing.phase, Phase.DONE)

    def test_a_new_point_follows_the_held_mouse(self) -> None:
        drawing = begin((0.0, 0.0), clicks=True)
        drawing.move(SURFACE, (30.0, 10.0))
        drawing.release(SURFACE, (30.0, 10.0))
        drawing.move(SURFACE, (60.0, 60.0))
        self.assertEqual(mice(drawing), [(30, 10)])

    def test_dragging_moves_the_nearest_point_alone(self) -> None:
        drawing = self.clicked((0.0, 0.0), (50.0, 0.0), (80.0, 0.0))
        drawing.press(SURFACE, (52.0, 3.0))
        drawing.move(SURFACE, (20.0, -70.0))
        drawing.move(SURFACE, (20.0, -170.0))  # beside the surface
        drawing.release(SURFACE, (20.0, -170.0))
        self.assertEqual(mice(drawing), [(0, 0), (20, -70), (80, 0)])

    def test_a_press_beside_the_surface_is_nothing(self) -> None:
        drawing = self.clicked((0.0, 0.0))
        drawing.press(SURFACE, (0.0, 150.0))
        drawing.move(SURFACE, (0.0, 50.0))
        self.assertEqual(mice(drawing), [(0, 0)])
        self.assertFalse(drawing.dragging)

    def test_removing_the_point_under_the_mouse_or_the_last(self) -> None:
        drawing = self.clicked((0.0, 0.0), (50.0, 0.0), (50.0, 50.0), (0.0, 50.0))
        drawing.move(SURFACE, (51.0, 1.0))
        drawing.remove()
        self.assertEqual(mice(drawing), [(0, 0), (50, 50), (0, 50)])
        drawing.move(SURFACE, (-90.0, -90.0))
        drawing.remove()
        self.assertEqual(mice(drawing), [(0, 0), (50, 50)])

    def test_removing_all_gives_the_stroke_up(self) -> None:
        drawing = self.clicked((0.0, 0.0))
        drawing.remove()
        self.assertIs(drawing.phase, Phase.CANCELLED)
