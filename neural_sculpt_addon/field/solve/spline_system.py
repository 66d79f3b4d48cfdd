# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients of one level by sparse linear least squares (docs/method.md, section 3).

    min_c  sum over rows j of  w_j^2 (A_j c - r_j)^2  +  DAMPING sum over nodes i of  m_i c_i^2

A value row has the 27 splines that reach its point, a slope row their derivatives along a
direction. m is the diagonal of A^T W^2 A, nowhere less than a part of its mean: so coefficients
that few rows touch stay small. Conjugate gradients on the normal equations (Hestenes and Stiefel
1952), preconditioned by their diagonal. Pieces of rows that depend on their number alone are shared
by the pool's threads, so any number of cores gives the same bits. Model space.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from ...common.progress import Check, go_on
from ..detail import Grid, around, slopes, weights
from ..levels import Coefficients, Level, quantised
from ..threads import in_pool, pool

T = TypeVar("T")
U = TypeVar("U")

Array = NDArray[np.float32]

DAMPING = 0.03
"""Smaller is closer to the rows, larger is smoother where they are few."""

LEAST_TOUCHED = 0.1
"""Least diagonal that damping reckons with, as a share of the mean: for nodes that few rows
touch."""

ITERATIONS, CONVERGED = 20, 0.003
"""Iterations at most, and the share of the residual at which they end. A coarse level, of which
many rows determine few nodes, takes half of them. Three times the share makes edits a tenth less
close."""

PIECE = 1 << 13
"""Rows of a piece, about. Each has its own sum over all nodes, to be added, and is handed to a
thread in every iteration, so small ones cost more than they save."""


@dataclass
class Rows:
    """Equations for a detail: N value rows and M slope rows.

    points, targets, weights:    (N, 3), (N,), (N,): what f shall be, and the weights
    residuals:                   (N,): what is still to be added to f
    at:                          (M,): at which of the points the slope rows are
    along, slopes, steep:        (M, 3) unit, (M,), (M,): to grad f . along, and the weights
    """

    points: Array
    targets: Array
    residuals: Array
    weights: Array
    at: NDArray[np.intp]
    along: Array
    slopes: Array
    steep: Array

    def where(self, chosen: NDArray[np.bool_]) -> "Rows":
        """The chosen value rows (N,), and the slope rows at their points."""
        slopes, number = chosen[self.at], np.cumsum(chosen) - 1
        return Rows(
            self.points[chosen],
            self.targets[chosen],
            self.residuals[chosen],
            self.weights[chosen],
            number[self.at[slopes]],
            self.along[slopes],
            self.slopes[slopes],
            self.steep[slopes],
        )

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
    settled: float = CONVERGED,
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
    near = np.flatnonzero(numbers.has_brick(rows.points))
    place = np.full(values, -1)
    place[near] = np.arange(len(near))
    at = place[rows.at]
    steep = np.flatnonzero(at >= 0)
    parts = -(-(len(near) + len(steep)) // PIECE)

    def piece(number: int) -> _Piece:
        """Every point near a node whose number among these leaves this remainder by `parts`, so
        that all pieces have about as many slope rows."""
        sloped = steep[at[steep] % parts == number]
        points, along = rows.points[near[number::parts]], rows.along[sloped]
        matrix, value, slope = _matrix(numbers, points, at[sloped] // parts, along, len(index))
        some = np.append(near[number + parts * value], values + sloped[slope])
        return _Piece(matrix, matrix.T, weight[some], some)

    pieces = list(_each(piece, range(parts), check))
    c = np.zeros(len(index), np.float32)
    if pieces:
        c = quantised(_solve(pieces, residuals, iterations, settled, damped, left_out, check))

    def take_away(piece: _Piece) -> None:
        residuals[piece.some] -= piece.matrix @ c

    list(_each(take_away, pieces, check))
    rows.residuals[:], rows.slopes[:] = residuals[:values], residuals[values:]
    some = np.flatnonzero(c)
    return Level(index[some], c[some])


def solve_levels(
    nodes: Mapping[int, NDArray[np.int32]], rows: Rows, check: Check = go_on
) -> Coefficients:
    """The best coefficients of the nodes (K,) of some levels, each for what is left of the rows by
    those before it. Otherwise as of `solve_level`."""
    return {level: solve_level(level, index, rows, check) for level, index in nodes.items()}


def _each(task: Callable[[T], U], parts: Sequence[T], check: Check) -> Iterator[U]:
    """What `task` makes of each of the parts, in order."""
    for result in map(task, parts) if len(parts) < 2 or in_pool() else pool().map(task, parts):
        check()
        yield result


def _matrix(
    numbers: Grid, points: Array, at: NDArray[np.intp], along: Array, nodes: int
) -> tuple[csr_array, NDArray[np.intp], NDArray[np.intp]]:
    """Rows (n, K) of the matrix: the splines at `points` (N, 3), and below them their slopes, in
    directions `along` (M, 3) `at` some of the points (M,). With it, which points and which slopes
    have a row: those that a node reaches.

    A slope has the columns of its point.
    """
    point, scale, offset, near = around([numbers], torch.from_numpy(points))
    place = np.full(len(points), -1)
    place[point.numpy()] = np.arange(len(point))
    slope = np.flatnonzero(place[at] >= 0)
    twice = place[at[slope]]
    wx, wy, wz = weights(offset).unbind(1)  # (3, n) each
    value = (wx[:, None] * wy)[:, :, None] * wz  # (3, 3, 3, n)
    offset = offset[:, torch.from_numpy(twice)]
    wx, wy, wz = weights(offset).unbind(1)
    sx, sy, sz = slopes(offset).unbind(1)
    ex, ey, ez = torch.from_numpy(along[slope]).T * scale[:1]
    steep = ((sx * ex)[:, None] * wy + wx[:, None] * (sy * ey))[:, :, None] * wz
    steep += (wx[:, None] * wy)[:, :, None] * (sz * ez)

    columns = near.T.contiguous().numpy()  # (n, 27), rising; 0 where there is no node
    columns = np.concatenate([columns, columns.take(twice, axis=0)]) - 1
    entries = torch.cat([value.view(27, -1).T, steep.view(27, -1).T]).numpy()
    exists = columns >= 0
    ends = np.zeros(len(columns) + 1, np.int32)
    np.cumsum(exists.sum(axis=1, dtype=np.int32), out=ends[1:])
    some = np.flatnonzero(exists)
    parts = entries.ravel().take(some), columns.ravel().take(some), ends
    return csr_array(parts, shape=(len(columns), nodes)), point.numpy(), slope


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
