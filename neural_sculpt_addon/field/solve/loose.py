# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose parts: solid or hollow without a connection to the rest, left where a stroke folds the
surface over (docs/method.md, section 4.4).

A stroke displaces the surface and tears nothing off, so nobody asked for them. Most are smaller
than the proxy's cells, so they are looked for in those of the stroke and in finer ones, by the sign
of the field in their middles. Model space.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...common.progress import Check
from ..evaluate import values
from ..field import Field
from ..levels import block, cells_of, centres, children, dilated, linear, places, spacing
from ..mesh.pieces import Islands
from ..mesh.surface import Samples
from ..threads import in_pieces

SMALLEST = 8  # level of cells in which they are looked for last
COLUMNS = block(-1, 2)[1::3]  # (9, 3), steps to the cells beside one in all but the last axis


def loose_parts(
    field: Field,
    cells: NDArray[np.int32],
    level: int,
    held: Callable[[], Samples],
    check: Check,
    divided: NDArray[np.int32],
) -> dict[int, Islands]:
    """Loose parts by the level of the cells that show them: the middles of these, and half a cell
    of the other side.

    cells:   (N,) of a level, rising, that are looked at: what goes on beyond them is not loose
    held:    gives samples of the untouched surface: a part that has some of it is not loose
    divided: cells (M,) among them whose children are looked at, too, if the surface may pass them

    The neighbours of children in other cells are not evaluated: they have the sign of their cell.
    """
    found, f = dict[int, Islands](), _middle_values(field, cells, level, check)
    while True:
        h = spacing(level)
        loose = _is_loose(cells, f < 0, level, held, check)
        if loose.any():
            middles = centres(places(cells[loose], level), level)
            found[level] = Islands(middles, np.where(f[loose] < 0, h, -h) / 2)
        if level >= SMALLEST:
            return found
        near = cells[(np.abs(f) < h) & ~loose & np.isin(cells, divided, assume_unique=True)]
        around = np.intersect1d(dilated(near, level), cells, assume_unique=True)
        finer = children(around, level)
        parents = linear(cells_of(centres(places(finer, level + 1), level + 1), level), level)
        f = f[np.searchsorted(cells, parents)]
        passed = np.isin(parents, near)
        f[passed] = _middle_values(field, finer[passed], level + 1, check)
        cells, divided, level = finer, finer[passed], level + 1


def _middle_values(
    field: Field, cells: NDArray[np.int32], level: int, check: Check
) -> NDArray[np.float32]:
    """f (N,) in the middles of `cells` (N,) of a level."""
    middles = centres(places(cells, level), level)
    return in_pieces(lambda part: values(field, middles[part]), len(cells), check)


def _is_loose(
    cells: NDArray[np.int32],
    inside: NDArray[np.bool_],
    level: int,
    held: Callable[[], Samples],
    check: Check,
) -> NDArray[np.bool_]:
    """Which of the cells (N,), rising, of which some are `inside`, are of a loose part.

    Runs of cells of one side along the last axis are connected, of which there are far fewer.
    """
    starts = np.ones(len(cells), bool)
    starts[1:] = (cells[1:] != cells[:-1] + 1) | (inside[1:] != inside[:-1])
    run = np.cumsum(starts) - 1  # (N,), of each cell
    first = np.flatnonzero(starts)  # (R,), cell of each run
    size = np.diff(first, append=len(cells))
    low, high = cells[first] - 1, cells[first] + size.astype(np.int32)  # of cells that touch it
    whole = np.ones(len(first), bool)
    pairs = [np.zeros((2, 0), np.intp)]
    for step in linear(COLUMNS, level):
        check()
        start = np.searchsorted(cells, low + step)
        end = np.searchsorted(cells, high + step, side="right")
        whole &= end - start == size + 2
        if step < 0:
            some = np.flatnonzero(end > start)
            touching = run[start[some]]
            count = run[end[some] - 1] - touching + 1
            one = np.repeat(some, count)
            other = np.arange(len(one)) + np.repeat(touching - np.cumsum(count) + count, count)
            pairs.append(np.stack([one, other])[:, inside[first[one]] == inside[first[other]]])
    graph = coo_array(
        (np.ones(sum(p.shape[1] for p in pairs), bool), np.concatenate(pairs, axis=1)),
        (len(first),) * 2,
    )
    total, part = connected_components(graph, directed=False)
    part_of = part[run]
    loose = np.ones(total, bool)
    loose[part[~whole]] = False
    if not loose.any():
        return loose[part_of]
    points, normals = held()
    for side in (-1, 1):
        step = np.float32(side * spacing(level)) * normals
        beside = linear(cells_of(points + step, level), level)
        loose[part_of[np.isin(cells, beside)]] = False
    return loose[part_of]
