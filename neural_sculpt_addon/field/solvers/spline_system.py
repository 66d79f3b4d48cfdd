# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients of one level by sparse linear least squares (docs/method.md, section 3).

    min_c  sum over rows j of  w_j^2 (A_j c - r_j)^2  +  DAMPING sum over nodes i of  m_i c_i^2

A value row has the 27 splines that reach its point, a slope row their derivatives along a
direction. m is the diagonal of A^T W^2 A, nowhere less than a part of its mean: so coefficients
that few rows touch stay small. Conjugate gradients on the normal equations (Hestenes and Stiefel
1952), preconditioned by their diagonal. Pieces of rows that depend on their number alone are shared
by the pool's threads, so any number of cores gives the same bits. Model space.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from typing import NamedTuple, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from ...stroke.progress import Check, go_on
from ..detail import Grid, Level, around, quantised, slopes, weights
from ..threads import in_pool, pool

T = TypeVar("T")
U = TypeVar("U")

Array = NDArray[np.float32]

DAMPING = 0.03
"""Smaller is closer to the rows, larger is smoother where they are few."""

LEAST_TOUCHED = 0.1
"""Of the mean diagonal: what nodes that few rows touch are damped as if they had."""

ITERATIONS = 20

PIECE = 1 << 15
"""Rows that one thread takes at a time: each piece has its own sum over all nodes, to be added."""


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

    def add(self, points: Array, targets: Array, residuals: Array, weight: float) -> None:
        """Append value rows (N,) of one weight."""
        self.points = np.concatenate([self.points, points])
        self.targets = np.concatenate([self.targets, targets])
        self.residuals = np.concatenate([self.residuals, residuals])
        self.weights = np.concatenate([self.weights, np.full(len(points), weight, np.float32)])


class _Piece(NamedTuple):
    """Some of the rows: those of them that a node reaches.

    matrix:     (n, K), and transposed
    weights:    (n,), squared
    residuals:  (m,), a view of those of all rows of the piece
    some:       (n,), which of them
    """

    matrix: csr_array
    transposed: csc_array
    weights: Array
    residuals: Array
    some: NDArray[np.int64]


def solve_level(
    level: int,
    index: NDArray[np.int32],
    rows: Rows,
    check: Check = go_on,
    iterations: int = ITERATIONS,
    damped: float = LEAST_TOUCHED,
    left_out: float = 0.0,
) -> Level:
    """The best coefficients of the nodes `index` (K,) of a level.

    damped:   see LEAST_TOUCHED
    left_out: of the mean diagonal: nodes with less are left out
    What they add to the rows is taken from their residuals, which are changed in place.
    """
    numbers = Grid.empty(level, torch.int32).plus(
        index, np.arange(1, len(index) + 1, dtype=np.int32)
    )

    kinds = (
        (rows.points, None, rows.weights, rows.residuals),
        (rows.at, rows.along, rows.steep, rows.slopes),
    )

    def piece(part: tuple[int, slice]) -> _Piece:
        kind, chosen = part
        points, along, weight, residuals = kinds[kind]
        along = None if along is None else along[chosen]
        matrix, some = _matrix(numbers, points[chosen], along, len(index))
        return _Piece(matrix, matrix.T, weight[chosen][some] ** 2, residuals[chosen], some)

    parts = [(kind, part) for kind in (0, 1) for part in _parts(len(kinds[kind][0]))]
    pieces = list(_each(piece, parts, check))
    c = np.zeros(len(index), np.float32)
    if pieces:
        c = quantised(_solve(pieces, iterations, damped, left_out, check))

    def take_away(piece: _Piece) -> None:
        piece.residuals[piece.some] -= piece.matrix @ c

    list(_each(take_away, pieces, check))
    some = np.flatnonzero(c)
    return Level(index[some], c[some])


def _parts(count: int) -> list[slice]:
    """Slices of `count` rows."""
    parts = -(-count // PIECE)
    return [slice(i * count // parts, (i + 1) * count // parts) for i in range(parts)]


def _each(task: Callable[[T], U], parts: Iterable[T], check: Check) -> Iterator[U]:
    """What `task` makes of each of the parts, in order."""
    for result in map(task, parts) if in_pool() else pool().map(task, parts):
        check()
        yield result


def _matrix(
    numbers: Grid, points: Array, along: Array | None, count: int
) -> tuple[csr_array, NDArray[np.int64]]:
    """Rows of the splines at `points` (N, 3), or of their slopes in directions (N, 3), and which of
    the points they belong to."""
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
    ends = np.concatenate([[0], exists.sum(axis=1, dtype=np.int32).cumsum(dtype=np.int32)])
    matrix = value.view(27, -1).T.numpy()[exists], columns[exists] - 1, ends
    return csr_array(matrix, shape=(len(some), count)), some.numpy()


def _solve(
    pieces: list[_Piece], iterations: int, damped: float, left_out: float, check: Check
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
    residual = total(lambda piece: piece.transposed @ (piece.weights * piece.residuals[piece.some]))
    c = np.zeros_like(residual)
    z = scale * residual
    p, rz = z, _dot(residual, z)
    for _ in range(iterations):
        if rz < 1e-14:
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
