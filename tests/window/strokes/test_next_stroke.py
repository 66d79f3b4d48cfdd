# SPDX-License-Identifier: GPL-3.0-or-later
"""What the viewport shows of the next stroke: the sides of its profile, its ribbon on any material
and while F widens it, and the relief of an alpha that was chosen in the panel."""

import bpy
import numpy as np
from drawing import (
    INTENSITY,
    PICTURES,
    RADIUS,
    SECONDS,
    WindowCase,
    changed,
    click,
    corner,
    field,
    middle,
    still_picture,
)
from geometry import to_path
from harness import brush_settings, long, module, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Pixel, Steps

MATERIALS = {
    "white": (1.0, 1.0, 1.0),
    "black": (0.0, 0.0, 0.0),
    "orange": (0.9, 0.4, 0.1),
}
SEEN = 24  # of 255; what differs by more is seen


class NextStroke(WindowCase):
    def test_right_of_the_widget_is_right_of_the_stroke(self) -> Steps:
        """A hump is dragged into the right half of the curve: it is to the right of the mouse, and
        of a stroke that is drawn up the screen."""
        yield from self.add()
        brush_settings().profile = "CURVE"
        yield from hand.show_tab("Neural Sculpt")
        store = module("blender.presets.curve_store")
        pictures = []
        for y in (-1.0, 1.0):
            store.set_curve("profile", ((-1, y), (1, y)))
            hand.region("UI").tag_redraw()
            pictures.append((yield from still_picture("UI")))
        left, bottom, right, top = changed(*pictures, hand.region("UI"))
        store.set_curve("profile", ((-1, 0), (0, 0), (0.5, 0), (1, 0)))
        hand.move(middle())
        flat = yield from still_picture()
        place = np.array([left + 0.75 * (right - left), (bottom + top) / 2])
        way = np.linspace(place, (place[0], top - 2), 8)
        yield from hand.drag(map(tuple, way), pause=0.05)
        values = np.array(store.table("profile"))
        self.assertGreater(values[192], 0.9)
        self.assertLess(np.abs(values[:128]).max(), 0.2)
        hand.move(middle())
        hump = yield from still_picture()
        hand.save_png(PICTURES / "profile_under_the_mouse.png", hump)
        first, _, last, _ = changed(flat, hump, hand.region(), least=40)
        self.assertGreater(first, middle()[0] - 3)
        self.assertGreater(last, middle()[0] + 20)
        path = self.arc()[:, [2, 1, 0]]  # upwards
        yield from self.draw(path)
        heights, points = self.heights(), vertices(field())
        near = to_path(points, path[3:-3]) < 0.75 * RADIUS  # off the ends, which are round
        for side, height in ((1, INTENSITY), (-1, 0.0)):
            beside = near & (np.abs(points[:, 0] - side * RADIUS / 2) < 0.2 * RADIUS)
            self.assertAlmostEqual(heights[beside].max(), height, delta=0.2 * INTENSITY)

    def test_the_surface_follows_f(self) -> Steps:
        """While the mouse widens the brush the stroke through clicked points is as wide, before
        anything is confirmed; Esc makes it narrow again."""
        yield from self.add()
        at = yield from self.click_points()
        narrow = self.raised()
        self.assertGreater(narrow, 5)
        yield from self.widen(at)
        wide = self.raised()
        self.assertGreater(wide, 1.5 * narrow)
        hand.tap("ESC", at)
        yield 3 * hand.DRAWN
        hand.move((at[0] + 1, at[1]))
        yield 3 * hand.DRAWN
        self.assertEqual(self.raised(), narrow)

    @long
    def test_the_ribbon_on_every_material(self) -> Steps:
        """Of a stroke that smooths: its lines are lighter and darker than what they lie on, and it
        widens with F while that is dragged."""
        yield from self.add()
        brush_settings().kind = "SMOOTH"
        shading = hand.view().shading
        shading.color_type = "OBJECT"
        bpy.context.preferences.system.viewport_aa = "5"  # or some pictures have an outline
        hand.view().overlay.show_outline_selected = False
        for name, color in MATERIALS.items():
            field().color = (*color, 1.0)
            hand.move(corner())
            plain = yield from still_picture()
            at = yield from self.click_points()
            shown = yield from still_picture()
            hand.save_png(PICTURES / f"ribbon_{name}.png", shown)
            left, bottom, right, top = changed(plain, shown, hand.region())
            ends = hand.to_window(self.arc()[[0, -1]])
            self.assertAlmostEqual(left, ends[0][0], delta=15)
            self.assertAlmostEqual(right, ends[1][0], delta=15)
            self.assert_two_tones(plain, shown, (left + right) / 2, name)
            if name != "white":
                self.assertGreater(light_columns(plain, shown, left, right, top), 0.98, name)
            if name == "grey":
                yield from self.widen(at)
                wider = yield from still_picture()
                hand.save_png(PICTURES / "ribbon_wider.png", wider)
                _, low, _, high = changed(plain, wider, hand.region())
                self.assertGreater(high - low, 1.5 * (top - bottom))
                hand.tap("ESC", at)
                yield 3 * hand.DRAWN
            hand.tap("ESC", at)
            yield 3 * hand.DRAWN

    def test_an_alpha_chosen_in_the_panel(self) -> Steps:
        """By two clicks; the surface has its relief under the pen, and has it in the end."""
        yield from self.add()
        view = bpy.context.preferences.view
        self.addCleanup(setattr, view, "ui_scale", view.ui_scale)
        view.ui_scale = 0.6
        yield from hand.show_tab("Neural Sculpt")
        brush, pictures = brush_settings(), []
        for alpha in ("STAR", "NONE"):
            brush.alpha = alpha
            hand.region("UI").tag_redraw()
            pictures.append((yield from still_picture("UI")))
        left, _, _, top = changed(*pictures, hand.region("UI"))
        button = left + 8, top - 8
        yield from click(button)
        popup = yield from still_picture()
        hand.save_png(PICTURES / "alpha_choices.png", popup)
        left, bottom, right, top = changed(pictures[1], popup, hand.region())
        self.assertEqual(brush.alpha, "NONE")
        yield from click((left + 5.5 * (right - left) / 8, (bottom + top) / 2))  # of eight pictures
        yield from hand.until(lambda: brush.alpha == "STAR", SECONDS, "stars")
        path = self.arc()
        yield from self.pen_down(path)
        shown = yield from still_picture()
        hand.save_png(PICTURES / "alpha_under_the_pen.png", shown)
        along = to_path(vertices(field()), path[2:-2]) < 0.25 * RADIUS
        under_pen = self.heights()[along]
        hand.release(hand.to_window(path)[-1])
        yield from self.strokes_are(1)
        result = self.heights()[to_path(vertices(field()), path[2:-2]) < 0.25 * RADIUS]
        self.assertGreater(np.ptp(under_pen), 0.3 * INTENSITY)
        self.assertAlmostEqual(under_pen.mean(), result.mean(), delta=0.15 * INTENSITY)

    def click_points(self) -> Steps:
        """Click control points along the arc, and leave them; where the mouse is then."""
        clicks = hand.to_window(self.arc()[::7])
        yield from self.set_points(clicks)
        at = clicks[1][0], clicks[1][1] - 150
        hand.move(at)
        yield 3 * hand.DRAWN
        return at

    def widen(self, at: Pixel) -> Steps:
        """Press F and move the mouse to the right, by the radius."""
        one, other = hand.to_window([(0, -self.size, 0), (RADIUS, -self.size, 0)])
        radius = brush_settings().radius
        hand.tap("F", at)
        yield 3 * hand.DRAWN
        for step in np.linspace(0, other[0] - one[0], 6)[1:]:
            hand.move((at[0] + step, at[1]))
            yield hand.DRAWN
        yield from hand.until(lambda: brush_settings().radius > 1.8 * radius, SECONDS, "a radius")
        yield 3 * hand.DRAWN

    def raised(self) -> int:
        """How many vertices the preview has raised."""
        return int((self.heights() > 0.2 * INTENSITY).sum())

    def assert_two_tones(
        self, plain: np.ndarray, shown: np.ndarray, x: float, material: str
    ) -> None:
        """Across the ribbon at a column of the window there is what is lighter than the surface and
        what is darker, one of them by far."""
        column = slice(int(x) - 30, int(x) - 20)  # beside the middle knot
        row = shown.shape[0] - int(middle()[1])
        part = slice(row - 60, row + 60), column
        differs = shown[part].mean(axis=2) - plain[part].mean(axis=2)
        lighter, darker = differs.max(), -differs.min()
        self.assertGreater(max(lighter, darker), 3 * SEEN, material)


def light_columns(plain: np.ndarray, shown: np.ndarray, left: int, right: int, top: int) -> float:
    """The share of the columns of a ribbon whose upper line is there, lighter than the surface."""
    row = shown.shape[0] - top
    part = slice(row - 4, row + 12), slice(left + 15, right - 15)
    lighter = shown[part].astype(int).mean(axis=2) - plain[part].mean(axis=2)
    return float((lighter.max(axis=0) > SEEN).mean())
