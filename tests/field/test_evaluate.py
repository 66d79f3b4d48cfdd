# SPDX-License-Identifier: GPL-3.0-or-later
"""Pooled evaluation against the network's own value, about the borders of chunks."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from neural_sculpt_addon.field.evaluate import CHUNK, values, values_and_gradients
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.threads import PIECE, in_pieces
from tests.field.analytic import ball


@pytest.fixture(scope="module")
def network():
    return Siren.random((64, 48), 20.0, torch.Generator().manual_seed(3))


def cloud(count, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (count, 3)).astype(np.float32)


@pytest.mark.parametrize("count", [0, 1, 2, CHUNK - 1, CHUNK, CHUNK + 1, 3 * CHUNK + 7])
def test_values_and_gradients_are_those_of_the_network(network, count):
    x = cloud(count)
    precise = network.with_parameters([p.double() for p in network.parameters])
    value, gradient = precise.value_and_gradient(torch.from_numpy(x).double())
    found = values_and_gradients(network, x)
    assert found[0].dtype == found[1].dtype == np.float32
    assert (found[0].shape, found[1].shape) == ((count,), (count, 3))
    np.testing.assert_allclose(found[0], value, atol=3e-6)
    np.testing.assert_allclose(found[1], gradient, atol=5e-5)
    np.testing.assert_allclose(values(network, x), value, atol=3e-6)


def test_the_same_points_give_the_same_bits(network):
    x = cloud(5 * CHUNK)
    first = values_and_gradients(network, x)
    for _ in range(5):
        again = values_and_gradients(network, x)
        np.testing.assert_array_equal(first[0], again[0])
        np.testing.assert_array_equal(first[1], again[1])


def test_callers_on_many_threads_do_not_disturb_each_other(network):
    clouds = [cloud(2 * CHUNK + seed, seed) for seed in range(8)]
    expected = [values(network, x) for x in clouds]
    with ThreadPoolExecutor(8) as pool:
        for found, value in zip(
            pool.map(lambda x: values(network, x), clouds), expected, strict=True
        ):
            np.testing.assert_array_equal(found, value)


def test_any_array_of_points_will_do(network):
    x = cloud(50)
    expected = values(network, x)
    np.testing.assert_array_equal(values(network, x.astype(np.float64)), expected)
    np.testing.assert_array_equal(values(network, x.tolist()), expected)
    np.testing.assert_array_equal(values(network, np.asfortranarray(x)), expected)
    np.testing.assert_array_equal(values(network, np.repeat(x, 2, axis=0)[::2]), expected)


def test_points_are_left_as_they_are(network):
    x = cloud(100)
    before = x.copy()
    values_and_gradients(network, x)
    np.testing.assert_array_equal(x, before)


def test_networks_with_gradients_are_read_without_autograd():
    network = ball()
    learning = network.with_parameters([p.clone().requires_grad_() for p in network.parameters])
    np.testing.assert_array_equal(values(learning, cloud(20)), values(network, cloud(20)))
    assert all(p.grad is None for p in learning.parameters)


def test_one_hidden_layer_and_four():
    for widths in ((7,), (9, 8, 7, 6)):
        network = Siren.random(widths, 10.0, torch.Generator().manual_seed(0))
        x = torch.from_numpy(cloud(30)).requires_grad_()
        value = network.value(x)
        (gradient,) = torch.autograd.grad(value.sum(), x)
        found = values_and_gradients(network, x.detach().numpy())
        np.testing.assert_allclose(found[0], value.detach(), atol=2e-6)
        np.testing.assert_allclose(found[1], gradient, atol=2e-5)


def test_a_task_of_the_pool_evaluates_alone(network):
    """It would wait for ever for chunks that no thread is left to take."""
    points = cloud(8 * PIECE)
    found = in_pieces(lambda part: values_and_gradients(network, points[part]), len(points))
    for there, expected in zip(found, values_and_gradients(network, points), strict=True):
        np.testing.assert_allclose(there, expected, atol=1e-5)
