# SPDX-License-Identifier: GPL-3.0-or-later
"""Pooled evaluation against double precision and SciPy's splines, about the borders of chunks."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from neural_sculpt_addon.field.detail import Level, cells_of, linear, quantised
from neural_sculpt_addon.field.evaluate import CHUNK, GRADIENT_CHUNK, values, values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.threads import PIECE, in_pieces
from tests.field.analytic import ball
from tests.field.splines import basis

LEVEL = 3


@pytest.fixture(scope="module")
def layer():
    """A hundred nodes anywhere in the box."""
    random = np.random.default_rng(1)
    index = np.unique(linear(cells_of(random.uniform(-1, 1, (100, 3)), LEVEL), LEVEL))
    return Level(index, quantised(random.normal(0, 0.1, len(index))))


@pytest.fixture(scope="module")
def field(layer):
    network = Siren.random((64, 48), 20.0, torch.Generator().manual_seed(3))
    return Field(network).plus({LEVEL: layer})


def cloud(count, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (count, 3)).astype(np.float32)


@pytest.mark.parametrize(
    "count", [0, 1, 2, GRADIENT_CHUNK, CHUNK - 1, CHUNK, CHUNK + 1, 3 * CHUNK + 7]
)
def test_values_and_gradients_are_the_sum_of_network_and_splines(field, layer, count):
    x = cloud(count)
    precise = field.network.with_parameters([p.double() for p in field.network.parameters])
    value, gradient = precise.value_and_gradient(torch.from_numpy(x).double())
    splines, slopes = basis(x, layer.index, LEVEL)
    value = value.numpy() + splines @ layer.values
    gradient = gradient.numpy() + np.einsum("nka,k->na", slopes, layer.values)
    found = values_and_gradients(field, x)
    assert found[0].dtype == found[1].dtype == np.float32
    assert (found[0].shape, found[1].shape) == ((count,), (count, 3))
    np.testing.assert_allclose(found[0], value, atol=3e-6)
    np.testing.assert_allclose(found[1], gradient, atol=5e-5)
    np.testing.assert_allclose(values(field, x), value, atol=3e-6)


def test_the_same_points_give_the_same_bits(field):
    x = cloud(5 * CHUNK)
    first = values_and_gradients(field, x)
    for _ in range(5):
        again = values_and_gradients(field, x)
        np.testing.assert_array_equal(first[0], again[0])
        np.testing.assert_array_equal(first[1], again[1])


def test_callers_on_many_threads_do_not_disturb_each_other(field):
    clouds = [cloud(2 * CHUNK + seed, seed) for seed in range(8)]
    expected = [values(field, x) for x in clouds]
    with ThreadPoolExecutor(8) as pool:
        for found, value in zip(
            pool.map(lambda x: values(field, x), clouds), expected, strict=True
        ):
            np.testing.assert_array_equal(found, value)


def test_any_array_of_points_will_do(field):
    x = cloud(50)
    expected = values(field, x)
    np.testing.assert_array_equal(values(field, x.astype(np.float64)), expected)
    np.testing.assert_array_equal(values(field, x.tolist()), expected)
    np.testing.assert_array_equal(values(field, np.asfortranarray(x)), expected)
    np.testing.assert_array_equal(values(field, np.repeat(x, 2, axis=0)[::2]), expected)


def test_points_are_left_as_they_are(field):
    x = cloud(100)
    before = x.copy()
    values_and_gradients(field, x)
    np.testing.assert_array_equal(x, before)


def test_networks_with_gradients_are_read_without_autograd():
    network = ball().network
    learning = network.with_parameters([p.clone().requires_grad_() for p in network.parameters])
    np.testing.assert_array_equal(
        values(Field(learning), cloud(20)), values(Field(network), cloud(20))
    )
    assert all(p.grad is None for p in learning.parameters)


@pytest.mark.parametrize("widths", [(7,), (9, 8, 7, 6)])
def test_one_hidden_layer_and_four(widths):
    network = Siren.random(widths, 10.0, torch.Generator().manual_seed(0))
    x = torch.from_numpy(cloud(30)).requires_grad_()
    value = network.value(x)
    (gradient,) = torch.autograd.grad(value.sum(), x)
    found = values_and_gradients(Field(network), x.detach().numpy())
    np.testing.assert_allclose(found[0], value.detach(), atol=2e-6)
    np.testing.assert_allclose(found[1], gradient, atol=2e-5)


def test_a_task_of_the_pool_evaluates_alone(field):
    """It would wait for ever for chunks that no thread is left to take."""
    points = cloud(8 * PIECE)
    found = in_pieces(lambda part: values_and_gradients(field, points[part]), len(points))
    for mine, expected in zip(found, values_and_gradients(field, points), strict=True):
        np.testing.assert_allclose(mine, expected, atol=1e-5)
