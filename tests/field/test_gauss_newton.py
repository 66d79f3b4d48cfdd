# SPDX-License-Identifier: GPL-3.0-or-later
"""The Gauss-Newton solver, held against autograd and dense linear algebra, and at work."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field import metrics
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.prepare import prepare
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem import pose
from neural_sculpt_addon.field.projection import find_surface, project
from neural_sculpt_addon.field.proxy import extract, finish
from neural_sculpt_addon.field.solvers import gauss_newton, least_squares, precision
from neural_sculpt_addon.field.solvers.layers import Directions, Layers
from neural_sculpt_addon.field.solvers.least_squares import (
    FLOOR,
    RIDGE,
    Linear,
    common_directions,
    scale_of,
)
from neural_sculpt_addon.field.solvers.rows import Rows
from neural_sculpt_addon.field.threads import Team
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.errors import Cancelled
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke

WIDTHS = st.lists(st.integers(2, 7), min_size=1, max_size=3)


def small(widths: list[int], seed: int) -> Siren:
    generator = torch.Generator().manual_seed(seed)
    network = Siren.random(widths, 3.0, generator)
    return network.with_parameters([p.double() for p in network.parameters])


def rows_of(values: int, slopes: int, seed: int) -> Rows:
    generator = torch.Generator().manual_seed(seed)

    def draw(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    count = values + slopes
    directions = draw(slopes, 3)
    weights = 0.1 + draw(count).abs()
    outlying = torch.full_like(weights, torch.inf)
    return Rows(draw(count, 3), directions, draw(count), weights, outlying, near=values // 2)


def residual_by_autograd(network: Siren, rows: Rows, inner: torch.Tensor, output: torch.Tensor):
    """Weighted residual of value and derivative rows as a function of the unknowns."""
    below = list(network.parameters[:-4])
    whole = network.with_parameters(
        [*below, inner[:, :-1], inner[:, -1], output[None, :-1], output[-1:]]
    )
    points = rows.points.clone().requires_grad_()
    f = whole.value(points)
    (gradient,) = torch.autograd.grad(f.sum(), points, create_graph=True)
    n = rows.values
    along = (gradient[n:] * rows.directions).sum(1)
    return rows.weights * (rows.targets - torch.cat([f[:n], along]))


def dense(linear: Linear) -> tuple[torch.Tensor, torch.Tensor]:
    """J as a matrix, by applying it to unit vectors, and r."""
    size = linear.inner + linear.output.shape[1]
    columns = [linear.apply(unit) for unit in torch.eye(size, dtype=linear.left.dtype)]
    return torch.stack(columns, 1), linear.residual


def linearised(
    network: Siren, rows: Rows, rank: float = 2, split: bool = False
) -> tuple[Layers, Linear]:
    layers = Layers.of(network, Directions.of(network, rows, rank, 32, split))
    return layers, layers.linearise(rows, layers.view(rows))


def linear_of(widths: list[int], values: int, slopes: int, seed: int) -> Linear:
    return linearised(small(widths, seed), rows_of(values, slopes, seed))[1]


def change_of(linear: Linear, seed: int) -> torch.Tensor:
    size = linear.inner + linear.output.shape[1]
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(size, generator=generator, dtype=torch.float64)


def normal_equations(linear: Linear, damping: float) -> torch.Tensor:
    """The matrix that the solution y of the damped problem multiplies."""
    matrix = dense(linear)[0] * scale_of(linear)
    return matrix.T @ matrix + damping * torch.eye(len(matrix.T), dtype=torch.float64)


def exact_solution(linear: Linear, damping: float) -> torch.Tensor:
    matrix, residual = dense(linear)
    scale = scale_of(linear)
    right = scale * (matrix.T @ residual)
    return scale * torch.linalg.solve(normal_equations(linear, damping), right)


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 6), st.integers(6, 12), st.integers(6, 12), st.integers(0, 10**6))
def test_two_sets_of_rows_are_uncorrelated_along_their_common_directions(size, first, second, seed):
    generator = torch.Generator().manual_seed(seed)
    turn = torch.randn(2, size, size, generator=generator, dtype=torch.float64)
    one, other = (
        torch.randn(count, size, generator=generator, dtype=torch.float64) @ mixed
        for count, mixed in zip((first, second), turn, strict=True)
    )
    found = common_directions(one.T @ one, other.T @ other)
    torch.testing.assert_close(found.norm(dim=0), torch.ones(size, dtype=torch.float64))
    assert torch.linalg.matrix_rank(found) == size
    raised = other.T @ other
    raised += FLOOR * raised.trace() / size * torch.eye(size, dtype=torch.float64)
    for moment in (one.T @ one, raised):
        seen = found.T @ moment @ found
        torch.testing.assert_close(
            seen, torch.diag(seen.diagonal()), rtol=0, atol=1e-8 * float(moment.trace())
        )


@settings(max_examples=25, deadline=None)
@given(WIDTHS, st.integers(1, 6), st.integers(0, 6), st.integers(0, 10**6), st.booleans())
def test_the_jacobian_is_that_of_autograd(widths, values, slopes, seed, split):
    network, rows = small(widths, seed), rows_of(values, slopes, seed)
    layers, linear = linearised(network, rows, 0.1 + seed % 7 / 5, split)
    inner = torch.cat([network.weights[-2], network.biases[-2][:, None]], 1)
    output = torch.cat([network.weights[-1][0], network.biases[-1]])

    def residual(*unknowns: torch.Tensor) -> torch.Tensor:
        return residual_by_autograd(network, rows, *unknowns)

    torch.testing.assert_close(linear.residual, residual(inner, output).detach())
    # J belongs to some directions of features: a change there is one of the network by `moved`
    change = change_of(linear, seed)
    moved = layers.moved(change).network()
    step = (
        torch.cat([moved.weights[-2], moved.biases[-2][:, None]], 1) - inner,
        torch.cat([moved.weights[-1][0], moved.biases[-1]]) - output,
    )
    slope = torch.autograd.functional.jvp(residual, (inner, output), step)[1]
    assert isinstance(slope, torch.Tensor)
    torch.testing.assert_close(linear.apply(change), -slope, rtol=1e-8, atol=1e-8)


@settings(max_examples=25, deadline=None)
@given(WIDTHS, st.integers(1, 6), st.integers(0, 6), st.integers(0, 10**6))
def test_the_residual_after_a_change_is_that_of_autograd(widths, values, slopes, seed):
    network, rows = small(widths, seed), rows_of(values, slopes, seed)
    layers, linear = linearised(network, rows, 0.1 + seed % 7 / 5)
    change = change_of(linear, seed)
    moved = layers.moved(change)
    after = moved.network()
    inner = torch.cat([after.weights[-2], after.biases[-2][:, None]], 1)
    output = torch.cat([after.weights[-1][0], after.biases[-1]])
    exact = residual_by_autograd(network, rows, inner, output).detach()
    view = layers.view_after(change, layers.view(rows))
    torch.testing.assert_close(moved.residual(rows, view), exact)
    torch.testing.assert_close(moved.residual(rows, moved.view(rows)), exact)


def test_features_change_where_they_differ_most():
    network, rows = small([7, 3], 2), rows_of(40, 30, 2)
    weights = rows.weights[:, None]
    found = []
    for rank in (2, 3 / 7):
        view = linearised(network, rows, rank)[0].view(rows)
        seen = (torch.cat([weights, weights[40:]]) * view.features).numpy()
        found.append(np.linalg.svd(seen, compute_uv=False))
    np.testing.assert_allclose(found[1], found[0][:3])


def test_directions_make_what_rows_see_independent():
    linear = linear_of([7, 3], 40, 30, 2)
    for seen in (linear.left, linear.output):
        products = seen.T @ seen
        torch.testing.assert_close(products, torch.diag(products.diagonal()))


@settings(max_examples=25, deadline=None)
@given(WIDTHS, st.integers(1, 6), st.integers(0, 6), st.integers(0, 10**6))
def test_products_agree_with_the_matrix(widths, values, slopes, seed):
    linear = linearised(small(widths, seed), rows_of(values, slopes, seed))[1]
    matrix, residual = dense(linear)
    torch.testing.assert_close(linear.transposed(residual), matrix.T @ residual)
    torch.testing.assert_close(linear.gram(matrix[0]), matrix.T @ (matrix @ matrix[0]))
    torch.testing.assert_close(linear.diagonal(), (matrix**2).sum(0))


def test_rows_that_are_far_off_pull_as_a_pseudo_huber_loss_does():
    """s^2 ((1 + (r / s)^2)^1/2 - 1), and r^2 / 2 where no residual is large, by autograd."""
    network, rows = small([8, 8], 5), rows_of(30, 10, 5)
    s = torch.linspace(0.1, 2.0, len(rows.points), dtype=torch.float64)
    s[::4] = torch.inf
    rows = rows._replace(outlying=s)
    layers = Layers.of(network, Directions.of(network, rows, 2, 32, split=False))
    view = layers.view(rows)
    linear = layers.linearise(rows.tempered(layers.residual(rows, view)), view)
    change = change_of(linear, 6)

    def unknowns(some: Layers) -> tuple[torch.Tensor, torch.Tensor]:
        *_, weight, bias, last, constant = some.network().parameters
        return torch.cat([weight, bias[:, None]], 1), torch.cat([last[0], constant])

    before = [part.clone().requires_grad_() for part in unknowns(layers)]
    ways = [b - a for a, b in zip(before, unknowns(layers.moved(change)), strict=True)]
    r = residual_by_autograd(network, rows, *before)
    huber = s.clamp_max(9) ** 2 * (torch.sqrt(1 + (r / s.clamp_max(9)) ** 2) - 1)
    slopes = torch.autograd.grad(torch.where(s.isinf(), r**2 / 2, huber).sum(), before)
    expected = sum((a * b).sum() for a, b in zip(slopes, ways, strict=True))
    torch.testing.assert_close(-linear.transposed(linear.residual) @ change, expected)


def test_products_of_few_bits_are_near_those_of_many(monkeypatch):
    """A bfloat16 has 8 bits: each factor is off by at most 1/256, and 1/512 in the mean."""
    monkeypatch.setattr(precision, "_multiplies_bfloat16", lambda: True)
    exact, rows = small([16, 16], 3), rows_of(200, 100, 3)
    network = exact.with_parameters([p.float() for p in exact.parameters])
    changing = Rows(*(part.float() for part in rows[:5]), near=rows.near)
    directions = Directions.of(exact, rows, 0.75, 32, split=True)
    layers = Layers.of(network, Directions(*(part.float() for part in directions)))
    linear = layers.linearise(changing, layers.view(changing))
    true = Layers.of(exact, directions)
    true = true.linearise(rows, true.view(rows))
    assert linear.left.dtype == linear.right.dtype == torch.bfloat16
    change = change_of(true, 4)
    for found, expected in (
        (linear.residual, true.residual),
        (linear.apply(change.float()), true.apply(change)),
        (linear.gram(change.float()), true.gram(change)),
        (linear.diagonal(), true.diagonal()),
    ):
        assert found.dtype == torch.float32
        assert (found - expected).norm() < 0.02 * expected.norm()
    torch.testing.assert_close(linear.residual, true.residual.float(), rtol=1e-4, atol=1e-5)


def test_the_scale_normalises_the_diagonal_of_the_system():
    linear = linear_of([4, 3], 9, 7, 5)
    matrix = dense(linear)[0].numpy()
    diagonal = (matrix**2).sum(0)
    blocks = diagonal[: linear.inner], diagonal[linear.inner :]
    expected = np.concatenate([d / (d + RIDGE * d.mean()) for d in blocks])
    found = ((matrix * scale_of(linear).numpy()) ** 2).sum(0)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("damping", [0.1, 1.0, 10.0])
def test_the_solution_is_that_of_the_normal_equations(damping):
    linear = linear_of([4, 3], 9, 7, 5)
    exact = exact_solution(linear, damping)
    x, promised, _ = solve(linear, damping, 60)
    torch.testing.assert_close(x, exact, rtol=1e-5, atol=1e-8)
    matrix, residual = dense(linear)
    decrease = residual @ residual - (matrix @ exact - residual).square().sum()
    assert promised == pytest.approx(float(decrease), rel=1e-6)


def test_what_one_solution_promises_before_it_is_exact():
    linear = linear_of([5, 4], 30, 7, 6)
    matrix, residual = dense(linear)
    x, promised, _ = solve(linear, 0.1, 3)
    decrease = residual @ residual - (matrix @ x - residual).square().sum()
    assert promised == pytest.approx(float(decrease), rel=1e-6)


def test_the_memory_of_a_system_inverts_it_in_its_span():
    linear, damping = linear_of([5, 4], 30, 7, 6), 0.1
    memory = solve(linear, damping, 8).memory.scaled(scale_of(linear))
    products = memory.directions @ normal_equations(linear, damping)
    torch.testing.assert_close(memory.products, products)
    for s, y in zip(*memory, strict=True):
        torch.testing.assert_close(memory.precondition(y), s, rtol=1e-6, atol=1e-8)


def test_memory_makes_the_next_solution_of_a_like_system_better():
    damping, seed = 0.01, 6
    first, second = (linear_of([8, 8], 60, 20, seed) for _ in range(2))
    exact = exact_solution(second, damping)
    memory = solve(first, damping, 12).memory
    errors = [(solve(second, damping, 12, known).x - exact).norm() for known in (None, memory)]
    assert errors[1] < 0.5 * errors[0]


def solve(linear, damping, iterations, memory=None):
    return least_squares.solve(linear, damping, iterations, memory, lambda _: None)


@pytest.fixture(scope="module")
def preparation():
    return prepare(primitive("sphere"))


def equator(brush: Brush) -> Stroke:
    """Along the equator of the sphere of radius 0.6."""
    angle = np.linspace(0, 0.6, 5)
    return Stroke(0.6 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1), brush, seed=3)


@pytest.fixture(scope="module")
def problem(preparation):
    return pose(preparation, equator(Brush(0.12, 0.05)))


@pytest.mark.parametrize("intensity", [0.05, -0.05])
def test_the_tolerance_is_met_by_growing_if_need_be(preparation, intensity):
    problem = pose(preparation, equator(Brush(0.1, intensity)))
    edited, surface = gauss_newton.refine(problem, gauss_newton.quick(problem))
    report = metrics.measure(problem, edited, finish(surface, edited))
    assert report["tube_p95"] < gauss_newton.TOLERANCE
    assert report["drift_mean"] < 5e-4
    assert report["gradient"] < 0.06
    assert report["components_after"] == 1
    assert edited.widths[0] in (128, 192, 256, 512)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_hair_thin_stroke_is_reached_by_whatever_chance(preparation, seed):
    """A network that has just grown is far off everywhere, and has to be pulled as hard there."""
    problem = pose(preparation, replace(equator(Brush(0.02, 0.02)), seed=seed))
    edited, surface = gauss_newton.refine(problem, gauss_newton.quick(problem))
    report = metrics.measure(problem, edited, finish(surface, edited))
    assert report["tube_p95"] < gauss_newton.TOLERANCE
    assert report["components_after"] == 1


def test_ridges_too_fine_for_any_network_tear_nothing_off(preparation):
    """Seven of them 0.02 apart: refining leaves crumbs, so an earlier stage is the result."""
    peaks = Profile(points=tuple((-1 + k / 7, k % 2) for k in range(15)))
    problem = pose(preparation, equator(Brush(0.08, 0.06, peaks)))
    edited, surface = gauss_newton.refine(problem, gauss_newton.quick(problem))
    report = metrics.measure(problem, edited, finish(surface, edited))
    assert report["tube_p95"] > gauss_newton.TOLERANCE  # as is told
    assert report["components_after"] == 1


@pytest.mark.parametrize("coarse", [False, True])
def test_quick_comes_close(problem, coarse, monkeypatch):
    monkeypatch.setattr(precision, "_multiplies_bfloat16", lambda: coarse)
    edited = gauss_newton.quick(problem)
    error = metrics.measure(problem, edited, extract(edited))
    assert error["tube_mean"] < 0.1 * 0.05  # a tenth of the height
    assert error["drift_mean"] < 1e-3


def test_the_same_seed_gives_the_same_weights(problem):
    first, second = (gauss_newton.quick(problem).parameters for _ in range(2))
    assert all(torch.equal(a, b) for a, b in zip(first, second, strict=True))


def test_a_team_that_grows_smaller_changes_no_bit(problem, monkeypatch):
    edited = gauss_newton.quick(problem).parameters
    sizes = itertools.cycle([1, torch.get_num_threads() + 1])
    monkeypatch.setattr(Team, "adapt", lambda _: torch.set_num_threads(next(sizes)))
    again = gauss_newton.quick(problem).parameters
    assert all(torch.equal(a, b) for a, b in zip(edited, again, strict=True))


def test_what_lies_below_the_last_hidden_layer_is_kept(problem):
    edited = gauss_newton.quick(problem)
    assert torch.equal(edited.weights[0], problem.network.weights[0])
    assert torch.equal(edited.biases[0], problem.network.biases[0])
    assert not torch.equal(edited.weights[1], problem.network.weights[1])


@pytest.mark.parametrize("last", [0, 3, 40])
def test_it_can_be_cancelled_anywhere(problem, last):
    """While samples are drawn, in a step, and in a later one."""
    calls = []

    def stop(fraction: float, _: str) -> None:
        calls.append(fraction)
        if len(calls) > last:
            raise Cancelled

    with pytest.raises(Cancelled):
        gauss_newton.quick(problem, stop)
    assert len(calls) == last + 1
    assert calls == sorted(calls)


def test_a_cancel_is_heard_between_all_pieces_of_the_work(problem):
    """Samples are drawn in four pieces, a step has at least one for each of its iterations."""
    calls = []
    gauss_newton.quick(problem, lambda fraction, _: calls.append(fraction))
    assert calls.count(0.0) >= 4
    assert len(calls) >= 4 + sum(2 + iterations for _, iterations in gauss_newton.FIRST.steps)


def test_a_mirrored_stroke_is_symmetric(preparation):
    """A network knows nothing of symmetry: both halves must be as true as that."""
    angle = np.linspace(0.3, 0.9, 5)
    points = 0.6 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], 1)
    problem = pose(preparation, Stroke(points, Brush(0.12, 0.04), mirror=frozenset("Z")))
    edited, _ = gauss_newton.refine(problem, gauss_newton.quick(problem))
    above = problem.tubes(30, 30)[0].target.points
    there = project(edited, above).points * np.array([1, 1, -1])
    distance = find_surface(edited, there).distance
    assert distance.mean() < 1e-4
    assert np.percentile(distance, 95) < 3e-4
