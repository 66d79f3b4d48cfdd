# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's solver: its loss against autograd, its determinism, and that it learns."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from neural_sculpt_addon.common.errors import Cancelled
from neural_sculpt_addon.common.progress import silent
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.field.solve.paper import (
    BATCH,
    BOX_SAMPLES,
    HUBER,
    PRESERVE_SAMPLES,
    WEIGHTS,
    derivatives,
    loss,
    solve,
    weigh,
)
from neural_sculpt_addon.stroke.brush import Brush
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
    tube_error, preserve_error = (rounded(f).sum() / len(f) for f in fields[:2])
    return (
        WEIGHTS.deformation * tube_error
        + WEIGHTS.regression * preserve_error
        + WEIGHTS.normal * (1 - cosine).sum() / len(normals)
        + WEIGHTS.eikonal * (lengths - 1).abs().sum() / len(lengths)
        + WEIGHTS.boundary * torch.exp(-100 * fields[2].abs()).sum() / len(box)
    )


def total(network, parts):
    """L of all parts."""
    return torch.stack([loss(network, part) for part in parts]).sum()


def rounded(f):
    """|f| but for a constant, with a parabola of the same slope at ROUNDING below that."""
    return torch.where(f.abs() < HUBER, f**2 / (2 * HUBER), f.abs() - HUBER / 2)


def samples(widths, dtype):
    """A network, targets and preserve set with normals, and the box; half of the set has f ~ 0."""
    generator = torch.Generator().manual_seed(1)

    def random(count):
        return torch.rand(count, 3, generator=generator, dtype=dtype) * 2 - 1

    tube, preserve = (
        (random(count), torch.nn.functional.normalize(random(count))) for count in (130, 70)
    )
    preserve[0][1:35] = preserve[0][0] + 1e-4 * random(34)
    network = Siren.random(widths, 5.0, generator)
    parameters = [p.to(dtype) for p in network.parameters]
    parameters[-1] -= network.with_parameters(parameters).value(preserve[0][:1])
    network = network.with_parameters([p.requires_grad_() for p in parameters])
    return network, tube, preserve, random(90)


@pytest.mark.parametrize("widths", [(9,), (8, 7), (5, 6, 4)])
def test_the_loss_and_its_derivatives_are_those_of_autograd(widths):
    network, tube, preserve, box = samples(widths, torch.float64)
    near = network.value(preserve[0]).abs() < HUBER
    assert near.any() and not near.all()  # both branches of the rounded |f| are seen
    whole = weigh(tube, preserve, box)
    mine, expected = total(network, whole), oracle(network, tube, preserve, box)
    torch.testing.assert_close(mine, expected, rtol=1e-10, atol=0)
    parts = [part for group in whole for part in group.split(32)]
    # The constant of a field is no part of its gradient: the bias has a derivative all the same.
    for a, b in zip(
        derivatives(network, parts, lambda done: silent(done, "")),
        torch.autograd.grad(expected, network.parameters),
        strict=True,
    ):
        torch.testing.assert_close(a, b, rtol=1e-7, atol=1e-9)


def test_a_step_in_parts_is_the_whole_step_in_float32():
    network, tube, preserve, box = samples((40, 30), torch.float32)
    whole = weigh(tube, preserve, box)
    expected = torch.autograd.grad(total(network, whole), network.parameters)
    told = []
    parts = [part for group in whole for part in group.split(17)]
    found = derivatives(network, parts, told.append)
    for a, b in zip(found, expected, strict=True):
        assert (a - b).abs().max() <= 1e-5 * b.abs().max()
    np.testing.assert_allclose(told, np.arange(1, len(parts) + 1) / len(parts))


def test_no_samples_of_a_kind_are_no_error():
    """A stroke over all of the surface leaves nothing to preserve."""
    network, tube, preserve, box = samples((9,), torch.float64)
    nothing = tuple(array[:0] for array in preserve)
    found = total(network, weigh(tube, nothing, box))
    assert torch.isfinite(found)


def test_the_papers_weights():
    """Those that the paper gives; it is silent on how the tube and the rest are balanced."""
    assert (WEIGHTS.regression, WEIGHTS.normal) == (1500, 2.5)
    assert (WEIGHTS.eikonal, WEIGHTS.boundary) == (5, 5)


@pytest.mark.long
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
    before = find_surface(ready.field, target).distance.mean()
    after = find_surface(Field(edited), target).distance.mean()
    assert before == pytest.approx(np.linalg.norm(target, axis=1).mean() - 0.6, abs=2e-3)
    assert after < 0.4 * before


def test_the_same_seed_gives_the_same_weights_bit_for_bit(sculpted):
    first, again = (solve(sculpted.problem, epochs=2) for _ in range(2))
    assert all(map(torch.equal, first.parameters, again.parameters))
    other = replace(sculpted.problem, seed=8)
    assert not all(map(torch.equal, first.parameters, solve(other, epochs=2).parameters))


def test_the_given_network_is_left_as_it_is(sculpted):
    before = [p.clone() for p in sculpted.problem.field.network.parameters]
    result = solve(sculpted.problem, epochs=1)
    assert all(map(torch.equal, before, sculpted.problem.field.network.parameters))
    assert not any(p.requires_grad for p in result.parameters)
    for was, now in zip(before, result.parameters, strict=True):
        assert (now - was).abs().max() <= 1.01e-4  # Adam's first step is the learning rate
    assert result.omegas == sculpted.problem.field.network.omegas


def test_a_cancel_is_heard_between_small_parts_of_a_step(sculpted):
    """A part of 2048 samples takes a core about 15 ms, so no cancel waits for 50 ms."""
    seen = []

    def progress(fraction, message):
        seen.append((fraction, message))
        if message.startswith("Epoch 2"):
            raise Cancelled

    with pytest.raises(Cancelled):
        solve(sculpted.problem, progress, epochs=10)
    samples = PRESERVE_SAMPLES + BOX_SAMPLES
    samples += sum(len(tube.target.points) for tube in sculpted.problem.tubes())
    first = [fraction for fraction, message in seen if message == "Epoch 1 of 10"]
    assert len(first) >= samples / BATCH
    assert len(seen) == len(first) + 1
    np.testing.assert_allclose(first, 0.1 * np.arange(1, len(first) + 1) / len(first))
