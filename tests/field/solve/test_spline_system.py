# SPDX-License-Identifier: GPL-3.0-or-later
"""The sparse system of a level against a dense solution of the same equations by NumPy."""

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import Cancelled
from neural_sculpt_addon.field.levels import MARGIN, UNIT, Level, centres, linear, places, quantised
from neural_sculpt_addon.field.solve.spline_system import (
    DAMPING,
    LEAST_TOUCHED,
    PIECE,
    Rows,
    solve_level,
)
from tests.field.splines import basis

CONVERGED = {"iterations": 300, "settled": 0.0}


def block(level, first, size):
    """The numbers of a block of nodes of `size` on each axis from the box's cell `first`."""
    cells = np.indices((size,) * 3).reshape(3, -1).T + np.array(first) + MARGIN
    return np.sort(linear(cells.astype(np.int32), level))


def rows_about(level, index, count, steep=0.05, seed=0):
    """Random rows within and beside the supports of the nodes `index`, of any weights."""
    random = np.random.default_rng(seed)
    middles = centres(places(index, level), level)

    def points(number):
        away = 2.0**-level * random.uniform(-2, 2, (number, 3))
        return (random.choice(middles, number) + away).astype(np.float32)

    along = random.normal(size=(count, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    numbers = random.normal(0, 0.1, (3, count)).astype(np.float32)
    weights = random.uniform(0.3, 2, (2, count)).astype(np.float32)
    return Rows(
        points(count),
        numbers[0],
        numbers[1],
        weights[0],
        random.permutation(count),
        along.astype(np.float32),
        numbers[2],
        np.float32(steep) * weights[1],
    )


def dense(level, index, rows):
    """The matrix (N + M, K), the weights and the right side (N + M,)."""
    value, _ = basis(rows.points, index, level)
    _, gradient = basis(rows.points[rows.at], index, level)
    slope = np.einsum("nka,na->nk", gradient, rows.along)
    right = np.concatenate([rows.residuals, rows.slopes]).astype(float)
    return np.concatenate([value, slope]), np.append(rows.weights, rows.steep), right


def everywhere(found, index):
    """The coefficients (K,) of all nodes `index` (K,): those that are zero are left out."""
    assert (np.diff(found.index) > 0).all() and np.isin(found.index, index).all()
    values = np.zeros(len(index), np.float32)
    values[np.searchsorted(index, found.index)] = found.values
    return values


def best(matrix, weights, right):
    """The damped solution; nodes that few rows touch are damped by a share of the mean."""
    weighed = weights[:, None] * matrix
    diagonal = (weighed**2).sum(axis=0)
    damping = DAMPING * np.maximum(diagonal, LEAST_TOUCHED * diagonal.mean())
    stacked = np.concatenate([weighed, np.diag(np.sqrt(damping))])
    return np.linalg.lstsq(stacked, np.append(weights * right, 0 * damping), rcond=None)[0]


@pytest.mark.parametrize(
    ("level", "first", "steep"),
    [
        (3, (6, 6, 6), 0.0),
        (6, (61, 30, 64), 0.01),  # across the borders of bricks
        (5, (-7, 0, 66), 0.03),  # outside of the box, up to the edge of the grid
    ],
)
def test_the_solution_is_that_of_the_dense_system(level, first, steep):
    index = block(level, first, 5)
    rows = rows_about(level, index, 400, steep, seed=level)
    matrix, weights, right = dense(level, index, rows)
    expected = best(matrix, weights, right)
    found = everywhere(solve_level(level, index, rows, **CONVERGED), index)
    np.testing.assert_array_equal(found, quantised(found))
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert np.abs(expected).max() > 0.01
    left = right - matrix @ found
    np.testing.assert_allclose(
        np.append(rows.residuals, rows.slopes), left, atol=1e-6 + 1e-5 * np.abs(matrix).max()
    )


def test_a_node_that_no_row_touches_is_zero_and_one_that_few_touch_is_damped():
    index, lonely = block(6, (64, 64, 64), 3), block(6, (90, 90, 90), 3)
    rows = rows_about(6, index, 500, 0.0)
    rows.points[0] = centres(places(lonely[13:14], 6), 6)[0] + np.float32(0.99 / 64)
    rows.residuals[0], rows.weights[0] = 0.1, 0.05
    both = np.sort(np.append(index, lonely))
    expected = best(*dense(6, both, rows))
    found = everywhere(solve_level(6, both, rows, **CONVERGED), both)
    touched = basis(rows.points[:1], both, 6)[0][0] > 0
    assert touched.sum() == 8
    assert not found[np.isin(both, lonely) & ~touched].any()
    np.testing.assert_allclose(found[touched], expected[touched], atol=1e-6 + UNIT)
    assert 1e-3 < 0.1 - rows.residuals[0] < 0.09  # as much as one row is to be believed


def test_a_detail_on_the_same_nodes_is_found_again():
    """Many rows of what splines can tell, hardly damped by comparison."""
    index = block(6, (60, 60, 60), 6)
    random = np.random.default_rng(1)
    truth = Level(index, quantised(random.normal(0, 0.01, len(index))))
    rows = rows_about(6, index, 4000, 1 / 64)
    matrix, _, _ = dense(6, index, rows)
    target = (matrix @ truth.values).astype(np.float32)
    rows.residuals, rows.slopes = target[:4000].copy(), target[4000:].copy()
    before = np.sqrt((target**2).mean())
    for _ in range(4):  # what damping left is solved for again
        solve_level(6, index, rows)
    after = np.sqrt((np.append(rows.residuals, rows.slopes) ** 2).mean())
    assert after < 0.01 * before


def test_rows_in_pieces_have_one_solution():
    """As many rows as several threads share, against the dense normal equations of each."""
    index = block(5, (30, 30, 30), 3)
    count = 2 * PIECE + 7
    rows = rows_about(5, index, count, 0.0)
    normal, right = np.zeros((27, 27)), np.zeros(27)
    for part in np.array_split(np.arange(count), 10):
        splines, _ = basis(rows.points[part], index, 5)
        square = rows.weights[part].astype(float) ** 2
        normal += splines.T @ (square[:, None] * splines)
        right += splines.T @ (square * rows.residuals[part])
    diagonal = np.diag(normal)
    damped = normal + np.diag(DAMPING * np.maximum(diagonal, LEAST_TOUCHED * diagonal.mean()))
    found = everywhere(solve_level(5, index, rows, **CONVERGED), index)
    np.testing.assert_allclose(found, np.linalg.solve(damped, right), atol=1e-6 + UNIT)


def test_rows_that_no_node_reaches_stay_as_they_are():
    index = block(6, (64, 64, 64), 3)
    rows = rows_about(6, index, 300)
    reached = basis(rows.points, index, 6)[0].any(axis=1)
    before = rows.residuals.copy()
    solve_level(6, index, rows)
    assert 0 < reached.sum() < 300
    np.testing.assert_array_equal(rows.residuals[~reached], before[~reached])
    assert (rows.residuals[reached] != before[reached]).mean() > 0.9


def test_a_cancel_ends_the_solution():
    index = block(6, (64, 64, 64), 3)
    calls = []

    def check(last=None):
        calls.append(None)
        if len(calls) == last:
            raise Cancelled

    solve_level(6, index, rows_about(6, index, 300), check)
    for last in (1, len(calls) // 2, len(calls)):
        calls.clear()
        with pytest.raises(Cancelled):
            solve_level(6, index, rows_about(6, index, 300), lambda last=last: check(last))
        assert len(calls) == last
