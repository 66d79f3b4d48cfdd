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
from scipy.spatial import KDTree

from ..detail import Grid, cells_of, centres, linear, places, spacing
from ..evaluate import values, values_and_gradients
from ..field import Field
from ..fold import SweptVolume
from ..problem import DisplacedTubes, Problem
from ..projection import project
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
        gaps: Samples,
        active: NDArray[np.int32],
        coarse: NDArray[np.int32],
        level: int,
        random: np.random.Generator,
    ) -> None:
        """For nodes in the cells `active` of a level and `coarse` of the one above it.

        gaps: targets that the tubes lack, see `Problem.gaps`
        """
        self._problem, self._swept = problem, displaced.swept
        self.target = join([displaced.joined("target"), gaps])
        self.kept = _preserved(problem, displaced.swept, active, coarse, level, random)
        self._cloud = join([self.target, self.kept])
        self._tree = KDTree(self._cloud.points)

    def rows(
        self,
        active: NDArray[np.int32],
        beyond: NDArray[np.int32],
        level: int,
        random: np.random.Generator,
    ) -> Rows:
        """All rows, with those around it in the cells `active` of a level and `beyond` of the one
        above it."""
        f0, gradient = values_and_gradients(self._problem.field, self.target.points)
        held = values(self._problem.field, self.kept.points)
        points, wanted, before = join(
            [self._around(active, level), self._around(beyond, level - 1)]
        )
        targets = np.concatenate([np.zeros_like(f0), held, wanted])
        directions = random.normal(size=gradient.shape) + UPRIGHT * self.target.normals
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        slopes = np.einsum("na,na->n", self.target.normals - gradient, directions)
        counts = [len(f0), len(held), len(points)]
        return Rows(
            np.concatenate([self.target.points, self.kept.points, points]),
            targets,
            targets - np.concatenate([f0, held, before]),
            np.repeat(np.array([1, PRESERVE, AROUND], np.float32), counts),
            self.target.points,
            directions.astype(np.float32),
            slopes.astype(np.float32),
            np.full(len(f0), STEEP * spacing(level), np.float32),
        )

    def add_around(self, rows: Rows, active: NDArray[np.int32], level: int, field: Field) -> None:
        """Rows in the cells `active` of a finer level, too; `field` is what f is so far."""
        points, wanted, _ = self._around(active, level)
        rows.add(points, wanted, wanted - values(field, points), AROUND)

    def _around(
        self, active: NDArray[np.int32], level: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """Points in the active cells (N, 3), what f shall be there (N,), and what it was (N,)."""
        points = centres(places(active, level), level)

        def measure(part: slice) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
            nearest = np.asarray(self._tree.query(points[part])[1])
            sample = self._cloud.where(nearest)
            return ((points[part] - sample.points) * sample.normals).sum(axis=1), nearest

        distance, nearest = in_pieces(measure, len(points), self._problem.check)
        f0 = values(self._problem.field, points)
        wanted = np.where(nearest < len(self.target.points), distance, f0)
        if self._swept is not None:
            inside = (f0 < 0) + self._swept.winding(points) > BURIED
            wrong = (wanted < 0) != inside
            wanted[wrong] = _occupancy(active, inside, level)[wrong]
        return points, wanted.astype(np.float32), f0


def _preserved(
    problem: Problem,
    swept: SweptVolume | None,
    active: NDArray[np.int32],
    coarse: NDArray[np.int32],
    level: int,
    random: np.random.Generator,
) -> Samples:
    """Samples of the untouched surface wherever the nodes in `active` and `coarse` reach."""
    h = spacing(level)
    reached = _reached(active, coarse, level)
    middles = centres(places(reached, level), level)
    value, gradient = values_and_gradients(problem.field, middles)
    near = np.abs(value) < NEAR * h * np.maximum(np.linalg.norm(gradient, axis=1), 1)
    start = np.repeat(middles[near], TRIES, axis=0)
    start += random.uniform(-h / 2, h / 2, start.shape).astype(np.float32)
    found = project(problem.field, start, tolerance=ON_SURFACE / 10)
    problem.check()
    place = linear(cells_of(found.points, level), level)
    kept = (found.distance < ON_SURFACE) & np.isin(place, reached)
    samples = Samples(found.points[kept], found.normals[kept])
    samples = samples.where(problem.untouched(samples))
    if swept is None:
        return samples
    return samples.where(np.abs(swept.winding(samples.points)) < BURIED)


def _reached(active: NDArray[np.int32], coarse: NDArray[np.int32], level: int) -> NDArray[np.int32]:
    """The cells of `level` that a node in `active` reaches, or one in `coarse` above it."""
    fine = places(active, level)[:, None] + _block(-1, 2)
    parents = (places(coarse, level - 1)[:, None] + _block(-1, 2)).reshape(-1, 3)
    corner = cells_of(centres(parents, level - 1) - np.float32(spacing(level) / 2), level)
    children = corner[:, None] + _block(0, 2)
    return np.unique(linear(np.concatenate([fine.reshape(-1, 3), children.reshape(-1, 3)]), level))


def _block(start: int, end: int) -> NDArray[np.int32]:
    """All steps (n^3, 3) from `start` to before `end` on each axis."""
    return (np.indices((end - start,) * 3).reshape(3, -1).T + start).astype(np.int32)


def _occupancy(
    cells: NDArray[np.int32], inside: NDArray[np.bool_], level: int
) -> NDArray[np.float32]:
    """A rough distance (K,) in the middles of cells (K,) of a level: by how many of those around
    each are `inside`, so that it is smooth where neither samples nor planes tell."""
    sides = Grid.empty(level).plus(cells, np.where(inside, -1, 1).astype(np.float32))
    _, base, _ = sides.around(torch.from_numpy(centres(places(cells, level), level)))
    around = sides.take(base).numpy()  # (27, K), 0 of cells that are not among them
    return OCCUPIED * spacing(level) * around.sum(axis=0) / np.abs(around).sum(axis=0)
