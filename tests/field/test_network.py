# SPDX-License-Identifier: GPL-3.0-or-later
"""The network's value and gradient against the formula in NumPy and against autograd."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field.network import Siren
from tests.field.analytic import ball

architectures = st.tuples(
    st.lists(st.integers(1, 20), min_size=1, max_size=4), st.floats(1, 40), st.integers(0, 10**6)
)


def double(network):
    return network.with_parameters([p.double() for p in network.parameters])


def make(widths, omega, seed):
    return double(Siren.random(widths, omega, torch.Generator().manual_seed(seed)))


def points(seed, count=17):
    return torch.rand(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))


@settings(deadline=None)
@given(architectures)
def test_value_is_the_formula(architecture):
    network, x = make(*architecture), points(1)
    h = x.numpy()
    for weight, bias, omega in zip(
        network.weights[:-1], network.biases[:-1], network.omegas, strict=True
    ):
        h = np.sin(omega * (h @ weight.numpy().T + bias.numpy()))
    expected = h @ network.weights[-1].numpy()[0] + network.biases[-1].numpy()
    np.testing.assert_allclose(network.value(x).numpy(), expected, atol=1e-10)


@settings(deadline=None)
@given(architectures)
def test_gradient_is_that_of_autograd(architecture):
    network, x = make(*architecture), points(2).requires_grad_()
    (expected,) = torch.autograd.grad(network.value(x).sum(), x)
    value, gradient = network.value_and_gradient(x.detach())
    torch.testing.assert_close(gradient, expected, rtol=1e-9, atol=1e-9)
    torch.testing.assert_close(value, network.value(x.detach()), rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=25)
@given(architectures)
def test_the_gradient_is_differentiable_like_a_double_backward(architecture):
    """A loss on value and gradient: its derivatives by the parameters, both ways."""
    network, x = make(*architecture), points(3).requires_grad_()
    parameters = [p.clone().requires_grad_() for p in network.parameters]
    network = network.with_parameters(parameters)

    def loss(value, gradient):
        return value.abs().sum() + (gradient.norm(dim=1) - 1).square().sum()

    value = network.value(x)
    (gradient,) = torch.autograd.grad(value.sum(), x, create_graph=True)
    expected = torch.autograd.grad(loss(value, gradient), parameters)
    found = torch.autograd.grad(loss(*network.value_and_gradient(x.detach())), parameters)
    for mine, oracle in zip(found, expected, strict=True):
        torch.testing.assert_close(mine, oracle, rtol=1e-6, atol=1e-8)


def test_the_gradient_of_a_ball_points_outward():
    x = np.random.default_rng(0).uniform(-1, 1, (100, 3)).astype(np.float32)
    value, gradient = ball(0.5).value_and_gradient(torch.from_numpy(x))
    np.testing.assert_allclose(value, (x**2).sum(axis=1) - 0.25, atol=2e-5)
    np.testing.assert_allclose(gradient, 2 * x, atol=3e-5)


def test_random_networks_follow_the_siren_paper():
    network = Siren.random((400, 300), 30.0, torch.Generator().manual_seed(0))
    assert network.widths == (400, 300)
    assert network.omegas == (30.0, 30.0)
    assert [tuple(w.shape) for w in network.weights] == [(400, 3), (300, 400), (1, 300)]
    bounds = [1 / 3, (6 / 400) ** 0.5 / 30, (6 / 300) ** 0.5 / 30]
    for weight, bound in zip(network.weights, bounds, strict=True):
        assert weight.abs().max() <= bound
        assert weight.std().item() == pytest.approx(bound / 3**0.5, rel=0.1)
    again = Siren.random((400, 300), 30.0, torch.Generator().manual_seed(0))
    assert all(map(torch.equal, again.parameters, network.parameters))
    other = Siren.random((400, 300), 30.0, torch.Generator().manual_seed(1))
    assert not torch.equal(other.weights[0], network.weights[0])


def test_each_layer_may_have_its_omega():
    network = Siren.random((5, 6, 7), (30.0, 20.0, 10.0))
    assert network.omegas == (30.0, 20.0, 10.0)
    assert network.with_parameters(network.parameters).widths == (5, 6, 7)


def test_no_points_have_no_values():
    value, gradient = ball().value_and_gradient(torch.empty(0, 3))
    assert (value.shape, gradient.shape) == ((0,), (0, 3))
    assert ball().value(torch.empty(0, 3)).shape == (0,)


def test_the_papers_network_has_17153_parameters():
    assert sum(p.numel() for p in Siren.random().parameters) == 17_153
