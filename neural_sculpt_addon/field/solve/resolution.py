# SPDX-License-Identifier: GPL-3.0-or-later
"""Resolution of a local edit: the level of its finest cells (docs/method.md, section 4.1).

Some two or three cells are as wide as the narrowest rise or fall of the profile, of the modulation
along the stroke, or of the alpha; one is less wide than the steepest wall. Where the stroke folds
over detail, cells are as fine as that. A budget of rows and nodes bounds both. Model space.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...stroke.curve import Array
from ..levels import FINEST, spacing
from ..problem.problem import Problem

CELLS_PER_FEATURE, CELLS_OVER_RELIEF = 2.0, 2.5
"""Cells in the width of the narrowest rise or fall, about, and the same over relief, which has
narrow rises of its own: more are closer, and cost rows. With 2 there, too, untouched surface
between the strokes of long sessions turned by up to 0.27 degrees, not 0.19."""

LEAST_FINEST, LEAST_WITH_WALLS = 6, 7
"""Level of the widest strokes: they carry details of the surface along, which are finer; and where
they have walls, whose sharp edges come out beaded on a coarser one."""

REFUSED_BELOW = 4
"""Level below which a stroke would wash out what it covers: it is refused."""

DENSITY = 6.0
"""Samples of the displaced surface for each cell's face: fewer leave nodes that no sample tells
apart."""

MOST_ROWS, MOST_NODES = 200_000, 150_000
"""Tube samples and nodes at most: one level coarser where there would be more."""

LEFT_FINER = 0.1
"""Share of the surface under a stroke that folds whose detail may be finer than the stroke's level.
Crumbs of that may stay, for coarser nodes cannot take it away; finer ones take longer."""

WALL = 2.0
"""A feature is at most so many times as wide as the steepest rise: the named profiles are at most
twice as steep in their middle as in the mean, walls far more."""

NARROWEST_WALL = 1 / 12
"""Radii: walls that are narrower count as that wide. They are cliffs, or nearly, which get samples
of their own."""

SAMPLES = 256
"""Steps in which curves are looked at: walls narrower than one count as that wide."""

LEAST_RISE = 0.01
"""Of the largest height: what rises or falls by less is flat."""

LAYERS = 5
"""Active cells above each other, where the surface hardly moves: so the budget of nodes counts."""


@dataclass(frozen=True)
class Resolution:
    """How fine a stroke is solved.

    level:  of the finest cells
    wanted: the level that the stroke's own features ask for, whatever the budget
    """

    level: int
    wanted: int

    @property
    def is_limited(self) -> bool:
        """Whether the budget does not reach as far as the stroke asks for."""
        return self.level < self.wanted


def resolution(problem: Problem) -> Resolution:
    """How fine the stroke of `problem` is solved."""
    stroke, curves = problem.stroke, _curves(problem)
    height = stroke.largest_intensity * float(np.abs(curves.modulation).max())
    feature = _feature(problem, curves)
    feature /= math.sqrt(max(height / feature, 1))  # steeper than 45 degrees: less wide, bent more
    wall = WALL * _wall(curves)
    least = LEAST_WITH_WALLS if wall < feature else LEAST_FINEST
    feature = min(feature, wall)
    cells = CELLS_OVER_RELIEF if problem.is_over_relief else CELLS_PER_FEATURE
    wanted = max(least, round(math.log2(cells / feature)))
    radius = stroke.largest_radius
    length = sum(path.length for _, path in problem.placed)

    def fits(level: int) -> bool:
        reach = max(radius / spacing(level), 1)  # in cells, of which even a thin stroke takes some
        faces = 2 * reach * length / spacing(level) + len(problem.placed) * math.pi * reach**2
        nodes = faces * (LAYERS + height / spacing(level))
        return DENSITY * faces <= MOST_ROWS and nodes <= MOST_NODES

    affordable = next((level for level in range(FINEST, 0, -1) if fits(level)), 0)
    return Resolution(min(max(wanted, _carried(problem)), affordable), wanted)


def _carried(problem: Problem) -> int:
    """The level of the detail that a stroke moves, if it would fold over it; otherwise 0."""
    if not problem.is_guided:
        return 0
    under = problem.preparation.proxy.vertices[problem.covered]
    levels = problem.field.detail.finest_at(under)
    return int(np.quantile(levels, 1 - LEFT_FINER)) if len(levels) else 0


class _Curves(NamedTuple):
    """The profile across a stroke and the modulation along it: heights (SAMPLES + 1,), and how far
    each goes, model units."""

    profile: Array
    width: float
    modulation: Array
    length: float


def _curves(problem: Problem) -> _Curves:
    brush = problem.stroke.brush
    width = 2 * problem.stroke.largest_radius
    length = max(width / 2, *(path.length for _, path in problem.placed))
    across, along = np.linspace(-1, 1, SAMPLES + 1), np.linspace(0, 1, SAMPLES + 1)
    return _Curves(brush.profile(across), width, brush.modulation(along), length)


def _feature(problem: Problem, curves: _Curves) -> float:
    """Width of the narrowest feature, model units: a rise or fall of the profile across the stroke
    or of the modulation along it, if all of these were equally wide; or one of the alpha."""
    alpha = problem.stroke.brush.alpha
    feature = curves.width / max(turns(curves.profile) + 1, 2)
    if count := turns(curves.modulation):
        feature = min(feature, curves.length / (count + 1))
    if alpha is not None:
        feature = min(feature, curves.width / 2 * alpha.feature)
    return feature


def _wall(curves: _Curves) -> float:
    """Width of a wall as steep as the steepest rise or fall, from zero or a height below it to the
    largest of the curve; model units, NARROWEST_WALL at least."""
    walls = [curves.width]
    for heights, extent in curves[:2], curves[2:]:
        steepest = SAMPLES / extent * float(np.abs(np.diff(heights)).max())
        if steepest:
            walls.append(float(max(heights.max(), 0) - min(heights.min(), 0)) / steepest)
    return max(min(walls), NARROWEST_WALL * curves.width / 2)


def turns(heights: NDArray[np.floating]) -> int:
    """How often samples (N,) of a curve turn from rising to falling or back, by LEAST_RISE at
    least: a plateau is no row of features, however it was rounded."""
    least = LEAST_RISE * float(np.abs(heights).max())
    low = high = float(heights[0])
    count = way = 0
    for height in heights.tolist():
        low, high = min(low, height), max(high, height)
        if way >= 0 and high - height > least:
            count, way, low = count + (way > 0), -1, height
        elif way <= 0 and height - low > least:
            count, way, high = count + (way < 0), 1, height
    return count
