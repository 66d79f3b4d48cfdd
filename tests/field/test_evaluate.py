# SPDX-License-Identifier: GPL-3.0-or-later
"""Pooled evaluation against double precision and SciPy's splines, about the borders of chunks."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from neural_sculpt_addon.common.errors import Cancelled
from neural_sculpt_addon.common.progress import interruptible
from neural_sculpt_addon.field.evaluate import (
    CHUNK,
    GRADIENT_CHUNK,
    WORK,
    values,
    values_and_gradients,
)
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import Level, cells_of, linear, quantised
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.threads import PIECE, in_pieces, pool
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


class Counting(Field):
    """It counts the multiplications by weights between two looks."""

    def value(self, x):
        self.work.append(len(x) * sum(weight.numel() for weight in self.network.weights))
        return super().value(x)

    def value_and_gradient(self, x):
        self.work.append(2 * len(x) * sum(weight.numel() for weight in self.network.weights))
        return super().value_and_gradient(x)

    def __init__(self, network):
        super().__init__(network)
        object.__setattr__(self, "work", [])


@pytest.fixture(scope="module")
def large():
    """1,024 units in 10 layers: 9.4 million weights."""
    return Siren.random((1024,) * 10, 20.0, torch.Generator().manual_seed(3))


@pytest.mark.parametrize("evaluate", [values, values_and_gradients])
def test_between_two_looks_a_large_network_does_as_little_as_a_small_one(large, evaluate):
    field, looks = Counting(large), []
    with interruptible(lambda: looks.append(None)):
        evaluate(field, cloud(500))
    assert max(field.work) <= WORK
    assert len(looks) == len(field.work) >= 500 * 9.4e6 / WORK


@pytest.mark.parametrize("evaluate", [values, values_and_gradients])
def test_a_cancel_is_heard_before_each_chunk_on_every_thread(large, evaluate):
    field, looks = Counting(large), []

    def check():
        looks.append(None)
        if len(looks) > 1:
            raise Cancelled

    with interruptible(check), pytest.raises(Cancelled):
        evaluate(field, cloud(1000))
    assert len(field.work) == 1
    with interruptible(check), pytest.raises(Cancelled):  # in pieces, whose threads look too
        in_pieces(lambda part: evaluate(field, cloud(1000)[part]), 1000, size=500)
    assert len(field.work) == 1


def test_a_large_network_gives_the_same_bits_on_one_thread_and_many(large):
    points = cloud(200)
    many = values_and_gradients(Field(large), points)
    one = pool().submit(values_and_gradients, Field(large), points).result()
    for mine, expected in zip(one, many, strict=True):
        np.testing.assert_array_equal(mine, expected)
