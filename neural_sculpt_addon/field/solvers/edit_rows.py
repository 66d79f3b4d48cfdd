# SPDX-License-Identifier: GPL-3.0-or-later
"""The residual rows of a local edit (docs/method.md, section 4.2).

target    f(p') = 0                  on the displaced surface
slope     grad f(p') . e = n' . e    there, along random directions e that lean towards n'
preserve  f(q) = f0(q)               on the untouched surface, wherever the new detail reaches:
                                     around the stroke, and on other sheets of thin parts
around    f(x) = signed distance     in the middle of each active cell, where the displaced surface
                 of the new surface  is nearest; f0 where the untouched one is

The middle of a cell is where its node is: a spline is far better determined there than by random
points, between which it can swing. The distance is that from the plane of the nearest sample. Its
sign is the plane's, too, unless the displaced surface runs through itself: then winding numbers
tell (see `fold`), and the corners of the cells are looked at, too. Model space.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..detail import cells_of, centres, linear, places, spacing
from ..evaluate import values, values_and_gradients
from ..fold import SweptVolume
from ..problem import DisplacedTubes, Problem
from ..projection import project
from ..surface import Samples
from ..threads import in_pieces, join
from .spline_system import Rows

PRESERVE, AROUND = 1.5, 0.3
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

BURIED = 0.5
"""|winding number| of the swept volume, from which on it has swallowed a sample."""


def edit_rows(
    problem: Problem,
    displaced: DisplacedTubes,
    active: NDArray[np.int32],
    coarse: NDArray[np.int32],
    level: int,
    random: np.random.Generator,
) -> Rows:
    """The rows of a stroke, for nodes in the cells `active` of a level and `coarse` of the next."""
    field = problem.field
    target = join([tube.target for tube in displaced.tubes])
    kept = _preserved(problem, displaced.swept, active, coarse, level, random)
    problem.check()
    points, distance = _around(problem, displaced.swept, target, kept, active, level)
    problem.check()
    f0, gradient = values_and_gradients(field, target.points)
    held = values(field, kept.points)
    before = np.concatenate([f0, held, values(field, points)])
    wanted = np.concatenate([np.zeros_like(f0), held, distance])
    directions = random.normal(size=gradient.shape) + UPRIGHT * target.normals
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    slopes = np.einsum("na,na->n", target.normals - gradient, directions)
    counts = [len(target.points), len(kept.points), len(points)]
    return Rows(
        np.concatenate([target.points, kept.points, points]),
        wanted,
        wanted - before,
        np.repeat(np.array([1, PRESERVE, AROUND], np.float32), counts),
        target.points,
        directions.astype(np.float32),
        slopes.astype(np.float32),
        np.full(len(target.points), STEEP * spacing(level), np.float32),
    )


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


def _around(
    problem: Problem,
    swept: SweptVolume | None,
    target: Samples,
    kept: Samples,
    active: NDArray[np.int32],
    level: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Points in each active cell (N, 3), and what f shall be there (N,)."""
    points = centres(places(active, level), level)
    if swept is not None:
        points = np.concatenate([points, points + np.float32(spacing(level) / 2)])
    cloud = join([target, kept])
    tree = KDTree(cloud.points)

    def measure(part: slice) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        away, nearest = tree.query(points[part])
        plane = ((points[part] - cloud.points[nearest]) * cloud.normals[nearest]).sum(axis=1)
        return np.stack([away, plane], axis=1), np.asarray(nearest)

    found, nearest = in_pieces(measure, len(points), problem.check)
    away, distance = found.T
    f0 = values(problem.field, points)
    distance = np.where(nearest < len(target.points), distance, f0)
    if swept is not None:
        inside = (f0 < 0) + swept.winding(points) > BURIED
        wrong = (distance < 0) != inside
        distance[wrong] = np.where(inside, -away, away)[wrong]
    return points, distance.astype(np.float32)
