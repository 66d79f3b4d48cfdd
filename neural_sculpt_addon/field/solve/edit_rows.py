# SPDX-License-Identifier: GPL-3.0-or-later
"""The residual rows of a local edit (docs/method.md, section 4.2).

target    f(p') = 0                  on the displaced surface
slope     grad f(p') . e = n' . e    there, along random directions e that lean towards n'
preserve  f(q) = f0(q)               on the untouched surface, wherever the new detail reaches:
                                     around the stroke, and on other sheets of thin parts
around    f(x) = signed distance     in the middle of each active cell, and of coarse ones beyond,
                 of the new surface  where the displaced surface is nearest; f0 elsewhere

The middle of a cell is where its node is: a spline is far better determined there than by random
points, between which it can swing. The distance is that from the plane of the nearest sample, or,
beyond a crease, from the sample. Where the displaced surface runs through itself, winding numbers
tell the sides (see `fold`), and it is the distance from the triangles asked for: at most two cells,
or f0 where its side stays. Model space.
"""

import numpy as np
from numpy.typing import NDArray

from ..evaluate import values, values_and_gradients
from ..field import Field
from ..geometry import search_tree
from ..levels import cells_of, centres, children, dilated, linear, merged, places, spacing
from ..mesh.surface import Samples
from ..problem.problem import DisplacedSurface, Problem
from ..projection import ARRIVED, ON_SURFACE, SMALLEST_GRADIENT, project
from ..threads import in_pieces, join
from .spline_system import Array, Rows

PRESERVE_WEIGHT, AROUND_WEIGHT = 10.0, 0.3
"""Weights of rows; a target has 1. With half of the first the rim moves two fifths farther and
normals of untouched surface turn half as much again; what lies under the stroke is 8 % closer."""

SLOPE_WEIGHT = 0.5
"""Weight of a slope row, in cells: what one unit of slope weighs in units of length. With half as
much edits are a fifth closer, but crumbs come beside high ridges."""

NORMAL_BIAS = 1.0
"""How much directions of slope rows lean towards the normal, along which |grad f| shows."""

NEAR = 0.9
"""Cells: the surface passes a cell whose middle is nearer, for half of its diagonal is 0.87."""

STEEPEST = 2.0
"""|grad f|, beyond which a cell that the surface just meets may be missed."""

BEYOND = 0.35
"""Cells aside of its nearest sample, from which on a point may lie beyond a crease."""

CREASED = 0.9
"""Cosine of the angle between normals of neighbouring samples, below which a crease is between."""

NEAREST_SAMPLES = 10
"""Nearest samples, which tell how far apart they are and on which side of a crease a point is. With
6 of them, and half a cell for BEYOND, blades of a cell have twice as many points on the wrong side.
"""

FARTHEST = 2.0
"""Cells: the largest |f| that a row beside a fold asks for, unless |f0| is larger and its side
stays. With half as much, f is flat above a carve, and the next stroke there comes out with holes.
With twice as much, lips along the rim of a thin part turn the untouched surface."""

TRIES = 3
"""Points in each such cell that are brought to the surface."""

MORE = 2
"""New samples beside each one in the cells of a finer level, whose faces are a quarter as large.
With three, steep strokes take a tenth longer and are 3 % closer."""


class EditedSurface:
    """Samples of the surface after the stroke: where it is displaced, and where it is untouched."""

    def __init__(
        self,
        problem: Problem,
        displaced: DisplacedSurface,
        active: NDArray[np.int32],
        coarse: NDArray[np.int32],
        beyond: NDArray[np.int32],
        level: int,
        random: np.random.Generator,
    ) -> None:
        """For nodes in the cells `active` of a level and `coarse` of the one above it, of which
        those `beyond` have no active ones.

        rows: all of them
        """
        self._problem, self._swept, self.target = problem, displaced.swept, displaced.after
        self.kept, f0 = self._preserved(active, coarse, level, random)
        self._before_and_after = join([(displaced.before, displaced.after), (self.kept, self.kept)])
        self._look()
        held = np.zeros(len(self.kept.points), np.float32)
        f0_beyond = values(problem.field, centres(places(beyond, level - 1), level - 1))
        parts = [
            (self.kept.points, held, held, np.full_like(held, PRESERVE_WEIGHT)),
            _value_rows(*self._around(active, level, f0), f0),
            _value_rows(*self._around(beyond, level - 1, f0_beyond), f0_beyond),
        ]
        asked = displaced.f, displaced.gradient
        self.rows = _rows(self.target, asked, level, random, parts)

    def finer(
        self,
        rows: Rows,
        active: NDArray[np.int32],
        level: int,
        field: Field,
        random: np.random.Generator,
    ) -> Rows:
        """The rows, and more in the cells `active` of a finer level: around the surface, and on it
        as dense as elsewhere.

        field: what f is so far
        """
        before, after = self._between(active, level, random)
        self._before_and_after = join([self._before_and_after, (before, after)])
        self._look()
        points, wanted = self._around(active, level)
        around = _value_rows(points, wanted, values(field, points))
        more = _rows(after, values_and_gradients(field, after.points), level, random, [around])
        more.at += len(rows.points)
        both = zip(vars(rows).values(), vars(more).values(), strict=True)
        return Rows(*map(np.concatenate, both))

    def _look(self) -> None:
        """Have all samples found by where they are."""
        self._tree = search_tree(self._before_and_after[1].points)

    def _between(
        self, cells: NDArray[np.int32], level: int, random: np.random.Generator
    ) -> tuple[Samples, Samples]:
        """More samples between those of the edited surface in `cells` of a level: where they were,
        and where they are."""
        before, after = self._before_and_after
        inside = np.isin(linear(cells_of(after.points, level), level), cells)
        start = before.where(np.repeat(np.flatnonzero(inside), MORE))
        folds = self._swept is not None
        beside = self._problem.beside if folds else self._problem.copies.beside
        return beside(start, spacing(level), random)

    def _around(
        self, active: NDArray[np.int32], level: int, f0: NDArray[np.float32] | None = None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Points in the active cells (N, 3), and what f shall be there (N,). `f0` is what it was,
        if that is known."""
        points = centres(places(active, level), level)
        before, after = self._before_and_after
        moves = (after.points != before.points).any(axis=1)

        def was(some: NDArray[np.intp]) -> NDArray[np.float32]:
            return values(self._problem.field, points[some]) if f0 is None else f0[some]

        def measure(part: slice) -> tuple[Array, NDArray[np.floating], NDArray[np.bool_]]:
            found = self._tree.query(points[part])
            away, nearest = np.asarray(found[0]), np.asarray(found[1])
            sample = after.where(nearest)
            plane = ((points[part] - sample.points) * sample.normals).sum(axis=1)
            aside = np.sqrt(np.maximum(away**2 - plane**2, 0))
            some, moved = np.flatnonzero(aside > BEYOND * spacing(level)), moves[nearest]
            found = self._beyond(points[part][some], nearest[some], plane[some], aside[some])
            plane[some], other = found
            moved[some] |= moves[other]
            return plane, away, moved

        wanted, away, moved = in_pieces(measure, len(points), self._problem.check)
        kept = np.flatnonzero(~moved)
        wanted[kept] = was(kept)
        if self._swept is not None:
            near = np.flatnonzero(self._swept.near(points) | (away > spacing(level)))
            f0_near = was(near)
            sides = np.where(self._problem.folded.inside(points[near], f0_near), -1, 1)
            most = np.maximum(sides * f0_near, FARTHEST * spacing(level))
            wanted[near] = sides * np.minimum(self._problem.folded.distance(points[near]), most)
        return points, wanted.astype(np.float32)

    def _beyond(
        self, points: Array, nearest: NDArray[np.intp], plane: Array, aside: Array
    ) -> tuple[Array, NDArray[np.intp]]:
        """Signed distances (N,) of points (N, 3) that do not lie over their nearest samples, and
        a sample (N,) across the crease beyond which they are; the nearest where there is none.

        plane, aside: how far they are from these along and across their normals

        Beyond a crease a plane goes on, and the surface does not: outside is what lies above either
        plane of a convex crease, and above both of a concave one, whose normals lean together. On a
        wall that is stretched samples are far apart, too, but look the same way.
        """
        after = self._before_and_after[1]
        if not len(points) or len(after.points) < NEAREST_SAMPLES:
            return plane, nearest
        apart = self._tree.query(after.points[nearest], NEAREST_SAMPLES)[0][:, -1]  # (N,)
        across = np.maximum(aside - apart, 0)
        away, close = self._tree.query(points, NEAREST_SAMPLES)  # (N, NEAREST_SAMPLES)
        near = away < away[:, :1] + apart[:, None]
        own, facing = after.where(nearest), after.normals[close]
        cosines = np.where(near, np.einsum("nka,na->nk", facing, own.normals), 1)
        least = cosines.argmin(axis=1)[:, None]
        creased = np.take_along_axis(cosines, least, axis=1)[:, 0] < CREASED
        other = np.where(creased, np.take_along_axis(close, least, axis=1)[:, 0], nearest)
        across_it = after.where(other)
        apart_by = across_it.points - own.points
        convex = (apart_by * (across_it.normals - own.normals)).sum(axis=1) > 0
        its_plane = ((points - across_it.points) * across_it.normals).sum(axis=1)
        side = np.where(convex, np.maximum(plane, its_plane), np.minimum(plane, its_plane))
        return np.where(creased, np.copysign(np.hypot(plane, across), side), plane), other

    def _preserved(
        self,
        active: NDArray[np.int32],
        coarse: NDArray[np.int32],
        level: int,
        random: np.random.Generator,
    ) -> tuple[Samples, NDArray[np.float32]]:
        """Samples of the untouched surface wherever the nodes in `active` and `coarse` reach,
        and f in the middles of the active cells (K,).

        Where f is linear, the middle of a cell tells how far its points are from the surface, so
        projection has little left to do, and what the stroke touches is left out before.
        """
        h, problem = spacing(level), self._problem
        fine = children(dilated(coarse, level - 1), level - 1)
        reached = merged(np.concatenate([dilated(active, level), fine]))
        middles = centres(places(reached, level), level)
        value = values(problem.field, middles)
        before = value[np.searchsorted(reached, active)]
        middles = middles[np.abs(value) < NEAR * h * STEEPEST]
        value, gradient = values_and_gradients(problem.field, middles)
        slope = np.linalg.norm(gradient, axis=1)
        near = np.repeat(np.flatnonzero(np.abs(value) < NEAR * h * np.maximum(slope, 1)), TRIES)
        away = random.uniform(-h / 2, h / 2, (len(near), 3)).astype(np.float32)
        normals = gradient[near] / np.maximum(slope[near], SMALLEST_GRADIENT)[:, None]
        f = value[near] + np.einsum("na,na->n", away, gradient[near])
        step = (f / np.maximum(slope[near], SMALLEST_GRADIENT))[:, None]
        samples = Samples(middles[near] + away - step * normals, normals)
        start = samples.where(problem.copies.untouched(samples)).points
        found = project(problem.field, start, tolerance=ARRIVED)
        problem.check()
        place = linear(cells_of(found.points, level), level)
        kept = (found.distance < ON_SURFACE) & np.isin(place, reached)
        samples = Samples(found.points[kept], found.normals[kept])
        if self._swept is not None:
            samples = samples.where(~self._swept.swallows(samples.points))
        return samples, before


def _value_rows(points: Array, wanted: Array, f: Array) -> tuple[Array, Array, Array, Array]:
    """Points, targets, residuals and weights of rows (N,) around the surface, where f is so far."""
    return points, wanted, wanted - f, np.full(len(f), AROUND_WEIGHT, np.float32)


def _rows(
    surface: Samples,
    sampled: tuple[Array, Array],
    level: int,
    random: np.random.Generator,
    parts: list[tuple[Array, Array, Array, Array]],
) -> Rows:
    """Target and slope rows that bring the zero level of a field to `surface` (N,), where it has
    the values and gradients `sampled`; after them the value rows in `parts`."""
    f, gradient = sampled
    directions = random.normal(size=gradient.shape) + NORMAL_BIAS * surface.normals
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    slopes = np.einsum("na,na->n", surface.normals - gradient, directions)
    values = join([(surface.points, np.zeros_like(f), -f, np.ones_like(f)), *parts])
    return Rows(
        *values,
        np.arange(len(f)),
        directions.astype(np.float32),
        slopes.astype(np.float32),
        np.full(len(f), SLOPE_WEIGHT * spacing(level), np.float32),
    )
