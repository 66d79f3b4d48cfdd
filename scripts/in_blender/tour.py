# SPDX-License-Identifier: GPL-3.0-or-later
"""The tour inside Blender: sculpts Suzanne by hand and takes a picture at every step.

blender --enable-event-simulate --python scripts/in_blender/start.py -- \\
    in_blender.tour EXTENSION.zip FRAMES FILE.blend
"""

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Quaternion

from . import simulated_input as hand
from .extension import add, install, worker_session
from .simulated_input import Pixel, Steps

RESOLUTION = 144
SECONDS = 600
SEEN_FROM = Quaternion((0.745, 0.61, 0.17, 0.21))
PAUSES = 3  # pictures of the finished stroke
PANEL = 1.0  # seconds in which a panel grows or shrinks

STROKES = (  # profile, modulation, radius, intensity; ends in parts of the view's width; its bow
    ("QUINTIC", "IDENTITY", 0.07, 0.06, (-0.12, 0.185), (0.22, 0.16), 0.045),
    ("QUINTIC", "CENTRAL", 0.05, -0.04, (-0.09, 0.25), (0.18, 0.235), 0.04),
    ("QUINTIC", "CENTRAL", 0.05, 0.05, (-0.155, -0.235), (-0.02, -0.235), 0.0),
)


class Film:
    """Pictures of the window, numbered."""

    def __init__(self, folder: Path) -> None:
        """Nothing was taken yet."""
        self.folder, self.count = folder, 0

    def take(self) -> None:
        """One picture of the window as it is."""
        path = self.folder / f"{self.count:04}.png"
        hand.save_png(path, hand.screen_pixels())
        self.count += 1


def main(given: list[str]) -> None:
    """Let Blender step it."""
    hand.play(steps(*given))


def steps(extension: str, frames: str, target: str) -> Steps:
    """Install, add Suzanne, draw, save."""
    yield from install(extension, RESOLUTION)
    overlay = hand.view().overlay
    overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = overlay.show_cursor = False
    overlay.show_outline_selected = overlay.show_object_origins = False
    hand.look(SEEN_FROM, 2.4)
    yield from add("SUZANNE")
    with bpy.context.temp_override(window=hand.window(), area=hand.view_area()):
        bpy.ops.wm.tool_set_by_id(name="neural_sculpt.tool")
    yield from hand.show_tab("Neural Sculpt")
    film = Film(Path(frames))
    for profile, modulation, radius, intensity, begin, end, bow in STROKES:
        data_block: Any = bpy.data.brushes[".neural_sculpt"]
        brush = data_block.neural_sculpt
        brush.profile, brush.modulation = profile, modulation
        brush.radius, brush.intensity = radius, intensity
        yield from draw(bowed(begin, end, bow), film, worker_session())
    bpy.ops.wm.save_as_mainfile(filepath=target, compress=True)


def bowed(begin: Pixel, end: Pixel, bow: float) -> list[Pixel]:
    """Pixels of the window from one place to another, which are parts of the view's width."""
    place = hand.region()
    t = np.linspace(0, 1, 24)[:, None]
    path = (1 - t) * np.array(begin) + t * np.array(end) + [0, bow] * (4 * t * (1 - t))
    middle = np.array([place.x + place.width / 2, place.y + place.height / 2])
    return [(x, y) for x, y in (middle + path * place.width / 2).tolist()]


def draw(path: list[Pixel], film: Film, session: Any) -> Steps:
    """Draw one stroke and film it until its result and its report are there."""
    hand.move(path[0])
    yield 2 * hand.DRAWN
    film.take()
    hand.press(path[0])
    for number, place in enumerate(path):
        hand.move(place)
        yield hand.DRAWN
        if number % 3 == 0:
            film.take()
    hand.release(path[-1])
    yield 2 * hand.DRAWN
    film.take()
    yield from hand.until(lambda: not session.jobs, SECONDS, "the result")
    yield PANEL
    film.take()
    yield from hand.until(lambda: session.behind is None, SECONDS, "the report")
    yield PANEL
    for _ in range(PAUSES):
        yield hand.DRAWN
        film.take()
