# SPDX-License-Identifier: GPL-3.0-or-later
"""Repair of a fit: its `strays` are taken away (docs/method.md, section 5).

Where the mesh is too far, and in all of what has the wrong side there, the exact distance is asked
for anew on a level of its own, as coarse as the mesh is far. Then what has changed is looked at
again, and nothing else. Model space.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from ...common.progress import Check, Progress, silent, sub_progress
from ..evaluate import values
from ..field import Field
from ..levels import (
    Coefficients,
    Level,
    cells_of,
    centres,
    dilated,
    distinct,
    linear,
    places,
    spacing,
    support,
)
from ..mesh.proxy import Proxy, sketch, update_sketch
from ..solve.spline_system import Rows, solve_level
from ..threads import join
from .fit_detail import among
from .mesh_distance import MeshDistance
from .strays import Cells, Points, Strays, find_hidden, find_strays, find_tiny, is_within

REPAIR_COARSEST, REPAIR_FINEST = 4, 7  # levels that take strays away
CELLS_TO_STRAY = 2.0  # cells of such a level between the mesh and the stray
SPLINE_REACH = 2.0  # cells, from which on a spline is as good as zero
ROWS_PER_CELL = 3  # rows in each cell
MOST_WRONG_CELLS = 1 << 14  # cells that are looked through for the wrong side
REPAIRED_CELLS = 1 << 16
"""Cells of a level that are dealt with in a round, at the strays farthest from the mesh: some 3 s.
More are there where the mesh is thinner than the field can hold all over, and no round helps."""
ROUNDS, LOOKED = 4, 2  # rounds at most, and the first ones, which look for what is hidden, too
FEW_STRAYS, HELPED = 500, 0.7  # strays, or share of them, that may be left for another round


class Repaired(NamedTuple):
    """A field without strays, its proxy, and the strays that are left."""

    field: Field
    proxy: Proxy
    left: Strays


def repaired(
    field: Field,
    distance: MeshDistance,
    cells: int,
    rng: np.random.Generator,
    progress: Progress = silent,
    may_add: bool = True,
) -> Repaired:
    """The field without surface that the mesh has nothing near to.

    cells:   of the proxy, along each axis, that shows it
    may_add: whether the field may have detail; without, strays are only counted

    SculptError when the field has no surface at all.
    """
    reached: Cells | None = None  # what has changed since it was looked at
    proxy = sketch(field, cells, sub_progress(progress, 0, 0.5))
    strays, tiny = find_strays(proxy, distance), find_tiny(field, proxy, distance)
    for number in range(ROUNDS if may_add else 0):
        every = join([strays, tiny])
        if number < LOOKED:
            every = join([every, find_hidden(field, proxy, distance, rng, reached)])
        if not len(every.points):
            break
        check = partial(progress, 0.5 + 0.5 * number / ROUNDS, "Removing strays")
        added = _around(field, distance, every, number // LOOKED, rng, check)
        field = field.plus(added)
        reached = support(added)
        proxy = update_sketch(proxy, field, reached, lambda *_, check=check: check())
        new = find_strays(proxy, distance, reached)
        elsewhere = ~is_within(strays.points, reached)
        strays = join([Strays(strays.points[elsewhere], strays.away[elsewhere]), new])
        tiny = find_tiny(field, proxy, distance)
        if len(strays.points) > max(FEW_STRAYS, HELPED * len(every.points)):
            break
    return Repaired(field, proxy, join([strays, tiny]))


def _around(
    field: Field,
    distance: MeshDistance,
    strays: Strays,
    finer: int,
    rng: np.random.Generator,
    check: Check,
) -> Coefficients:
    """Detail that gives the field the mesh's distance around strays, on levels as coarse as the
    mesh is far, or so many `finer`: in a gap, a coarse one may have no node that leaves the mesh
    as it is."""
    found: dict[int, Level] = {}
    order = np.argsort(-strays.away, kind="stable")
    strays = Strays(strays.points[order], strays.away[order])
    wanted = (
        (np.ceil(np.log2(CELLS_TO_STRAY / strays.away)) + finer)
        .clip(REPAIR_COARSEST, REPAIR_FINEST)
        .astype(int)
    )
    for level in np.unique(wanted).tolist():
        points = strays.points[wanted == level]
        wrong = _wrong_cells(field, distance, points, level, check)
        while True:
            cells = np.union1d(distinct(cells_of(points, level), level), wrong).astype(np.int32)
            nodes = dilated(dilated(cells, level), level)
            reached = dilated(nodes, level)
            if len(reached) <= REPAIRED_CELLS:
                break
            points, wrong = points[: len(points) // 2], wrong[: len(wrong) // 2]
        if level < REPAIR_FINEST:  # the mesh's own surface stays as it is
            middles = centres(places(nodes, level), level).astype(float)
            nodes = nodes[distance.away(middles) > SPLINE_REACH * spacing(level)]
        rows = _rows(field, distance, reached, level, rng, check)
        found[level] = solve_level(level, nodes, rows, check)
        field = field.plus({level: found[level]})
    return found


def _wrong_cells(
    field: Field, distance: MeshDistance, points: Points, level: int, check: Check
) -> Cells:
    """Cells of a level among the points (P, 3) whose middle is on the wrong side, rising."""
    first, last = cells_of(np.stack([points.min(axis=0), points.max(axis=0)]), level)
    size = last - first + 1
    if size.prod() > MOST_WRONG_CELLS:  # so much is wrong that it takes several rounds
        return np.empty(0, np.int32)
    cells = np.indices(size).reshape(3, -1).T.astype(np.int32) + first
    index = distinct(cells, level)
    middle = centres(places(index, level), level)
    true = distance(middle.astype(float), lambda *_: check()).value
    return index[(true < 0) != (values(field, middle) < 0)]


def _rows(
    field: Field,
    distance: MeshDistance,
    reached: Cells,
    level: int,
    rng: np.random.Generator,
    check: Check,
) -> Rows:
    """The mesh's distance in `reached` cells, rising."""
    points = np.repeat(centres(places(reached, level), level), ROWS_PER_CELL, axis=0)
    points += np.float32(spacing(level)) * (rng.random(points.shape, np.float32) - np.float32(0.5))
    points = points[among(linear(cells_of(points, level), level), reached)]
    target = distance(points.astype(float), lambda *_: check()).value.astype(np.float32)
    none = np.empty((0, 3), np.float32)
    return Rows(
        points=points,
        targets=target,
        residuals=target - values(field, points),
        weights=np.ones(len(points), np.float32),
        at=np.empty(0, np.intp),
        along=none,
        slopes=none[:, 0],
        steep=none[:, 0],
    )
