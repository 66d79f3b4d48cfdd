# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person does: through the screen's own mouse and keyboard, by xdotool.

The program that started Blender runs the lines that begin with `xdotool`.
"""

import random
from unittest.mock import patch

import bpy
from drawing import (
    SECONDS,
    Array,
    WindowCase,
    choose_native_brush,
    choose_tool,
    edited,
    field,
    middle,
    moved_since,
    operate,
)
from harness import EXTENSION, brush_settings, long, module, push_undo, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from undo_orders import Order


class Person(WindowCase):
    def test_person(self) -> Steps:
        yield from self.add()
        before = state(field())
        path = self.arc()
        focus()
        yield from draw(path)
        yield from self.strokes_are(1)
        self.assert_raised(path)
        person(*mouse(middle()), "key", "ctrl+z")
        yield from hand.until(lambda: state(field()) == before, 30, "the field without the stroke")

    def test_d_annotates(self) -> Steps:
        """As with Blender's own tools, while ours is chosen."""
        yield from self.add()
        before = state(field())
        focus()
        person("keydown", "d")
        yield from draw(self.arc())
        person("keyup", "d")
        yield from hand.until(lambda: annotated() == 1, 30, "an annotation")
        self.assertEqual(state(field()), before)


RESOLUTION = 32
BRUSH = 50  # pixels, the size of Blender's brush
LOW = 0.03  # intensity


class PersonOrders(WindowCase):
    """Strokes of Blender's brushes are absorbed by themselves when `live`, else by Absorb alone;
    when `off`, each of them brings another proxy as soon as the hand rests.

    The proxy is coarse and strokes are small and low, for an order has a dozen to compute."""

    absorbs_live = True
    live = False
    off = False

    def add(self, kind: str = "SPHERE") -> Steps:
        bpy.context.preferences.addons[EXTENSION].preferences.resolution = RESOLUTION
        brush_settings().intensity = LOW
        yield from super().add(kind)
        field().neural_sculpt.live = self.live
        settings = bpy.context.tool_settings
        unified = getattr(settings.sculpt, "unified_paint_settings", None)  # from 5.0 on
        (unified or settings.unified_paint_settings).size = BRUSH
        push_undo("How to absorb")
        if self.off:
            results = module("blender.session.absorption.brush_results")
            settling = module("blender.session.absorption.settling")
            self.enterContext(patch.object(results, "SEEN_OFF", 0.0))
            self.enterContext(patch.object(settling, "REST", 0.1))

    @long
    def test_orders(self) -> Steps:
        """Each press of Ctrl Z takes back one thing, each of Shift Ctrl Z brings it back."""
        yield from self.add()
        yield from Order("person", PersonHands(self, 0), field().name).play_borders()

    @long
    def test_random_order(self) -> Steps:
        yield from self.add()
        yield from Order("person", PersonHands(self, 0), field().name).play()

    @long
    def test_random_order_of_live_strokes(self) -> Steps:
        self.live = True
        yield from self.add()
        yield from Order("live person", PersonHands(self, 0), field().name).play()

    @long
    def test_random_order_of_live_strokes_that_bring_another_proxy(self) -> Steps:
        if bpy.app.version < (5, 0, 0):
            self.skipTest("this Blender brings it with the stroke")
        self.live = self.off = True
        yield from self.add()
        yield from Order("off person", PersonHands(self, 0), field().name).play()

    @long
    def test_a_stroke_after_a_brush_stroke_that_was_undone(self) -> Steps:
        """Blender up to 4.5 rounds what it takes back, which is no sculpting."""
        yield from self.add()
        hands = PersonHands(self, 0)
        for thing in (hands.toggle_mode, hands.native, hands.undo):
            yield from thing()
        self.assertFalse(edited())
        yield from hands.neural()


class PersonHands:
    """How a person does what is in an order."""

    def __init__(self, case: WindowCase, seed: int) -> None:
        self.case, self.random = case, random.Random(seed)
        bpy.context.preferences.view.pie_tap_timeout = 1000  # hundredths: a tap, though it be slow
        focus()

    def native(self) -> Steps:
        choose_native_brush()
        yield hand.DRAWN
        before, count = vertices(field()), len(field().neural_sculpt.strokes)
        yield from draw(self.path())

        def drawn() -> bool:
            return moved_since(before) and not hand.window().modal_operators

        yield from hand.until(drawn, SECONDS, "a native stroke")
        yield hand.DRAWN
        if field().neural_sculpt.live:
            yield from self.until_entries(count + 1)
        stretched = module("blender.scene.mesh.proxy_mesh").STRETCHED  # until rest renews it
        yield from hand.until(lambda: stretched not in field().data, SECONDS, "another proxy")

    def neural(self) -> Steps:
        choose_tool()
        yield hand.DRAWN
        count = len(field().neural_sculpt.strokes)
        yield from draw(self.path())
        yield from self.until_entries(count + 1)

    def absorb(self) -> Steps:
        count = len(field().neural_sculpt.strokes)
        operate(bpy.ops.neural_sculpt.absorb)
        yield from self.until_entries(count + 1)

    def until_entries(self, count: int) -> Steps:
        """Wait for a result, but for no measure."""

        def ended() -> bool:
            listed = len(field().neural_sculpt.strokes)
            return (listed == count and not self.case.session.jobs) or self.case.session.last_error

        yield from hand.until(ended, SECONDS, f"{count} entries")
        self.case.assertEqual(self.case.session.last_error, "")

    def toggle_mode(self) -> Steps:
        sculpting = field().mode == "SCULPT"
        person(
            *mouse(middle()), "key", "ctrl+Tab", "sleep", "0.5", "key", "o" if sculpting else "s"
        )
        yield from hand.until(
            lambda: (field().mode == "SCULPT") != sculpting, SECONDS, "another mode"
        )
        yield 3 * hand.DRAWN

    def undo(self) -> Steps:
        yield from self.step("ctrl+z", bpy.app.handlers.undo_post)

    def redo(self) -> Steps:
        yield from self.step("ctrl+shift+z", bpy.app.handlers.redo_post)

    def step(self, key: str, handlers: list) -> Steps:
        """Press a key once and wait until Blender has taken the step."""
        taken: list[bool] = []

        def take(*_: object) -> None:
            taken.append(True)

        handlers.append(take)
        try:
            person(*mouse(middle()), "key", key)
            yield from hand.until(lambda: bool(taken), SECONDS, f"what {key} does")
            yield 2 * hand.DRAWN
        finally:
            handlers.remove(take)

    def path(self) -> Array:
        first = self.random.randrange(9)
        return self.case.arc(self.random.uniform(-0.9, 0.9))[first : first + 7]


def annotated() -> int:
    """How many strokes annotations have."""
    blocks = bpy.data.annotations if hasattr(bpy.data, "annotations") else bpy.data.grease_pencils
    layers = [layer for block in blocks for layer in block.layers]
    return sum(len(frame.strokes) for layer in layers for frame in layer.frames)


def draw(path: Array) -> Steps:
    """Draw with the left button through points (K, 3)."""
    points = hand.to_window(path)
    person(*mouse(points[0]), "sleep", "0.2", "mousedown", "1")
    for point in points[1:]:
        person(*mouse(point), "sleep", "0.02")
    person("mouseup", "1")
    yield hand.DRAWN


def focus() -> None:
    """Let keys come to Blender."""
    person("search", "--onlyvisible", "--class", "Blender", "windowfocus")


def person(*words: str) -> None:
    """Ask for input."""
    print("xdotool", *words, flush=True)


def mouse(place: hand.Pixel) -> tuple[str, ...]:
    """Move the mouse there; the screen's rows are counted from the top."""
    height = hand.screen_pixels().shape[0]
    return "mousemove", str(int(place[0])), str(height - int(place[1]))
