# SPDX-License-Identifier: GPL-3.0-or-later
"""Absorption: the layer that brings the zero level of a field to the surface of a mesh.

    samples of the mesh -> rows, on the mesh and off it -> coefficients, the coarsest level first

Sculpted proxies, brush strokes and Booleans come as meshes. Model space. See docs/method.md,
section 6.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from ...common.progress import Progress, silent
from ..detail import Detail
from ..evaluate import values
from ..field import Field
from ..fit.fit_detail import (
    DAMPED,
    EMPTY_WEIGHT,
    FIT_COARSEST,
    ITERATIONS,
    MISSED_SHARE,
    SIDE_WEIGHT,
    SLOPE_WEIGHT,
    weigh_wrong_side,
)
from ..geometry import search_tree, unit
from ..levels import Coefficients, Level, cells_of, dilated, linear, quantised, spacing
from ..mesh.pieces import Islands
from ..projection import project
from ..solve.spline_system import LEAST_TOUCHED, Rows, solve_level
from .absorption_rows import KEPT_WEIGHT, Array, Signed, TargetDistance, apart, beside, first_rows
from .patch import Patch

LARGEST_CELLS = 3
"""Level of the largest cells, for what has moved far."""

DEPTH = 2.0
"""Cells of the coarsest level that the surface may pass on its way. On finer levels what f was deep
inside would stand a few cells from the zeros of the new surface: f would swing between the two, and
leave crumbs."""

CLEARED, CLEAR, HEAVIER = 6, 0.5, 4.0
"""Level on which islands are taken away, how far in its cells, and the weight of that."""

STEP_OF_WAY = 0.7  # of h, between places on the way of a vertex


class Tolerance(NamedTuple):
    """What is close enough."""

    distance: float  # model units
    slope: float  # of the gradient, along any direction


class Closely(NamedTuple):
    """Where finer levels come, and what they are told.

    tolerance: what is close enough for them to be left out
    between:   more samples of the surface, in cells (K,), rising, of a level
    """

    tolerance: Tolerance
    between: Callable[[NDArray[np.int32], int], Patch]


class Absorption:
    """The layer that brings the zero level of a field to a patch.

    Where the surface has moved far, levels coarser than usual hold the smooth rest of it.
    """

    def __init__(
        self,
        field: Field,
        patch: Patch,
        signed: Signed,
        finest: int,
        rng: np.random.Generator,
        progress: Progress = silent,
        origins: Array | None = None,
        closely: Closely | None = None,
        gone: Sequence[Array] = (),
    ) -> None:
        """Solve it, from the coarsest level to the finest.

        signed:    the signed distance to the new surface
        finest:    level
        origins:   (M, 3) where the moved points were; projected onto the field unless given
        closely:   where finer levels come; everywhere without it
        gone:      points (K, 3) of pieces of the old surface that shall be none any more
        """
        self._check = partial(progress, 0.5, "Absorbing")
        self._check()
        self._field, self._layer, self._detail = field, dict[int, Level](), Detail()
        moved = patch.points[patch.moved]
        between = _ways(moved, project(field, moved).points if origins is None else origins)
        there = field.sample(moved)
        on_way = between[len(moved) : -len(moved)]  # from there to where the field is 0
        passed = np.append(there.f, values(field, on_way))
        deepest = max(float(np.abs(passed).max(initial=0)), DEPTH * spacing(FIT_COARSEST))
        coarsest = max(math.floor(math.log2(DEPTH / deepest)), LARGEST_CELLS)
        if coarsest < FIT_COARSEST:
            within = np.array([[-1.0] * 3, [1.0] * 3]) if origins is None else between
            between = _changed(field, signed, within)
        for piece in gone:
            between = np.concatenate([between, piece, _changed(field, signed, piece)])
        everywhere = range(coarsest, 1 + (finest if closely is None else FIT_COARSEST))
        asked = TargetDistance(field, signed, patch, gone)
        self._rows, nodes = first_rows(asked, there, everywhere, spacing(finest), between, rng)
        self._points = patch.points
        for piece in gone:
            self._add_around(asked, piece, SIDE_WEIGHT)
        if closely is not None:
            self._add_samples(
                asked, closely.between(nodes[FIT_COARSEST], FIT_COARSEST), spacing(finest), rng
            )
        for level in everywhere:
            damped = LEAST_TOUCHED if coarsest < FIT_COARSEST >= level else DAMPED
            self._add(level, nodes[level], damped)
            # Larger cells reach farther than those of this level, and pieces that are gone change
            # sides far from all samples.
            if level == FIT_COARSEST and (gone or coarsest < level):
                near = weigh_wrong_side(self._rows, level)
                if len(near):
                    self._add(level, near)
        for level in range(everywhere.stop, finest + 1):
            assert closely is not None
            missed = _missed(self._rows, level, closely.tolerance)
            if not len(missed):
                break
            some = dilated(missed, level)
            more = closely.between(dilated(some, level), level)
            self._add_samples(asked, more, spacing(finest), rng)
            self._add_around(asked, apart(some, self._points, level))
            self._add(level, some)

    @property
    def layer(self) -> Coefficients:
        """What the field gets."""
        return self._layer

    def forbid(self, islands: Islands) -> None:
        """Take away surface where `islands` are, which came out though nobody asked for it.

        Rows are added at their vertices, and those that lie close by are brought to the same side.
        """
        rows, level = self._rows, min(CLEARED, max(self._layer))
        clear = np.float32(CLEAR * spacing(level))
        side = np.sign(islands.distance).astype(np.float32)  # (N,)
        tree = search_tree(islands.points)
        near = np.asarray(tree.query(rows.points, distance_upper_bound=spacing(level))[1])
        near[rows.at] = len(side)  # the surface itself stays
        some = np.flatnonzero(near < len(side))
        now, there = rows.targets[some], side[near[some]]
        wanted = np.where(now * there > 0, now, clear * there)
        rows.residuals[some] += wanted - now
        rows.targets[some] = wanted
        before = values(self._field.plus(self._layer), islands.points)
        rows.add(islands.points, clear * side, clear * side - before, HEAVIER)
        cells = np.unique(linear(cells_of(islands.points, level), level))
        self._add(level, dilated(cells, level), LEAST_TOUCHED)

    def _add_samples(
        self, asked: TargetDistance, more: Patch, h: float, rng: np.random.Generator
    ) -> None:
        """Rows on more of the surface, and beside it."""
        points, wanted, moved = more
        if not len(points):
            return
        f, gradient = self._field.sample(points)
        added, steeper = torch.zeros(len(points)), torch.zeros(len(points), 3)
        x = torch.from_numpy(points)
        self._detail.add_value_and_gradient(x, added, steeper)
        target = np.where(moved, 0, f).astype(np.float32)
        slope = np.where(moved[:, None], wanted, gradient) - gradient - steeper.numpy()
        along = unit(rng.standard_normal(points.shape, np.float32))
        rows, count = self._rows, len(points)
        self._rows = Rows(
            points=np.concatenate([rows.points, points]),
            targets=np.concatenate([rows.targets, target]),
            residuals=np.concatenate([rows.residuals, target - f - added.numpy()]),
            weights=np.concatenate(
                [rows.weights, np.where(moved, 1, KEPT_WEIGHT).astype(np.float32)]
            ),
            at=np.concatenate([rows.at, len(rows.points) + np.arange(count)]),
            along=np.concatenate([rows.along, along]),
            slopes=np.concatenate([rows.slopes, (slope * along).sum(axis=1)]),
            steep=np.concatenate([rows.steep, np.full(count, SLOPE_WEIGHT * h, np.float32)]),
        )
        self._points = np.concatenate([self._points, points])
        self._add_around(asked, beside(points[moved], wanted[moved], h, rng), SIDE_WEIGHT)

    def _add_around(
        self, asked: TargetDistance, points: Array, weight: float = EMPTY_WEIGHT
    ) -> None:
        """More rows off the surface, at `points` (N, 3)."""
        target, value = asked(points)
        added = torch.zeros(len(points))
        self._detail.add_value(torch.from_numpy(points), added)
        self._rows.add(points, target, target - value - added.numpy(), weight)

    def _add(self, level: int, nodes: NDArray[np.int32], damped: float = DAMPED) -> None:
        """Solve one level for what is left of the rows, and add it to the layer."""
        found = solve_level(level, nodes, self._rows, self._check, ITERATIONS, damped)
        self._detail = self._detail.plus({level: found})
        if level in self._layer:
            total = Level.sum([self._layer[level], found])
            found = Level(total.index, quantised(total.values))  # within the bound of coefficients
        self._layer[level] = found


def _missed(rows: Rows, level: int, tolerance: Tolerance) -> NDArray[np.int32]:
    """The cells (K,) of a level in which too many samples of the surface miss the tolerance."""
    kept = rows.weights[rows.at] == KEPT_WEIGHT  # was not moved, and shall not move by half as much
    off = np.abs(rows.residuals[rows.at]) > np.where(kept, 0.5, 1) * tolerance.distance
    off |= np.abs(rows.slopes) > tolerance.slope
    lies_in = linear(cells_of(rows.points[rows.at], level), level)
    cells, place = np.unique(lies_in, return_inverse=True)
    return cells[np.bincount(place, off) > MISSED_SHARE * np.bincount(place)]


def _ways(points: Array, origins: Array) -> Array:
    """Points (K, 3) on the straight ways of `points` (N, 3) to where they were."""
    way = origins - points
    longest = float(np.linalg.norm(way, axis=1).max(initial=0))
    steps = max(int(np.ceil(longest / (STEP_OF_WAY * spacing(FIT_COARSEST)))), 1)
    return np.concatenate(
        [points + np.float32(part) * way for part in np.linspace(0, 1, steps + 1)]
    )


def _changed(field: Field, signed: Signed, within: NDArray[np.floating]) -> Array:
    """The middles (K, 3) of all cells of the coarsest level that change sides, in the box around
    points `within` (B, 3)."""
    h = spacing(FIT_COARSEST)
    middles = np.arange(h / 2 - 1, 1, h, dtype=np.float32)
    low, high = within.min(axis=0) - h, within.max(axis=0) + h
    axes = [middles[(middles > a) & (middles < b)] for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    value = values(field, points)
    sides = np.asarray(signed(points, value, np.zeros(len(points), bool)))
    return points[(value < 0) != (sides < 0)]
