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
    field,
    middle,
    moved_since,
    operate,
)
from harness import EXTENSION, brush_settings, module, push_undo, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

RESOLUTION = 32
BRUSH = 50  # pixels, the size of Blender's brush
LOW = 0.03  # intensity


class OrderCase(WindowCase):
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
        yield from self.step(bpy.app.handlers.undo_post, *mouse(middle()), "key", "ctrl+z")

    def redo(self) -> Steps:
        yield from self.step(bpy.app.handlers.redo_post, *mouse(middle()), "key", "ctrl+shift+z")

    def step(self, handlers: list, *words: str) -> Steps:
        """Ask for input that has Blender take a step, and wait until it has."""
        taken: list[bool] = []

        def take(*_: object) -> None:
            taken.append(True)

        handlers.append(take)
        try:
            person(*words)
            yield from hand.until(lambda: bool(taken), SECONDS, f"what {words[-1]} does")
            yield 2 * hand.DRAWN
        finally:
            handlers.remove(take)

    def path(self) -> Array:
        first = self.random.randrange(9)
        return self.case.arc(self.random.uniform(-0.9, 0.9))[first : first + 7]


def draw(path: Array) -> Steps:
    """Draw with the left button through points (K, 3)."""
    person(*drawing(path))
    yield hand.DRAWN


def drawing(path: Array) -> list[str]:
    """The input that does so."""
    first, *others = map(mouse, hand.to_window(path))
    moves = [word for place in others for word in (*place, "sleep", "0.02")]
    return [*first, "sleep", "0.2", "mousedown", "1", *moves, "mouseup", "1"]


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
