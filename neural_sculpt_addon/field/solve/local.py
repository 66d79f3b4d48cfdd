# SPDX-License-Identifier: GPL-3.0-or-later
"""The local solver: a stroke becomes coefficients near it (docs/method.md, section 4).

    choose the level -> active cells -> rows -> solve a coarse level, a fine one, and where that
    misses a finer one

The level follows from the stroke (`resolution`). Nodes exist in the cells that the surface passes
on its way from where it was to where it goes, and in those beside them, so the field elsewhere
stays what it was to the last bit. Model space.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...common.progress import Progress, silent
from ..evaluate import values
from ..geometry import search_tree
from ..levels import (
    FINEST,
    Coefficients,
    Level,
    cells_of,
    centres,
    children,
    dilated,
    distinct,
    linear,
    merged,
    places,
    quantised,
    spacing,
)
from ..mesh.pieces import Islands
from ..mesh.surface import Samples
from ..problem.problem import DisplacedSurface, Problem
from .edit_rows import AROUND_WEIGHT, EditedSurface
from .loose import loose_parts
from .resolution import DENSITY, REFUSED_BELOW, resolution
from .spline_system import ITERATIONS, solve_level, solve_levels

FEWEST = 7
"""Tube samples at least along and across a stroke. Only strokes that are less than 2.5 cells wide
would have fewer: those with a radius below 0.0025."""

ACTIVE_MARGIN = 0.75
"""Cells beyond both surfaces that are active, before one more on each side: half as much is 5 %
less close, twice as much takes a sixth longer and is not closer."""

GAP = 1.5
"""Cells, of the proxy where those are larger: how far from all tube samples a gap begins. With
half as much the result is a sixth closer to the surface asked for, as measured from the result, and
with twice as much a sixth less close."""

HIGH = 4
"""Cells that the surface moves, from which on the coarse level has nodes beside its way, too: f
would swing between coefficients that large and none beside them, and leave crumbs."""

STRIDE = 0.7
"""Cells between the places at which the surface's way is looked at: not more than a cell, or it
would leap over one; half as much makes no difference."""

REPAIRS = 8
"""How often loose parts are looked for and solved away: up to 6 times upon folds of others."""

FORBIDDEN_WEIGHT = 4.0
"""Weight of rows that take away surface which nobody asked for."""

MISSED, TILTED = 4e-4, 0.3
"""Model units and slope (17 degrees) that a surface sample may be off. A cell with a sample that is
farther off gets nodes of the next level: less of both is closer, and costs nodes and rows."""

OF_HEIGHT = 0.05
"""Of the stroke's height that a sample may be off, where that is less: of faint strokes too much
would be missing otherwise, and others are higher than 0.008."""

LEAST_MISSED = 1e-5
"""Model units: less than that is not looked for, as where a stroke asks for nothing. Single
precision leaves some 3e-6 of f."""

FAMILY, FINER_NODES = 20, 30_000
"""Nodes that such a cell takes, about: those of its children that the surface passes, and those
beside them. Nodes of finer levels at most: they bound the time of strokes that fold over the detail
of many others, which are the slowest."""

COMPANY = 2
"""Missed cells that must touch such a cell: what is worth a finer level, a crease or a detail, goes
through several cells, and single ones come out as pimples on smooth walls."""

FINER, FINER_IN_FOLDS = 1, 2
"""Levels at most that are finer than that of the stroke, and those where it folds: slits between
walls that meet would close with one. Elsewhere a second takes a fifth longer and is no closer."""

FINER_ITERATIONS = 10
"""Of the solution of those, which only add what coarser ones miss: twice as many are 1 % closer,
half as many 1 % less close beside the stroke."""

CLEARING, CLEAR = 1.0, 0.5
"""Cells around an island in which all rows are brought to the other side, and how far: in cells."""

BESIDE, SHARE = 0.25, 0.6
"""A place is doubtful if it is more than BESIDE cells from the surface asked for, and the field is
less than a SHARE of that distance there. Of 72 crumbs that plain strokes left, 69 lay within two
cells of such places; with a share of 0.5 a tenth would be missed, from half a cell on a third."""

CHANGED = 5
"""Rings of cells around loose parts that are looked at again when those are solved away: nodes
within two cells reach another one and a half, and a part that ends there shows one beyond."""


class LocalEdit:
    """The equations of one stroke, its layer so far, and the `field` with it."""

    def __init__(self, problem: Problem, progress: Progress = silent) -> None:
        """Draw the rows. SculptError when the stroke is too large, or leaves nothing under it."""
        self.resolution = resolution(problem)
        level = self.resolution.level
        if level < REFUSED_BELOW:
            raise SculptError(
                "The stroke covers more surface than one edit can hold. Use a smaller radius,"
                " fewer points, or fewer copies."
            )
        random = np.random.default_rng(problem.seed)
        progress(0.0, "Sculpting")
        displaced = _sample(problem, level, random)
        before, after = displaced.before, displaced.after
        passed = _passed(before, after, level)
        if displaced.swept is not None:
            passed = np.union1d(passed, _changed(problem, level))
        self._active = dilated(passed, level)
        way = np.linalg.norm(after.points - before.points, axis=1)
        self._height, far = float(way.max(initial=0)), way > HIGH * spacing(level)
        high = _parents(_passed(before.where(far), after.where(far), level), level)
        coarse = np.union1d(_parents(passed, level), dilated(high, level - 1))
        beyond = np.setdiff1d(coarse, _parents(self._active, level))
        progress(0.3, "Sculpting")
        self._problem, self._random, self._coarse = problem, random, coarse
        self._swept = displaced.swept
        self.field = problem.field
        self._surface = EditedSurface(
            problem, displaced, self._active, coarse, beyond, level, random
        )
        self._rows = self._surface.rows
        self._layer = dict[int, Level]()

    @staticmethod
    def solved(problem: Problem, progress: Progress = silent) -> "LocalEdit":
        """The edit with its layer. SculptError as when one is made."""
        edit = LocalEdit(problem, progress)
        edit.solve()
        return edit

    @property
    def layer(self) -> Coefficients:
        """What the stroke adds, as far as it is solved."""
        return self._layer

    @property
    def targets(self) -> NDArray[np.float32]:
        """Samples (N, 3) of the displaced surface."""
        return self._surface.target.points

    def solve(self) -> Coefficients:
        """The layer: a coarse level, a fine one, and a finer one where that misses."""
        level, cells = self.resolution.level, self._active
        both = {level - 1: self._coarse, level: cells}
        self._layer |= solve_levels(both, self._rows, self._problem.check)
        self.field = self._problem.field.plus(self._layer)
        room = FINER_NODES
        for _ in range(FINER if self._swept is None else FINER_IN_FOLDS):
            if level == FINEST or not len(missed := self._missed(level, cells, room)):
                break
            cells = dilated(self._passed_in(missed, level), level + 1)
            level += 1
            room -= len(cells)
            self._rows = self._surface.finer(self._rows, cells, level, self.field, self._random)
            self._add(level, cells)
        self._clear()
        return self._layer

    def _clear(self) -> None:
        """Solve away loose parts: around doubtful places, and near those where the displaced
        surface runs through itself, or anywhere over relief."""
        level, problem = self.resolution.level, self._problem
        fine = dilated(self._active, level)
        doubtful = dilated(self._doubtful(), level)
        every = np.intersect1d(dilated(doubtful, level), fine, assume_unique=True)
        if self._swept is not None or problem.is_over_relief:
            doubtful = fine
            every = np.union1d(every, self._reached(fine))
        if not len(every):
            return
        cells, divided = every, np.intersect1d(doubtful, every, assume_unique=True)
        for _ in range(REPAIRS):
            loose = loose_parts(
                self.field, cells, level, lambda: problem.held, problem.check, divided
            )
            if not loose:
                break
            for found, parts in loose.items():
                self.forbid(parts, found)
            changed = numbers(np.concatenate([parts.points for parts in loose.values()]), level)
            for _ in range(CHANGED):
                changed = dilated(changed, level)
            cells = np.intersect1d(changed, every)
            divided = np.intersect1d(fine, every, assume_unique=True)  # parts may be anywhere now

    def _doubtful(self) -> NDArray[np.int32]:
        """The cells (K,) of the stroke's level, rising, with doubtful places: near these the field
        has surface that nobody asked for, or nearly so."""
        rows, level = self._rows, self.resolution.level
        beside = np.abs(rows.targets) > BESIDE * spacing(level)
        wanted = rows.targets[beside]
        short = (wanted - rows.residuals[beside]) / wanted < SHARE
        return numbers(rows.points[beside][short], level)

    def _reached(self, fine: NDArray[np.int32]) -> NDArray[np.int32]:
        """The cells (K,) of the stroke's level that its nodes reach, those `fine` and the coarse
        ones, rising: all of them, or those near folds where it has any."""
        level = self.resolution.level
        every = np.union1d(fine, children(dilated(self._coarse, level - 1), level - 1))
        if self._swept is None:
            return every
        return every[self._swept.near(centres(places(every, level), level))]

    def forbid(self, islands: Islands, found: int | None = None) -> Coefficients:
        """The layer without surface where `islands` are, which it has but nobody asked for.

        found: the level of the cells in which they were found, if not that of the stroke

        Rows are added at their vertices, and those that lie close by are brought to the same side.
        Coarse nodes alone could not change the field there and leave it as it is around: fine ones
        are added.
        """
        level, rows, field = self.resolution.level, self._rows, self.field
        h = spacing(found or level)
        added = np.setdiff1d(dilated(numbers(islands.points, level), level), self._active)
        self._active = np.union1d(self._active, added)
        middles = centres(places(added, level), level)
        rows.add(middles, values(field, middles), np.zeros(len(added), np.float32), AROUND_WEIGHT)
        side = np.sign(islands.distance).astype(np.float32)  # (N,)
        tree = search_tree(islands.points)
        near = np.asarray(tree.query(rows.points, distance_upper_bound=CLEARING * h)[1])
        some = np.flatnonzero(near < len(side))
        now, there = rows.targets[some], side[near[some]]
        wanted = np.where(now * there > 0, now, np.float32(CLEAR * h) * there)
        rows.residuals[some] += wanted - now
        rows.targets[some] = wanted
        targets = np.float32(CLEAR * h) * side
        before = values(field, islands.points)
        rows.add(islands.points, targets, targets - before, FORBIDDEN_WEIGHT)
        self._add_near(islands.points, min(found or level, level + FINER_IN_FOLDS))
        return self._layer

    def _add_near(self, points: NDArray[np.float32], level: int) -> None:
        """Solve a level once more, by nodes within two cells of points (N, 3)."""
        active = self._active
        for coarser in range(self.resolution.level, level):
            active = children(active, coarser)
        near = dilated(dilated(numbers(points, level), level), level)
        self._add(level, np.intersect1d(near, active, assume_unique=True))

    def _add(self, level: int, cells: NDArray[np.int32]) -> None:
        """Solve one level for what is left of the rows, and add it to the layer."""
        iterations = ITERATIONS if level <= self.resolution.level else FINER_ITERATIONS
        found = solve_level(level, cells, self._rows, self._problem.check, iterations)
        if level not in self._layer:
            self._layer[level] = found
            self.field = self.field.plus({level: found})
            return
        total = Level.sum([self._layer[level], found])
        self._layer[level] = Level(total.index, quantised(total.values))  # within their bound
        self.field = self._problem.field.plus(self._layer)

    def _missed(self, level: int, active: NDArray[np.int32], room: int) -> NDArray[np.int32]:
        """The active cells (K,) of a level that need a finer one: surface samples in them are off.
        Where there is no `room` for the nodes of all, those with the most of these."""
        rows = self._rows
        most = min(MISSED, max(OF_HEIGHT * self._height, LEAST_MISSED))
        off = np.abs(rows.residuals) > most
        off[rows.at[np.abs(rows.slopes) > TILTED]] = True
        cells = linear(cells_of(rows.points[off & (rows.targets == 0)], level), level)
        missed, count = np.unique(cells[np.isin(cells, active)], return_counts=True)
        most = np.argsort(-count, kind="stable")[: max(room, 0) // FAMILY]
        return _in_company(np.sort(missed[most]), level)

    def _passed_in(self, cells: NDArray[np.int32], level: int) -> NDArray[np.int32]:
        """Cells (K,) of the next level within `cells` (N,) of a level: the surface passes them."""
        points = self._rows.points[self._rows.targets == 0]
        return numbers(points[np.isin(linear(cells_of(points, level), level), cells)], level + 1)


def numbers(points: NDArray[np.float32], level: int) -> NDArray[np.int32]:
    """The cells (K,) of a level around `points` (N, 3), each once, rising."""
    return distinct(cells_of(points, level), level)


def _parents(cells: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """The cells (K,) of the level above in which the cells (N,) of a level lie, rising."""
    return numbers(centres(places(cells, level), level), level - 1)


def _in_company(cells: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """Of the cells (K,) of a level those that COMPANY others touch."""
    if len(cells) <= COMPANY:
        return cells[:0]
    middles = centres(places(cells, level), level)
    touching = 1.01 * math.sqrt(3) * spacing(level)
    near, _ = search_tree(middles).query(middles, COMPANY + 1, distance_upper_bound=touching)
    return cells[np.isfinite(near[:, -1])]


def _sample(problem: Problem, level: int, random: np.random.Generator) -> DisplacedSurface:
    """The displaced surface, DENSITY samples in each h^2."""
    h = spacing(level)
    width = 2 * problem.stroke.largest_radius
    length = max(path.length for _, path in problem.placed)
    rows, columns = (
        max(math.ceil(size * DENSITY**0.5 / h), FEWEST) for size in (length or width, width)
    )
    gap = GAP * max(h, problem.preparation.spacing)
    return problem.displaced_surface(rows, columns, random, h / DENSITY**0.5, gap, GAP * h)


def _passed(surface: Samples, target: Samples, level: int) -> NDArray[np.int32]:
    """The cells that the surface passes on its way, and those within ACTIVE_MARGIN of it."""
    h = spacing(level)
    way = target.points - surface.points
    farthest = float(np.linalg.norm(way, axis=1).max(initial=0))
    parts = np.linspace(0, 1, math.ceil(farthest / (STRIDE * h)) + 1, dtype=np.float32)
    found = [numbers(surface.points + part * way, level) for part in parts]
    for samples in (surface, target):
        for side in (-ACTIVE_MARGIN, ACTIVE_MARGIN):
            found.append(numbers(samples.points + np.float32(side * h) * samples.normals, level))
    return merged(np.concatenate(found))


def _changed(problem: Problem, level: int) -> NDArray[np.int32]:
    """Cells whose middles change sides, a plug that is carved away or a gap that is filled, among
    those that samples pass which bound nothing in the end. Beyond, all stays what it was."""
    cells = _passed(*problem.folded.bounding_nothing(), level)
    middles = centres(places(cells, level), level)
    f = values(problem.field, middles)
    return cells[(f < 0) != problem.folded.inside(middles, f)]
