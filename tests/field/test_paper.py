# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's solver: its loss against autograd, its determinism, and that it learns."""

import numpy as np
import pytest
import torch

from neural_sculpt_addon.field.metrics import find_surface
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.problem import pose
from neural_sculpt_addon.field.solvers.paper import WEIGHTS, loss, solve
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.errors import Cancelled
from neural_sculpt_addon.stroke.stroke import Stroke


def oracle(network, tube, preserve, box):
    """The loss with all gradients by autograd, so that its own need a double backward."""
    parts = [tube[0], preserve[0], box]
    fields, slopes = [], []
    for part in parts:
        x = part.clone().requires_grad_()
        f = network.value(x)
        fields.append(f)
        slopes.append(torch.autograd.grad(f.sum(), x, create_graph=True)[0])
    normals = torch.cat([tube[1], preserve[1]])
    on = torch.cat(slopes[:2])
    lengths = torch.cat(slopes).square().sum(dim=1).sqrt()
    cosine = (on * normals).sum(dim=1) / on.square().sum(dim=1).sqrt()
    return (
        WEIGHTS.deformation * fields[0].abs().sum() / len(tube[0])
        + WEIGHTS.regression * fields[1].abs().sum() / len(preserve[0])
        + WEIGHTS.normal * (1 - cosine).sum() / len(normals)
        + WEIGHTS.eikonal * (lengths - 1).abs().sum() / len(lengths)
        + WEIGHTS.boundary * torch.exp(-100 * fields[2].abs()).sum() / len(box)
    )


@pytest.mark.parametrize("widths", [(9,), (8, 7), (5, 6, 4)])
def test_the_loss_and_its_derivatives_are_those_of_autograd(widths):
    generator = torch.Generator().manual_seed(1)

    def random(count):
        return torch.rand(count, 3, generator=generator, dtype=torch.float64) * 2 - 1

    network = Siren.random(widths, 5.0, generator)
    parameters = [p.double().requires_grad_() for p in network.parameters]
    network = network.with_parameters(parameters)
    tube, preserve = (
        (random(count), torch.nn.functional.normalize(random(count))) for count in (30, 20)
    )
    box = random(40)
    mine, expected = loss(network, tube, preserve, box), oracle(network, tube, preserve, box)
    torch.testing.assert_close(mine, expected, rtol=1e-10, atol=0)
    # The constant of a field is no part of its gradient: the bias has a derivative all the same.
    for a, b in zip(
        torch.autograd.grad(mine, parameters),
        torch.autograd.grad(expected, parameters),
        strict=True,
    ):
        torch.testing.assert_close(a, b, rtol=1e-7, atol=1e-9)


def test_the_papers_weights():
    """Those that the paper gives; it is silent on how the tube and the rest are balanced."""
    assert (WEIGHTS.regression, WEIGHTS.normal) == (1500, 2.5)
    assert (WEIGHTS.eikonal, WEIGHTS.boundary) == (5, 5)


def test_few_epochs_bring_the_surface_closer_to_its_target(ready):
    """Against a target in closed form: a sphere whose radius grows by s b(v / r) at the equator."""
    turn = np.linspace(0, 2 * np.pi, 25)[:-1]
    equator = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    stroke = Stroke(equator, Brush(0.2, 0.04), closed=True)
    edited = solve(pose(ready, stroke), epochs=15)
    random = np.random.default_rng(11)
    turn, latitude = random.uniform(0, 2 * np.pi, 4000), random.uniform(-0.2, 0.2, 4000)
    n = np.stack(
        [np.cos(latitude) * np.cos(turn), np.cos(latitude) * np.sin(turn), np.sin(latitude)], axis=1
    )
    t = 0.6 * 2 * np.abs(np.sin(latitude / 2)) / 0.2
    target = n * (0.6 + 0.04 * (1 - 10 * t**3 + 15 * t**4 - 6 * t**5))[:, None]
    before = find_surface(ready.network, target).distance.mean()
    after = find_surface(edited, target).distance.mean()
    assert before == pytest.approx(np.linalg.norm(target, axis=1).mean() - 0.6, abs=2e-3)
    assert after < 0.4 * before


def test_the_same_seed_gives_the_same_weights_bit_for_bit(sculpted):
    first, again = (solve(sculpted.problem, epochs=2) for _ in range(2))
    assert all(map(torch.equal, first.parameters, again.parameters))
    other = type(sculpted.problem)(sculpted.preparation, sculpted.problem.laid, seed=8)
    assert not all(map(torch.equal, first.parameters, solve(other, epochs=2).parameters))


def test_the_given_network_is_left_as_it_is(sculpted):
    before = [p.clone() for p in sculpted.problem.network.parameters]
    result = solve(sculpted.problem, epochs=1)
    assert all(map(torch.equal, before, sculpted.problem.network.parameters))
    assert not any(p.requires_grad for p in result.parameters)
    for was, now in zip(before, result.parameters, strict=True):
        assert (now - was).abs().max() <= 1.01e-4  # Adam's first step is the learning rate
    assert result.omegas == sculpted.problem.network.omegas


def test_progress_and_cancelling_between_two_steps(sculpted):
    seen = []

    def progress(fraction, message):
        seen.append(fraction)
        if len(seen) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        solve(sculpted.problem, progress, epochs=10)
    np.testing.assert_allclose(seen, [0, 0.1, 0.2])
