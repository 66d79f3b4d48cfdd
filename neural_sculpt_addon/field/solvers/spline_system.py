# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients of one level by sparse linear least squares (docs/method.md, section 3).

    min_c  sum over rows j of  w_j^2 (A_j c - r_j)^2  +  DAMPING sum over nodes i of  m_i c_i^2

A value row has the 27 splines that reach its point, a slope row their derivatives along a
direction. m is the diagonal of A^T W^2 A, nowhere less than a part of its mean: so coefficients
that few rows touch stay small. Conjugate gradients on the normal equations (Hestenes and Stiefel
1952), preconditioned by their diagonal. Model space.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ...stroke.progress import Check, go_on
from ..detail import Grid, Level, quantised, slopes, spacing, weights

Array = NDArray[np.float32]

DAMPING = 0.03
"""Smaller is closer to the rows, larger is smoother where they are few."""

LEAST_TOUCHED = 0.1
"""Of the mean diagonal: what nodes that few rows touch are damped as if they had."""

ITERATIONS = 30


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


def solve_level(level: int, index: NDArray[np.int32], rows: Rows, check: Check = go_on) -> Level:
    """The best coefficients of the nodes `index` (K,) of a level.

    What they add to the rows is taken from their residuals, which are changed in place.
    """
    numbers = Grid.empty(level, torch.int32).plus(
        index, np.arange(1, len(index) + 1, dtype=np.int32)
    )
    values = _matrix(numbers, rows.points, None, len(index))
    check()
    along = _matrix(numbers, rows.at, rows.along, len(index))
    check()
    matrix = values, along
    c = _solve(matrix, rows, check)
    coefficients = quantised(c)
    rows.residuals -= values @ coefficients
    rows.slopes -= along @ coefficients
    return Level(index, coefficients)


def _matrix(numbers: Grid, points: Array, along: Array | None, count: int) -> csr_array:
    """Rows (N, count) of the splines at `points` (N, 3), or of their slopes in directions (N, 3)."""
    some, base, offset = numbers.around(torch.from_numpy(points))
    node = numbers.take(base)  # (27, n), 0 where there is none
    wx, wy, wz = map(weights, offset)
    if along is None:
        value = (wx[:, None] * wy)[:, :, None] * wz  # (3, 3, 3, n)
    else:
        sx, sy, sz = map(slopes, offset)
        ex, ey, ez = torch.from_numpy(along)[some].T / spacing(numbers.level)
        xy = wx[:, None] * wy
        value = ((sx * ex)[:, None] * wy + wx[:, None] * (sy * ey))[:, :, None] * wz
        value += xy[:, :, None] * (sz * ez)
    value = value.view(27, -1).T
    node = node.T
    exists = node > 0
    ends = np.zeros(len(points) + 1, np.int32)
    ends[some.numpy() + 1] = exists.sum(1).numpy()
    np.cumsum(ends, out=ends)
    return csr_array(
        (value[exists].numpy(), node[exists].numpy() - 1, ends), shape=(len(points), count)
    )


def _solve(matrix: tuple[csr_array, csr_array], rows: Rows, check: Check) -> Array:
    values, along = matrix
    w, s = rows.weights**2, rows.steep**2

    def normal(c: Array) -> Array:
        return values.T @ (w * (values @ c)) + along.T @ (s * (along @ c))

    diagonal = values.power(2).T @ w + along.power(2).T @ s  # (K,)
    floor = np.maximum(diagonal, LEAST_TOUCHED * diagonal.mean())
    damping = DAMPING * floor
    scale = 1 / (floor + damping)
    residual = values.T @ (w * rows.residuals) + along.T @ (s * rows.slopes)
    c = np.zeros_like(residual)
    z = scale * residual
    p, rz = z, _dot(residual, z)
    for _ in range(ITERATIONS):
        check()
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
