# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests in a window share: an artist's hand on a sphere field, and numbers to check.

The sphere is seen from the front, so a stroke on it faces -Y. Model space is the world's.
"""

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import bpy
import harness
import numpy as np
from bpy.types import Object
from geometry import to_path
from harness import brush_settings, module, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from numpy.typing import NDArray

Array = NDArray[np.float64]

PICTURES = Path(sys.argv[sys.argv.index("--") + 2])
"""The folder for pictures, of this Blender."""
SECONDS = 120  # for anything to happen, on a computer that is busy
RADIUS, INTENSITY = 0.12, 0.06
NEAR, FAR = 0.35, 1.35  # radii from the path: within, the stroke is high; beyond, nothing moved
STILL = 0.006  # how far the surface may stray where nothing was drawn
RESOLUTION = 64
REST = 1.0  # seconds of the mouse on an entry of a menu, after which that has opened
BRUSHES = "brushes/essentials_brushes-mesh_sculpt.blend/Brush/"
"""Blender's own, in its asset library."""


class WindowCase(harness.SculptCase):
    """Starts each test with an empty scene, seen from the front."""

    absorbs_live = False
    """Whether strokes of Blender's own brushes are absorbed by themselves."""

    def setUp(self) -> None:
        super().setUp()
        if not self.absorbs_live:
            live = module("blender.session.absorption.live")
            live.unregister()
            self.addCleanup(live.register)
        bpy.context.preferences.addons[harness.EXTENSION].preferences.resolution = RESOLUTION
        bpy.context.preferences.system.viewport_aa = "OFF"  # or each picture is drawn eight times
        hand.look()
        brush = brush_settings()
        brush.radius, brush.intensity = RADIUS, INTENSITY
        choose_tool()

    def add(self, kind: str = "SPHERE") -> Steps:
        """Add a field and wait for it."""
        operate(bpy.ops.neural_sculpt.add, kind=kind)
        yield from self.idle()
        yield hand.DRAWN
        self.size = np.linalg.norm(vertices(field()), axis=1).mean()

    def idle(self) -> Steps:
        """Wait until the worker has nothing to do."""
        yield from hand.until(self.is_idle, SECONDS, "an idle worker")
        self.assertEqual(self.session.last_error, "")

    def is_idle(self) -> bool:
        """Whether every job has ended, and the last stroke is measured."""
        return self.session.rests and self.session.behind is None

    def arc(self, tilt: float = 0.0, spread: float = 0.5) -> Array:
        """Points (15, 3) over the front of the sphere from left to right; `tilt` is upward."""
        angle = np.linspace(-spread, spread, 15)
        level = np.stack([np.sin(angle), -np.cos(angle), 0 * angle], 1)
        c, s = np.cos(tilt), np.sin(tilt)
        return self.size * level @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])

    def draw(self, path: Array, held: hand.Held = ()) -> Steps:
        """Draw a freehand stroke with the tool through points (K, 3) and wait for the field."""
        count = len(field().neural_sculpt.strokes)
        yield from hand.drag(hand.to_window(path), held)
        yield from self.strokes_are(count + 1)

    def pen_down(self, path: Array) -> Steps:
        """Draw through points (K, 3) and hold the pen there until the surface has caught up."""
        first, *others = hand.to_window(path)
        hand.move(first)
        hand.press(first)
        for place in others:
            yield 0.02
            hand.move(place)
        yield from self.caught_up()
        yield 2 * hand.DRAWN

    def caught_up(self) -> Steps:
        """Until the surface shows all that was drawn."""
        yield from hand.until(
            module("blender.scene.mesh.preview").preview.catch_up, SECONDS, "the surface"
        )

    def set_points(self, places: Sequence[hand.Pixel]) -> Steps:
        """Set control points, with P and then by clicks, in window pixels."""
        for number, place in enumerate(places):
            hand.move(place)
            hand.tap("LEFTMOUSE" if number else "P", place)
            yield 3 * hand.DRAWN

    def strokes_are(self, count: int) -> Steps:
        """Wait until the field has that many strokes and nothing is left to do."""

        def ended() -> bool:
            return len(field().neural_sculpt.strokes) == count or bool(self.session.last_error)

        yield from hand.until(ended, SECONDS, f"{count} strokes")
        yield from self.idle()

    def stop_worker(self) -> None:
        """Let it do nothing until it may go on, be it at the end of the test."""
        self.worker = self.session.client.pid
        os.kill(self.worker, signal.SIGSTOP)
        self.addCleanup(self.go_on)

    def go_on(self) -> None:
        """Let the worker do what it is to do, unless another one has taken its place."""
        with suppress(ProcessLookupError):
            os.kill(self.worker, signal.SIGCONT)

    def undo_and_redo(self, states: Sequence[tuple[object, ...]]) -> Steps:
        """Ctrl Z takes the field back through all its states, and Shift Ctrl Z brings them back."""
        for expected in states[-2::-1]:
            yield from undo()
            self.assertEqual(state(field()), expected)
        for expected in states[1:]:
            yield from redo()
            self.assertEqual(state(field()), expected)

    def native(self, tilt: float) -> Steps:
        """Draw along an arc with Blender's own brush."""
        choose_native_brush()
        yield hand.DRAWN
        before = vertices(field())
        yield from hand.drag(hand.to_window(self.arc(tilt)), pause=0.03)
        yield from hand.until(lambda: moved_since(before), SECONDS, "a native stroke")
        yield 3 * hand.DRAWN

    def heights(self) -> Array:
        """How far each vertex of the proxy (V,) lies above the sphere that it was."""
        return np.linalg.norm(vertices(field()), axis=1) - self.size

    def assert_raised(self, *paths: Array, by: float | tuple[float, ...] = INTENSITY) -> None:
        """The surface is higher by `by` along the middle of each path, and nowhere else."""
        heights = self.heights()
        points = vertices(field()) * (self.size / (self.size + heights))[:, None]  # on the sphere
        distance = np.full(len(points), np.inf)
        for path, height in zip(paths, np.broadcast_to(by, len(paths)), strict=True):
            inner = to_path(points, path[2:-2]) < NEAR * RADIUS  # off the ends of the stroke
            self.assertGreater(inner.sum(), 5)
            reached = heights[inner] / height
            self.assertAlmostEqual(reached.max(), 1.0, delta=0.15)
            self.assertGreater(reached.min(), 0.4)
            distance = np.minimum(distance, to_path(points, path))
        still = heights[distance > FAR * RADIUS]
        self.assertGreater(len(still), len(points) / 2)
        self.assertLess(np.abs(still).max(), STILL)

    def assert_untouched(self) -> None:
        """The field is the sphere that it was."""
        self.assertLess(np.abs(self.heights()).max(), STILL)


def field() -> Object:
    """The field that was added, which no reference outlives; duplicates come after it."""
    return next(ob for ob in bpy.data.objects if ob.neural_sculpt.revision)


def edited() -> bool:
    """Whether other brushes have sculpted its proxy."""
    return module("blender.scene.mesh.native_edits").edited(field())


def moved_since(before: Array) -> bool:
    """Whether the vertices of the proxy are others than those (V, 3)."""
    return not np.array_equal(vertices(field()), before)


def choose_tool(name: str = "neural_sculpt.tool") -> None:
    """Choose a tool of the toolbar."""
    operate(bpy.ops.wm.tool_set_by_id, name=name)


def enter_sculpt_mode() -> Steps:
    """Choose it from the menu of Ctrl Tab."""
    hand.move(middle())
    hand.tap("TAB", middle(), ("ctrl",))
    yield 3 * hand.DRAWN
    hand.tap("S", middle())
    yield from hand.until(lambda: field().mode == "SCULPT", SECONDS, "Sculpt Mode")
    yield hand.DRAWN


def choose_native_brush() -> None:
    """Take one of Blender's in hand."""
    choose_tool("builtin.brush")
    if bpy.context.tool_settings.sculpt.brush is None:
        take_native_brush("Draw")


def take_native_brush(kind: str) -> None:
    """Take one in hand by its name; Debian packs 4.3 without any, so the test brings its own."""
    choose_tool("builtin.brush")
    if bpy.utils.system_resource("DATAFILES", path="assets/brushes"):
        given = {"asset_library_type": "ESSENTIALS", "relative_asset_identifier": BRUSHES + kind}
    else:
        make_native_brushes(kind)
        given = {"asset_library_type": "LOCAL", "relative_asset_identifier": f"Brush/{kind}"}
    operate(bpy.ops.brush.asset_activate, "EXEC_DEFAULT", **given)


def make_native_brushes(*kinds: str) -> None:
    """Brushes of these names and kinds in the file. Undo forgets those made after its step."""
    for kind in kinds:
        if kind not in bpy.data.brushes:
            brush = bpy.data.brushes.new(kind, mode="SCULPT")
            brush.strength = 0.5  # as Blender's own has
            if hasattr(brush, "sculpt_tool"):
                brush.sculpt_tool = kind.upper()
            else:  # from 5.0 on
                brush.sculpt_brush_type = kind.upper()
            brush.asset_mark()


def operate(operator: object, how: str = "INVOKE_DEFAULT", **given: object) -> None:
    """Call an operator as a button in the viewport does."""
    area = hand.view_area()
    context = {"window": hand.window(), "area": area, "region": hand.region("WINDOW", area)}
    with bpy.context.temp_override(**context):
        outcome = operator(how, **given)
    assert outcome <= {"FINISHED", "RUNNING_MODAL"}, outcome


def middle() -> hand.Pixel:
    """The middle of the viewport, where keys are typed."""
    region = hand.region()
    return region.x + region.width / 2, region.y + region.height / 2


def corner() -> hand.Pixel:
    """A place in the viewport where nothing is."""
    region = hand.region()
    return region.x + 0.2 * region.width, region.y + 0.1 * region.height


def undo() -> Steps:
    """Type Ctrl Z."""
    yield from _step(("ctrl",), bpy.app.handlers.undo_post)


def redo() -> Steps:
    """Type Shift Ctrl Z."""
    yield from _step(("ctrl", "shift"), bpy.app.handlers.redo_post)


def _step(held: hand.Held, handlers: list) -> Steps:
    """Type Z and wait until Blender has taken the step."""
    taken = []

    def take(*_: object) -> None:
        taken.append(True)

    handlers.append(take)
    try:
        hand.tap("Z", middle(), held)
        yield from hand.until(lambda: bool(taken), SECONDS, "a step in Blender's history")
    finally:
        handlers.remove(take)
    yield hand.DRAWN
    hand.window().view_layer.update()  # as the next picture does


def still_picture(kind: "str | Part" = "WINDOW", unlike: NDArray[np.uint8] | None = None) -> Steps:
    """The window when a region of the viewport, or a part of the window, is drawn to the end,
    however long that takes.

    unlike: a picture from which the region must differ, for what changes it may come late
    """
    place = hand.region(kind) if isinstance(kind, str) else kind
    rows = slice(-place.y - place.height, -place.y or None)
    region = rows, slice(place.x, place.x + place.width)
    picture = None
    for _ in range(40 if unlike is None else 400):
        yield 3 * hand.DRAWN
        last, picture = picture, hand.screen_pixels()
        if unlike is not None and np.array_equal(picture[region], unlike[region]):
            continue
        if last is not None and np.array_equal(last[region], picture[region]):
            break
    return picture


def changed(
    before: np.ndarray,
    after: np.ndarray,
    place: "bpy.types.Region | Part",
    first: int = 0,
    least: int = 100,
) -> tuple[int, int, int, int]:
    """Left, bottom, right, top of what differs in a region of two pictures.

    first: column of the window where the pictures begin
    least: pixels that must differ
    """
    differs = np.abs(before.astype(int) - after).max(2)[::-1] > 24  # (H, W), from below
    rows, columns = np.nonzero(differs)
    columns += first
    inside = (columns >= place.x) & (columns < place.x + place.width)
    inside &= (rows >= place.y) & (rows < place.y + place.height)
    assert inside.sum() > least, "nothing changed in the window"
    rows, columns = rows[inside], columns[inside]
    return columns.min(), rows.min(), columns.max(), rows.max()


def click(place: hand.Pixel) -> Steps:
    """Click with the left button."""
    hand.move(place)
    yield hand.DRAWN
    hand.tap("LEFTMOUSE", place)
    yield 2 * hand.DRAWN


def opened(place: hand.Pixel, beyond: int = 0, press: bool = True) -> Steps:
    """Click where a menu opens over the viewport: its left, bottom, right, top.

    beyond: column of the window to the right of which it opens
    press:  or else the mouse need only rest there, as on an entry of a menu
    """
    before = yield from still_picture()
    if press:
        yield from click(place)
    else:
        hand.move(place)
        yield REST
    after = yield from still_picture()
    return changed(before[:, beyond:], after[:, beyond:], hand.region(), beyond)


class Part(NamedTuple):
    """A part of the window, as a region is one."""

    x: int
    y: int
    width: int
    height: int


def whole_window() -> Part:
    """All of it."""
    height, width, _ = hand.screen_pixels().shape
    return Part(0, 0, width, height)


def uncovered() -> Part:
    """The part of the viewport that no sidebar covers."""
    whole, side = hand.region(), hand.region("UI")
    return Part(whole.x, whole.y, side.x - whole.x, whole.height)
