# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of strokes on the sphere: profiles, modulations, radii and intensities.

Those of `strokes`, each with its curve below: the profile across the stroke, the modulation
along it, or the cross-section in the same scale for all.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pictures import sheet
from pictures.sheet import Picture

from neural_sculpt_addon.stroke.stroke import Stroke

from ..settings import Settings
from ..work import Row, Task
from .strokes import Cell, cells, read

SHAPE = "sphere"
CURVE = 0.42, 0.2  # width and height of a curve, in widths of a picture
POINTS = 241
WIDEST, HIGHEST = 0.2, 0.13  # half width and height of the cross-sections that are shown


class Family(NamedTuple):
    """A figure: which of `strokes`, what its curves are, and what it shows."""

    source: str
    curve: Callable[[Stroke, tuple[int, int]], Picture]
    caption: str


def _profile(stroke: Stroke, size: tuple[int, int]) -> Picture:
    return sheet.curve(stroke.brush.profile(np.linspace(-1, 1, POINTS)), size, -1.1, 1.1)


def _modulation(stroke: Stroke, size: tuple[int, int]) -> Picture:
    return sheet.curve(stroke.brush.modulation(np.linspace(0, 1, POINTS)), size, -0.1, 2.1)


def _section(stroke: Stroke, size: tuple[int, int]) -> Picture:
    brush = stroke.brush
    height = brush.intensity * brush.profile(np.linspace(-1, 1, POINTS))
    return sheet.curve(height, size, -HIGHEST, HIGHEST, brush.radius / WIDEST)


FAMILIES = {
    "profiles": Family(
        "1",
        _profile,
        "One stroke with six profiles b(v): the paper's three formulas, and three that are drawn as"
        " control points; below each its curve, v from -1 at the stroke's lower edge to 1 at its"
        " upper one. Radius 0.09, intensity 0.06; waves 0.16, 0.03",
    ),
    "modulations": Family(
        "2",
        _modulation,
        "One stroke with the paper's six modulations m(u); below each its curve, u from 0 at the"
        " left end of the stroke to 1 at its right, height from 0 to 2",
    ),
    "radius-intensity": Family(
        "4",
        _section,
        "One quintic stroke with four radii r (intensity s = 0.06) and four intensities (radius"
        " r = 0.09); below each its cross-section, all in one scale",
    ),
}


def tasks(settings: Settings, folder: Path) -> list[Task]:
    """One for each figure."""

    def task(name: str, family: Family) -> Task:
        def make() -> Row:
            drawn = cells(read(), family.source, SHAPE, 2 * settings.pixels // 3)
            rows: dict[str, list[Picture]] = {}
            for cell in drawn:
                rows.setdefault(cell.family, []).append(_cell(cell, family))
            page = sheet.below([sheet.beside(row) for row in rows.values()])
            sheet.save(folder / f"{name}.png", page)
            return {"pictures": [name]}

        return Task(f"figure-{name}", 30, make)

    return [task(name, family) for name, family in FAMILIES.items()]


def _cell(cell: Cell, family: Family) -> Picture:
    width = cell.picture.shape[1]
    size = round(CURVE[0] * width), round(CURVE[1] * width)
    return sheet.below(
        [cell.picture, sheet.label(cell.name, width), family.curve(cell.stroke, size)]
    )
