# SPDX-License-Identifier: GPL-3.0-or-later
"""The residual rows of an absorption (docs/method.md, section 6).

target    f = 0, and the gradient      on what was moved
preserve  f and its gradient as now    on the rest of the patch, where the nodes reach
side      f = signed distance          beside some samples of what was moved, and in the middles of
                                       cells without samples; f as now where the rest is nearer

Model space.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..evaluate import values
from ..field import Field, Sampled
from ..fit.fit_detail import (
    EMPTY_WEIGHT,
    FIT_COARSEST,
    SIDE_FROM,
    SIDE_TO,
    SIDE_WEIGHT,
    SLOPE_WEIGHT,
    among,
)
from ..geometry import search_tree, unit
from ..levels import cells_of, centres, children, dilated, linear, places, spacing
from ..solve.spline_system import Rows
from .patch import Patch

Array = NDArray[np.float32]

MOVED_PER_SIDE = 3
"""Samples of what was moved for each that has a row beside it, as in a fit."""

KEPT_WEIGHT = 1.5  # weight of what was not moved, where a moved vertex has 1

Signed = Callable[[Array, Array, NDArray[np.bool_]], ArrayLike]
"""The signed distance (N,) to a surface, of points (N, 3), the values (N,) of the field there, and
for which of them (N,) it is to be exact: of the others only the sign counts."""


class TargetDistance:
    """What the field shall be off the surface.

    The signed distance where the moved surface is nearest. Elsewhere what the field was, but where
    the side has changed, and within a cell of pieces that are gone, that distance, no more of it
    than a cell, for around these the field stays small.
    """

    def __init__(
        self, field: Field, signed: Signed, patch: Patch, gone: Sequence[Array] = ()
    ) -> None:
        """gone: points (K, 3) of each of these pieces"""
        self.field, self.patch = field, patch
        self._signed, self._tree = signed, search_tree(patch.points)
        self._gone = search_tree(np.concatenate(gone)) if gone else None

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """What it shall be at `points` (N, 3), and what it was."""
        value = values(self.field, points)
        near = self.patch.moved[self._tree.query(points)[1]]
        truth = np.asarray(self._signed(points, value, near))
        h = spacing(FIT_COARSEST)
        changed = (truth < 0) != (value < 0)
        if self._gone is not None:
            changed |= np.isfinite(self._gone.query(points, distance_upper_bound=h)[0])
        target = np.where(near, truth, np.where(changed, truth.clip(-h, h), value))
        return target.astype(np.float32), value


def first_rows(
    asked: TargetDistance,
    there: Sampled,
    levels: range,
    h: float,
    between: Array,
    rng: np.random.Generator,
) -> tuple[Rows, dict[int, NDArray[np.int32]]]:
    """The equations of levels that are everywhere, and the nodes of each.

    there: the field at the moved points
    h:     spacing of the finest level that there may be
    """
    field, patch = asked.field, asked.patch
    points, wanted = patch.points[patch.moved], patch.gradients[patch.moved]
    nodes, inside, empty = {}, np.zeros(len(patch.points), bool), []
    for level in levels:
        shown = patch.moved  # and, where the largest cells reach, what has not moved
        if levels[0] < FIT_COARSEST and level < levels[-1]:
            shown = shown | inside
        touched = patch.points[shown]
        if level <= FIT_COARSEST:
            touched = np.concatenate([touched, between])
        cells = linear(cells_of(touched, level), level)
        nodes[level] = dilated(np.unique(cells), level)
        reached = dilated(nodes[level], level)
        inside |= among(linear(cells_of(patch.points, level), level), reached)
        for larger in range(level, FIT_COARSEST):  # a row in each of the usual cells
            reached = children(reached, larger)
        empty.append(apart(reached, patch.points, max(level, FIT_COARSEST)))
    kept = patch.points[inside & ~patch.moved]

    side = beside(points, wanted, h, rng)
    off = np.concatenate([side, *empty])
    target, value = asked(off)
    f, gradient = there
    at = np.concatenate([points, kept])
    along = rng.standard_normal(at.shape, np.float32)
    along = unit(along)
    slopes = np.zeros(len(at), np.float32)
    n = len(points)
    slopes[:n] = ((wanted - gradient) * along[:n]).sum(axis=1)
    targets = np.concatenate([np.zeros(n), values(field, kept), target]).astype(np.float32)
    residuals = np.concatenate([-f, np.zeros(len(kept)), target - value]).astype(np.float32)
    weights = np.repeat(
        [1, KEPT_WEIGHT, SIDE_WEIGHT, EMPTY_WEIGHT], [n, len(kept), len(side), len(off) - len(side)]
    )
    rows = Rows(
        points=np.concatenate([at, off]),
        targets=targets,
        residuals=residuals,
        weights=weights.astype(np.float32),
        at=np.arange(len(at)),
        along=along,
        slopes=slopes,
        steep=np.full(len(at), SLOPE_WEIGHT * h, np.float32),
    )
    return rows, nodes


def apart(reached: NDArray[np.int32], points: Array, level: int) -> Array:
    """The middles (N, 3) of those of the cells `reached` of a level that have none of the surface's
    points (P, 3)."""
    without = np.setdiff1d(reached, linear(cells_of(points, level), level))
    return centres(places(without, level), level)


def beside(points: Array, wanted: Array, h: float, rng: np.random.Generator) -> Array:
    """Points (K, 3) beside some of `points` (N, 3), whose gradients are `wanted` (N, 3)."""
    some = slice(None, None, MOVED_PER_SIDE)
    side = rng.uniform(SIDE_FROM, SIDE_TO, len(points[some])) * rng.choice(
        [-h, h], len(points[some])
    )
    return points[some] + side[:, None].astype(np.float32) * unit(wanted[some])
