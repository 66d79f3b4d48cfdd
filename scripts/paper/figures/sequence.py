# SPDX-License-Identifier: GPL-3.0-or-later
"""An editing sequence: the strokes of examples/idol.json one after another, by ours with detail.

Between two states an arrow, the profile of the stroke above it and its modulation below.
"""

from pathlib import Path

import make_examples
import numpy as np
from pictures import rendered, sheet
from pictures.field_picture import Camera
from pictures.sheet import Picture

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.stroke.file import parse_strokes
from neural_sculpt_addon.stroke.stroke import Stroke

from ..settings import Settings
from ..work import Row, Task

NAME = "idol"
CAMERA = Camera((0.45, -1.0, 0.22), target=(0.0, 0.0, -0.02), half=0.85)
COLUMNS = 5
ARROW = 0.32  # widths of a picture
POINTS = 121
CAPTION = (
    "An editing sequence: fourteen strokes turn a sphere into an idol's head, each with its profile"
    " (v from -1 to 1) above the arrow and its modulation (u from 0 to 1) below;"
    f" examples/{NAME}.json has them"
)


def task(settings: Settings, folder: Path) -> Task:
    """The figure."""

    def make() -> Row:
        example = make_examples.EXAMPLES[NAME]
        text = (make_examples.FOLDER / f"{NAME}.json").read_text(encoding="utf-8")
        now, size = prepare(primitive(example.field)), settings.pixels // 2
        strokes, fields = parse_strokes(text), [now.field]
        for stroke in strokes:
            now = sculpt(now, stroke).preparation
            fields.append(now.field)
        first, *others = rendered.pictures(fields, CAMERA, size)
        cells = [_state(first, "")]
        for number, (stroke, shaded) in enumerate(zip(strokes, others, strict=True), start=1):
            cells += [_step(stroke, size), _state(shaded, f"{number} {stroke.name}")]
        sheet.save(folder / "sequence.png", _page(cells))
        return {"pictures": ["sequence"]}

    return Task("figure-sequence", 90, make)


def _state(shaded: Picture, name: str) -> Picture:
    return sheet.below([shaded, sheet.label(name, shaded.shape[1])])


def _step(stroke: Stroke, size: int) -> Picture:
    """Profile, arrow and modulation."""
    width, height = round(ARROW * size), round(0.22 * size)
    brush = stroke.brush
    up = np.sign(brush.intensity)
    across = up * brush.profile(np.linspace(-1, 1, POINTS))
    along = brush.modulation(np.linspace(0, 1, POINTS))
    return sheet.below(
        [
            sheet.curve(across, (width, height), -1.1, 1.1),
            sheet.arrow(width, height // 2),
            sheet.curve(along, (width, height), -0.1, 2.1),
            sheet.label("", width),
        ]
    )


def _page(cells: list[Picture]) -> Picture:
    """Rows of `COLUMNS` states, each with the step that follows it."""
    step = 2 * COLUMNS
    rows = [sheet.beside(cells[at : at + step]) for at in range(0, len(cells), step)]
    width = max(row.shape[1] for row in rows)
    return np.concatenate([sheet.to_width(row, width) for row in rows])
