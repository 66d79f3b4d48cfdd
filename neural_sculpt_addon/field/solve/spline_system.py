# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients of one level by sparse linear least squares (docs/method.md, section 3).

    min_c  sum over rows j of  w_j^2 (A_j c - r_j)^2  +  DAMPING sum over nodes i of  m_i c_i^2

A value row has the 27 splines that reach its point, a slope row their derivatives along a
direction. m is the diagonal of A^T W^2 A, nowhere less than a part of its mean: so coefficients
that few rows touch stay small. Conjugate gradients on the normal equations (Hestenes and Stiefel
1952), preconditioned by their diagonal. Pieces of rows that depend on their number alone are shared
by the pool's threads, so any number of cores gives the same bits. Model space.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from ...common.progress import Check, go_on
from ..detail import Grid, Level, around, quantised, slopes, weights
from ..threads import in_pool, pool

T = TypeVar("T")
U = TypeVar("U")

Array = NDArray[np.float32]

DAMPING = 0.03
"""Smaller is closer to the rows, larger is smoother where they are few."""

LEAST_TOUCHED = 0.1
"""Of the mean diagonal: what nodes that few rows touch are damped as if they had."""

ITERATIONS, SETTLED = 20, 0.003
"""At most, and the share of the residual that may be left: a coarse level, whose few nodes many
rows determine, takes half of them. Three times as much makes edits a tenth less close."""

PIECES, PIECE = 2, 1 << 15
"""Pieces of all rows at least, and rows of one at most. Each has its own sum over all nodes, to be
added, and so small ones cost more than they save."""


@dataclass
class Rows:
    """Equations for a detail: N value rows and M slope rows.

    points, targets, weights:    (N, 3), (N,), (N,): what f shall be, and the weights
    residuals:                   (N,): what is still to be added to f
    at, along, slopes, steep:    (M, 3), (M, 3) unit, (M,), (M,): to grad f . along, and the weights
    """

    points: Array
    targets: Array
    residuals: Array
    weights: Array
    at: Array
    along: Array
    slopes: Array
    steep: Array

    def extend(self, more: "Rows") -> None:
        """Append equations."""
        for part in fields(self):
            both = getattr(self, part.name), getattr(more, part.name)
            setattr(self, part.name, np.concatenate(both))

    def where(self, values: NDArray[np.bool_], slopes: NDArray[np.bool_]) -> "Rows":
        """Some of the value rows (N,) and of the slope rows (M,)."""
        chosen = [values] * 4 + [slopes] * 4
        parts = zip(fields(self), chosen, strict=True)
        return Rows(*(getattr(self, part.name)[some] for part, some in parts))

    def add(self, points: Array, targets: Array, residuals: Array, weight: float) -> None:
        """Append value rows (N,) of one weight."""
        self.points = np.concatenate([self.points, points])
        self.targets = np.concatenate([self.targets, targets])
        self.residuals = np.concatenate([self.residuals, residuals])
        self.weights = np.concatenate([self.weights, np.full(len(points), weight, np.float32)])


class _Piece(NamedTuple):
    """Some of the rows: those of them that a node may reach.

    matrix:     (n, K), and transposed
    weights:    (n,), squared
    some:       (n,), which of all N + M rows
    """

    matrix: csr_array
    transposed: csc_array
    weights: Array
    some: NDArray[np.intp]


def solve_level(
    level: int,
    index: NDArray[np.int32],
    rows: Rows,
    check: Check = go_on,
    iterations: int = ITERATIONS,
    damped: float = LEAST_TOUCHED,
    left_out: float = 0.0,
    settled: float = SETTLED,
) -> Level:
    """The best coefficients of the nodes `index` (K,) of a level.

    iterations, settled: see ITERATIONS
    damped:              see LEAST_TOUCHED
    left_out:            of the mean diagonal: nodes with less are left out
    What they add to the rows is taken from their residuals, which are changed in place.
    """
    numbers = Grid.empty(level, torch.int32).plus(
        index, np.arange(1, len(index) + 1, dtype=np.int32)
    )

    values = len(rows.points)
    weight = np.square(np.append(rows.weights, rows.steep))
    residuals = np.append(rows.residuals, rows.slopes)
    parts = max(PIECES, -(-len(residuals) // PIECE))

    def piece(number: int) -> _Piece:
        """As large a share of either kind of rows as of the other."""
        mine, theirs = (
            slice(number * count // parts, (number + 1) * count // parts)
            for count in (values, len(rows.at))
        )
        value = _entries(numbers, rows.points[mine], None)
        slope = _entries(numbers, rows.at[theirs], rows.along[theirs])
        data = np.append(value.values, slope.values)
        columns = np.append(value.columns, slope.columns)
        counts = np.append(value.counts, slope.counts)
        some = np.append(mine.start + value.some, values + theirs.start + slope.some)
        ends = np.concatenate([[0], counts.cumsum(dtype=np.int32)])
        matrix = csr_array((data, columns, ends), shape=(len(some), len(index)))
        return _Piece(matrix, matrix.T, weight[some], some)

    pieces = list(_each(piece, range(parts), check))
    c = np.zeros(len(index), np.float32)
    if len(index) and len(residuals):
        c = quantised(_solve(pieces, residuals, iterations, settled, damped, left_out, check))

    def take_away(piece: _Piece) -> None:
        residuals[piece.some] -= piece.matrix @ c

    list(_each(take_away, pieces, check))
    rows.residuals[:], rows.slopes[:] = residuals[:values], residuals[values:]
    some = np.flatnonzero(c)
    return Level(index[some], c[some])


def _each(task: Callable[[T], U], parts: Sequence[T], check: Check) -> Iterator[U]:
    """What `task` makes of each of the parts, in order."""
    for result in map(task, parts) if in_pool() else pool().map(task, parts):
        check()
        yield result


class _Entries(NamedTuple):
    """The entries (E,) of rows (n,) of the matrix, their columns, how many each row has, and which
    of the points they belong to."""

    values: Array
    columns: NDArray[np.int32]
    counts: NDArray[np.int32]
    some: NDArray[np.int64]


def _entries(numbers: Grid, points: Array, along: Array | None) -> _Entries:
    """Those of the splines at `points` (N, 3), or of their slopes in directions (N, 3)."""
    some, scale, offset, nodes = around([numbers], torch.from_numpy(points))
    wx, wy, wz = weights(offset).unbind(1)  # (3, n) each
    if along is None:
        value = (wx[:, None] * wy)[:, :, None] * wz  # (3, 3, 3, n)
    else:
        sx, sy, sz = slopes(offset).unbind(1)
        ex, ey, ez = torch.from_numpy(along)[some].T * scale
        xy = wx[:, None] * wy
        value = ((sx * ex)[:, None] * wy + wx[:, None] * (sy * ey))[:, :, None] * wz
        value += xy[:, :, None] * (sz * ez)
    columns = nodes.T.numpy()  # (n, 27), rising; 0 where there is no node
    exists = columns > 0
    entries = value.view(27, -1).T.numpy()[exists], columns[exists] - 1
    return _Entries(*entries, exists.sum(axis=1, dtype=np.int32), some.numpy())


def _solve(
    pieces: list[_Piece],
    residuals: Array,
    iterations: int,
    settled: float,
    damped: float,
    left_out: float,
    check: Check,
) -> Array:
    def total(task: Callable[[_Piece], Array]) -> Array:
        sums = _each(task, pieces, check)
        result = next(sums)
        for one in sums:
            result += one
        return result

    def normal(c: Array) -> Array:
        return total(lambda piece: piece.transposed @ (piece.weights * (piece.matrix @ c)))

    diagonal = total(lambda piece: piece.transposed.power(2) @ piece.weights)  # (K,)
    mean = diagonal.mean()
    floor = np.maximum(diagonal, damped * mean)
    damping = DAMPING * floor
    scale = np.where(diagonal < left_out * mean, 0, 1 / (floor + damping))
    residual = total(lambda piece: piece.transposed @ (piece.weights * residuals[piece.some]))
    c = np.zeros_like(residual)
    z = scale * residual
    p, rz = z, _dot(residual, z)
    enough = max(settled**2 * rz, 1e-14)
    for _ in range(iterations):
        if rz < enough:
            break
        q = normal(p) + damping * p
        step = rz / _dot(p, q)
        c += step * p
        residual -= step * q
        z = scale * residual
        last, rz = rz, _dot(residual, z)
        p = z + np.float32(rz / last) * p
    return c


def _dot(a: Array, b: Array) -> np.float32:
    """Without BLAS, whose sum depends on the number of threads."""
    return np.einsum("i,i->", a, b)
