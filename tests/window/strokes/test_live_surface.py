# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface moves under the pen, comes back when the stroke is given up, and does not jump when
it ends: pictures while the pen is down, after its release, and of the result."""

import bpy
import numpy as np
from drawing import (
    INTENSITY,
    PICTURES,
    RADIUS,
    SECONDS,
    WindowCase,
    choose_tool,
    enter_sculpt_mode,
    field,
    middle,
    operate,
    still_picture,
)
from geometry import to_path
from harness import long, module, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

STRONG = 24  # of 255; shading that differs by more is seen
SKY = 3  # likewise, of what is not the background
FACETS = 0.004  # model space; how far the proxy's triangles lie from the sphere


class LiveSurface(WindowCase):
    def assert_under_pen(self, path: np.ndarray) -> None:
        """Raised by the intensity along the path, and the sphere elsewhere."""
        heights = self.heights()
        on_sphere = vertices(field()) * (self.size / (self.size + heights))[:, None]
        distance = to_path(on_sphere, path)
        self.assertAlmostEqual(heights[distance < 0.2 * RADIUS].min(), INTENSITY, delta=0.012)
        self.assertLess(np.abs(heights[distance > 1.1 * RADIUS]).max(), 0.002)

    def plain(self) -> None:
        """Nothing in the viewport but the surface."""
        overlay = module("blender.viewport.overlay")
        overlay.unregister()
        self.addCleanup(overlay.register)
        hand.view().overlay.show_overlays = False
        hand.view().show_gizmo = False

    def pictures(self, name: str) -> Steps:
        """The viewport from the front and from above, (2, H, W, 3)."""
        seen, place = [], hand.region()
        for rotation in (hand.FRONT, hand.TOP):
            hand.look(rotation)
            picture = yield from still_picture()
            rows = slice(-place.y - place.height, -place.y or None)
            seen.append(picture[rows, place.x : place.x + place.width])
            side = "front" if rotation is hand.FRONT else "top"
            hand.save_png(PICTURES / f"live_{field().mode.lower()}_{name}_{side}.png", seen[-1])
        hand.look()
        yield hand.DRAWN
        return np.array(seen)

    def no_jump(self) -> Steps:
        """Three pictures that must be one: within a pixel along the silhouette, and in shading."""
        self.plain()
        field().hide_set(True)
        sky = yield from self.pictures("sky")
        field().hide_set(False)
        bpy.context.view_layer.objects.active = field()
        before = yield from self.pictures("before")
        path = self.arc(spread=0.6)
        self.stop_worker()
        yield from self.pen_down(path)
        down = yield from self.pictures("down")
        last = hand.to_window(path)[-1]
        hand.release(last)
        yield 3 * hand.DRAWN
        self.assertTrue(self.session.jobs)
        up = yield from self.pictures("up")
        self.go_on()
        yield from self.strokes_are(1)
        result = yield from self.pictures("result")

        def edge(seen: np.ndarray) -> np.ndarray:
            """The lowest row of the shape in each column (W,), seen from above; -1 without one."""
            shape = np.abs(seen[1].astype(int) - sky[1]).max(axis=2) > SKY
            return np.where(shape.any(axis=0), len(shape) - 1 - shape[::-1].argmax(axis=0), -1)

        def shaded(one: np.ndarray, other: np.ndarray) -> float:
            """The share of the shape's pixels, seen from the front, that differ strongly."""
            shape = (np.abs(one[0].astype(int) - sky[0]).max(axis=2) > SKY).sum()
            return (np.abs(one[0].astype(int) - other[0]).max(axis=2) > STRONG).sum() / shape

        for name, one, other in (("release", down, up), ("result", up, result)):
            self.assertLessEqual(apart(edge(one), edge(other), len(sky[1])), 1, name)
            self.assertLess(np.abs(edge(one) - edge(other)).mean(), 0.25, name)
            self.assertLess(shaded(one, other), 0.01, name)
        self.assertGreater(apart(edge(before), edge(down), len(sky[1])), 10)
        self.assertGreater(shaded(before, down), 0.03)

    def test_nothing_jumps(self) -> Steps:
        yield from self.add()
        yield from self.no_jump()

    @long
    def test_nothing_jumps_in_sculpt_mode(self) -> Steps:
        yield from self.add()
        yield from enter_sculpt_mode()
        choose_tool()
        yield hand.DRAWN
        yield from self.no_jump()

    def test_escape_brings_the_surface_back(self) -> Steps:
        """And the right mouse button; drawn or clicked."""
        yield from self.add()
        before, path = state(field()), self.arc()
        for key in ("ESC", "RIGHTMOUSE"):
            yield from self.pen_down(path)
            self.assert_under_pen(path)
            last = hand.to_window(path)[-1]
            hand.tap(key, last)
            yield hand.DRAWN
            self.assertEqual(state(field()), before)
            hand.release(last)
            yield hand.DRAWN

    @long
    def test_many_copies(self) -> Steps:
        """Of a stroke repeated about the axis that looks at the artist each piece of work is of
        bounded size, also at its end, and all copies are seen before there is a result."""
        yield from self.add()
        if hasattr(field().data, "radial_symmetry"):
            field().data.radial_symmetry = (1, 8, 1)
        else:  # before 5.0 the setting is Sculpt Mode's, which is there once that was entered
            bpy.ops.object.mode_set(mode="SCULPT")
            yield hand.DRAWN
            choose_tool()
            bpy.context.scene.tool_settings.sculpt.radial_symmetry = (1, 8, 1)
        preview, displaced = module("blender.scene.mesh.preview"), module("interaction.displaced")
        budgets, advance = [], displaced.Displaced.advance

        def noted(shape: object, most: int | None = None) -> int:
            unfinished = shape.seen is not shape.strokes
            looked = advance(shape, most)
            budgets.append((most, looked)) if unfinished else None
            return looked

        displaced.Displaced.advance = noted
        self.addCleanup(setattr, displaced.Displaced, "advance", advance)
        path = self.arc(0.6, 0.1)
        self.stop_worker()
        yield from self.pen_down(path)
        hand.release(hand.to_window(path)[-1])
        yield 3 * hand.DRAWN
        yield from hand.until(preview.preview.catch_up, SECONDS, "the surface")
        self.assertTrue(self.session.jobs)
        self.assertGreater(len(budgets), 8)
        most_looked_at = preview.MOST_LOOKED_AT
        self.assertLessEqual({most for most, _ in budgets}, {0, most_looked_at})
        self.assertLessEqual(max(looked for _, looked in budgets), most_looked_at + displaced.PIECE)
        hand.save_png(PICTURES / "live_many_copies.png", (yield from still_picture()))
        heights, points = self.heights(), vertices(field())
        for turn in np.arange(8) * np.pi / 4:
            c, s = np.cos(turn), np.sin(turn)
            turned = path @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
            near = to_path(points, turned * (1 + INTENSITY / self.size)) < 0.2 * RADIUS
            self.assertAlmostEqual(heights[near].max(), INTENSITY, delta=0.012)
        self.go_on()
        yield from self.strokes_are(1)

    def test_control_points(self) -> Steps:
        """A dab, a line, dragged; an undo step of something else meanwhile; given up."""
        yield from self.add()
        before, path = state(field()), self.arc()
        clicks = hand.to_window(path[::7])
        yield from self.set_points(clicks)
        self.assert_under_pen(path)
        with module("blender.scene.commit").in_window():
            bpy.ops.ed.undo_push(message="Something else")
            bpy.ops.ed.undo()
        yield 3 * hand.DRAWN
        hand.move(clicks[1])
        yield 3 * hand.DRAWN
        self.assert_under_pen(path)
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "field.blend"), copy=True)
        hand.move(clicks[0])
        yield 3 * hand.DRAWN
        self.assert_under_pen(path)
        hand.tap("ESC", clicks[0])
        yield hand.DRAWN
        self.assertEqual(state(field()), before)
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "field.blend"))
        yield hand.DRAWN
        self.assertEqual(state(field()), before)

    def test_another_tool_or_mode_meanwhile(self) -> Steps:
        """In Sculpt Mode with another tool in hand nothing is shown; nor in Edit Mode."""
        yield from self.add()
        before, path = state(field()), self.arc()
        clicks = hand.to_window(path[::7])
        yield from self.set_points(clicks)
        operate(bpy.ops.object.mode_set, "EXEC_DEFAULT", mode="SCULPT")
        choose_tool("builtin.brush")
        yield hand.DRAWN
        hand.move(clicks[1])
        yield 3 * hand.DRAWN
        self.assertEqual(state(field()), before)
        choose_tool()
        hand.move(clicks[0])
        yield 3 * hand.DRAWN
        yield from self.caught_up()
        self.assert_under_pen(path)
        operate(bpy.ops.object.mode_set, "EXEC_DEFAULT", mode="OBJECT")
        hand.tap("ESC", clicks[0])
        yield hand.DRAWN
        self.assertEqual(state(field()), before)

    def test_another_file_is_loaded_meanwhile(self) -> Steps:
        """The drawing ends; the file that was open has not changed on disk."""
        yield from self.add()
        before, file = state(field()), str(self.folder / "field.blend")
        bpy.ops.wm.save_as_mainfile(filepath=file)
        yield from self.pen_down(self.arc())
        bpy.ops.wm.open_mainfile(filepath=file)
        yield 3 * hand.DRAWN
        self.assertEqual(state(field()), before)
        hand.release(middle())
        yield hand.DRAWN
        self.assertFalse(self.session.jobs)

    def test_the_pen_stays_on_what_it_draws_on(self) -> Steps:
        """Back and forth over the same place: the points do not climb on their own stroke."""
        yield from self.add()
        there = self.arc()
        path = np.vstack([there, there[::-1], there])
        yield from self.pen_down(path)
        hand.release(hand.to_window(path)[-1])
        yield from self.strokes_are(1)
        uid = field().neural_sculpt.strokes[0].uid
        points = module("blender.scene.stroke_list").stroke_of(field(), uid).points
        self.assertLess(np.abs(np.linalg.norm(points, axis=1) - self.size).max(), FACETS)


def apart(one: np.ndarray, other: np.ndarray, height: int) -> int:
    """How many pixels lie between two outlines, at most: the lowest rows (W,) of two shapes."""
    shapes = [np.arange(height)[:, None] <= edge for edge in (one, other)]  # (H, W)
    grown, pixels = [*shapes], 0
    while (shapes[0] & ~grown[1]).any() or (shapes[1] & ~grown[0]).any():
        grown, pixels = [_grown(shape) for shape in grown], pixels + 1
    return pixels


def _grown(shape: np.ndarray) -> np.ndarray:
    """A shape (H, W) and the pixels beside it."""
    (rows, columns), padded = shape.shape, np.pad(shape, 1)
    shifts = [(i, j) for i in range(3) for j in range(3)]
    return np.logical_or.reduce([padded[i : i + rows, j : j + columns] for i, j in shifts])
