# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages over time as a picture: a bar for each span, a line for each stage."""

from collections.abc import Sequence

import numpy as np
from pictures.sheet import INK, LABEL, LARGER, PALE, Picture, font
from PIL import Image, ImageDraw

from ..measures.stages import Span

WIDTH, LEFT, RIGHT = 1100, 300, 110  # pixels, of all of it and of its margins
LINE, TOP, BOTTOM = 30, 52, 42
COLOURS = (
    *((39, 96, 157), (224, 123, 57), (79, 154, 107), (154, 79, 134), (179, 162, 58)),
    (90, 167, 184),
)
TICKS = 5

Color = tuple[int, int, int]


def gantt(title: str, spans: Sequence[Span]) -> Picture:
    """The picture of `spans`, which begin with the first one."""
    stages = list(dict.fromkeys(span.stage for span in spans))
    begin, end = min(s.start for s in spans), max(s.end for s in spans)
    scale = (WIDTH - LEFT - RIGHT) / max(end - begin, 1e-9)
    bottom = TOP + LINE * len(stages)
    page = _Page(WIDTH, bottom + BOTTOM)
    page.text(18, 24, title, "lm")
    for tick in range(TICKS + 1):
        seconds = (end - begin) * tick / TICKS
        x = LEFT + scale * seconds
        page.box(x, TOP - 6, x + 1, bottom, PALE)
        page.text(x, bottom + 18, f"{1e3 * seconds:.0f} ms", "mm")
    for number, stage in enumerate(stages):
        y, mine = TOP + LINE * number, [span for span in spans if span.stage == stage]
        middle, right = y + LINE / 2, LEFT + scale * (mine[-1].end - begin)
        page.text(LEFT - 12, middle, stage, "rm")
        for span in mine:
            x, long = LEFT + scale * (span.start - begin), scale * (span.end - span.start)
            page.box(x, y + 5, x + max(long, 1), y + LINE - 5, COLOURS[number % len(COLOURS)])
        page.text(right + 8, middle, f"{1e3 * sum(s.end - s.start for s in mine):.1f}", "lm")
    return page.picture()


class _Page:
    """A white page; what is drawn on it is smooth at its edges."""

    def __init__(self, width: int, height: int) -> None:
        self._page = Image.new("RGB", (width * LARGER, height * LARGER), "white")
        self._draw = ImageDraw.Draw(self._page)

    def text(self, x: float, y: float, text: str, anchor: str) -> None:
        place = x * LARGER, y * LARGER
        self._draw.text(place, text, INK, font(LABEL * LARGER), anchor=anchor)

    def box(self, left: float, top: float, right: float, bottom: float, color: Color) -> None:
        """Filled, to but without its right and lower border."""
        corners = np.round(np.array([left, top, right, bottom]) * LARGER) - (0, 0, 1, 1)
        self._draw.rectangle([tuple(corners[:2]), tuple(corners[2:])], fill=color)

    def picture(self) -> Picture:
        return np.array(self._page.reduce(LARGER))
