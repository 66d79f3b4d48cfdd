# SPDX-License-Identifier: GPL-3.0-or-later
"""The residual rows of a local edit (docs/method.md, section 4.2).

target    f(p') = 0                  on the displaced surface
slope     grad f(p') . e = n' . e    there, along random directions e that lean towards n'
preserve  f(q) = f0(q)               on the untouched surface, wherever the new detail reaches:
                                     around the stroke, and on other sheets of thin parts
around    f(x) = signed distance     in the middle of each active cell, and of coarse ones beyond,
                 of the new surface  where the displaced surface is nearest; f0 elsewhere

The middle of a cell is where its node is: a spline is far better determined there than by random
points, between which it can swing. The distance is that from the plane of the nearest sample.
Where the displaced surface runs through itself, winding numbers tell the sides (see `fold`), and
where a plane contradicts them, a rough distance follows from the sides around. Model space.
"""

import numpy as np
import torch
from numpy.typing import NDArray

from ..detail import (
    Grid,
    around,
    cells_of,
    centres,
    children,
    dilated,
    linear,
    places,
    spacing,
)
from ..evaluate import values, values_and_gradients
from ..field import Field
from ..nearest import search_tree
from ..problem import DisplacedTubes, Problem
from ..projection import SMALLEST_GRADIENT, project
from ..surface import Samples
from ..threads import in_pieces, join
from .spline_system import Rows

PRESERVE, AROUND = 2.5, 0.3
"""Weights of rows; a target has 1."""

STEEP = 0.5
"""Weight of a slope row, in cells: what one unit of slope weighs in units of length."""

UPRIGHT = 1.0
"""How much directions of slope rows lean towards the normal, along which |grad f| shows."""

NEAR = 0.9
"""Cells: the surface passes a cell whose middle is nearer, for half of its diagonal is 0.87."""

TRIES = 3
"""Points in each such cell that are brought to the surface."""

MORE = 3
"""Samples between those of a missed cell, for each: so its halves have as many as it had."""

ON_SURFACE = 1e-3
"""What projection may leave; farther away it has lost its way."""

OCCUPIED = 1.5
"""Cells: the distance that a cell has around which all are on one side."""

BURIED = 0.5
"""|winding number| of the swept volume, from which on it has swallowed a sample."""


class EditedSurface:
    """Samples of the surface after the stroke: where it is displaced, and where it is untouched."""

    def __init__(
        self,
        problem: Problem,
        displaced: DisplacedTubes,
        gaps: tuple[Samples, Samples],
        active: NDArray[np.int32],
        coarse: NDArray[np.int32],
        level: int,
        random: np.random.Generator,
    ) -> None:
        """For nodes in the cells `active` of a level and `coarse` of the one above it.

        gaps: what the tubes lack, see `Problem.gaps`
        """
        self._problem, self._swept = problem, displaced.swept
        self.target = join([displaced.joined("target"), gaps[1]])
        self.kept, self._before = self._preserved(active, coarse, level, random)
        self._cloud = join([self.target, self.kept])
        self._unedited = join([displaced.joined("surface"), gaps[0], self.kept])
        self._tree = search_tree(self._cloud.points)

    def rows(
        self,
        active: NDArray[np.int32],
        beyond: NDArray[np.int32],
        level: int,
        random: np.random.Generator,
    ) -> Rows:
        """All rows, with those around it in the cells `active` of a level and `beyond` of the one
        above it."""
        rows = _on_surface(self._problem.field, self.target, level, random)
        held = np.zeros(len(self.kept.points), np.float32)
        rows.add(self.kept.points, held, held, PRESERVE)
        points, wanted = self._around(active, level, self._before)
        rows.add(points, wanted, wanted - self._before, AROUND)
        before = values(self._problem.field, centres(places(beyond, level - 1), level - 1))
        points, wanted = self._around(beyond, level - 1, before)
        rows.add(points, wanted, wanted - before, AROUND)
        return rows

    def add_finer(
        self,
        rows: Rows,
        missed: NDArray[np.int32],
        active: NDArray[np.int32],
        level: int,
        field: Field,
        random: np.random.Generator,
    ) -> None:
        """Rows for the cells `active` of a level, too: around, and on the surface in the cells
        `missed` of the level above, as dense as elsewhere. `field` is what f is so far.
        """
        before = values(self._problem.field, centres(places(active, level), level))
        points, wanted = self._around(active, level, before)
        rows.add(points, wanted, wanted - values(field, points), AROUND)
        if self._swept is None:
            rows.extend(_on_surface(field, self._between(missed, level, random), level, random))

    def _between(
        self, cells: NDArray[np.int32], level: int, random: np.random.Generator
    ) -> Samples:
        """More samples of the edited surface between those in `cells` of the level above."""
        h = spacing(level)
        inside = np.isin(linear(cells_of(self._cloud.points, level - 1), level - 1), cells)
        start = np.repeat(self._unedited.where(inside).points, MORE, axis=0)
        start += random.uniform(-h / 2, h / 2, start.shape).astype(np.float32)
        found = project(self._problem.field, start, tolerance=ON_SURFACE / 10)
        surface = Samples(found.points, found.normals).where(found.distance < ON_SURFACE)
        return self._problem.displaced(surface)[0]

    def _around(
        self, active: NDArray[np.int32], level: int, f0: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Points in the active cells (N, 3), and what f shall be there (N,), given what it was."""
        points = centres(places(active, level), level)

        def measure(part: slice) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
            nearest = np.asarray(self._tree.query(points[part])[1])
            sample = self._cloud.where(nearest)
            return ((points[part] - sample.points) * sample.normals).sum(axis=1), nearest

        distance, nearest = in_pieces(measure, len(points), self._problem.check)
        wanted = np.where(nearest < len(self.target.points), distance, f0)
        if self._swept is not None:
            inside = (f0 < 0) + self._swept.winding(points) > BURIED
            wrong = (wanted < 0) != inside
            wanted[wrong] = _occupancy(active, inside, level)[wrong]
        return points, wanted.astype(np.float32)

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
        reached = np.union1d(dilated(active, level), fine)
        middles = centres(places(reached, level), level)
        value, gradient = values_and_gradients(problem.field, middles)
        before = value[np.searchsorted(reached, active)]
        slope = np.linalg.norm(gradient, axis=1)
        near = np.repeat(np.flatnonzero(np.abs(value) < NEAR * h * np.maximum(slope, 1)), TRIES)
        away = random.uniform(-h / 2, h / 2, (len(near), 3)).astype(np.float32)
        normals = gradient[near] / np.maximum(slope[near], SMALLEST_GRADIENT)[:, None]
        f = value[near] + np.einsum("na,na->n", away, gradient[near])
        step = (f / np.maximum(slope[near], SMALLEST_GRADIENT))[:, None]
        samples = Samples(middles[near] + away - step * normals, normals)
        start = samples.where(problem.untouched(samples)).points
        found = project(problem.field, start, tolerance=ON_SURFACE / 10)
        problem.check()
        place = linear(cells_of(found.points, level), level)
        kept = (found.distance < ON_SURFACE) & np.isin(place, reached)
        samples = Samples(found.points[kept], found.normals[kept])
        if self._swept is not None:
            samples = samples.where(np.abs(self._swept.winding(samples.points)) < BURIED)
        return samples, before


def _on_surface(field: Field, surface: Samples, level: int, random: np.random.Generator) -> Rows:
    """Target and slope rows that bring the zero level of a field to `surface`."""
    f, gradient = values_and_gradients(field, surface.points)
    directions = random.normal(size=gradient.shape) + UPRIGHT * surface.normals
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    slopes = np.einsum("na,na->n", surface.normals - gradient, directions)
    return Rows(
        surface.points,
        np.zeros_like(f),
        -f,
        np.ones_like(f),
        surface.points,
        directions.astype(np.float32),
        slopes.astype(np.float32),
        np.full(len(f), STEEP * spacing(level), np.float32),
    )


def _occupancy(
    cells: NDArray[np.int32], inside: NDArray[np.bool_], level: int
) -> NDArray[np.float32]:
    """A rough distance (K,) in the middles of cells (K,) of a level: by how many of those around
    each are `inside`, so that it is smooth where neither samples nor planes tell."""
    sides = Grid.empty(level).plus(cells, np.where(inside, -1, 1).astype(np.float32))
    seen = around([sides], torch.from_numpy(centres(places(cells, level), level)))
    nodes = seen.nodes.numpy()  # (27, K), 0 of cells that are not among them
    return OCCUPIED * spacing(level) * nodes.sum(axis=0) / np.abs(nodes).sum(axis=0)
