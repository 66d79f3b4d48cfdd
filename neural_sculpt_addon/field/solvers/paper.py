# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's solver: Adam on all weights (section 4), without the faults of the authors' code.

    L = 150 mean|f(p')| + 1500 mean|f(p)| + 2.5 mean(1 - cos(grad f, n)) + 5 mean| |grad f| - 1 |
        + 5 mean exp(-100 |f|)

over the tube's targets p', the preserve set p, both with normals n, and points of the box; the
eikonal term is over all of them, the last term over the box alone. The paper does not say how the
two first terms are balanced. The tube is about a hundred times denser than the preserve set: with
equal weights a moat forms around the stroke (drift p99 15e-3); 150 gives the authors' figures.

Samples are drawn and projected once: the unedited network, which determines them, does not change
while its copy learns. The gradient of f is in closed form, so one backward pass suffices.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ...stroke.progress import Progress, silent
from ..adam import Adam
from ..network import Siren
from ..problem import Problem

PRESERVE_SAMPLES = 10_000
BOX_SAMPLES = 10_000
LEARNING_RATE = 1e-4


@dataclass(frozen=True)
class Weights:
    """Of the loss terms."""

    deformation: float = 150.0
    regression: float = 1500.0
    normal: float = 2.5
    eikonal: float = 5.0
    boundary: float = 5.0


WEIGHTS = Weights()


def solve(problem: Problem, progress: Progress = silent, epochs: int = 100) -> Siren:
    """Fine-tune a copy of the network for `epochs` full-batch steps; the last iterate counts.

    50 epochs are the paper's speed setting, 100 its quality setting.
    """
    device = problem.network.device
    generator = torch.Generator().manual_seed(problem.seed)
    targets = [tube.target for tube in problem.tubes()]
    tube = [
        torch.from_numpy(np.concatenate(part)).to(device) for part in zip(*targets, strict=True)
    ]
    surface = problem.preparation.surface
    untouched = torch.from_numpy(np.flatnonzero(problem.untouched(surface)))
    kept = untouched[torch.randperm(len(untouched), generator=generator)[:PRESERVE_SAMPLES]]
    preserve = [torch.from_numpy(array)[kept].to(device) for array in surface]
    parameters = [p.clone().requires_grad_() for p in problem.network.parameters]
    network = problem.network.with_parameters(parameters)
    adam = Adam(parameters)
    for epoch in range(epochs):
        progress(epoch / epochs, f"Epoch {epoch + 1} of {epochs}")
        box = (2 * torch.rand(BOX_SAMPLES, 3, generator=generator) - 1).to(device)  # (M, 3)
        error = loss(network, tube, preserve, box)
        adam.step(torch.autograd.grad(error, parameters), LEARNING_RATE)
    return problem.network.with_parameters([p.detach() for p in parameters])


def loss(network: Siren, tube: Sequence[Tensor], preserve: Sequence[Tensor], box: Tensor) -> Tensor:
    """The loss for targets and preserve set, (points (N, 3), unit normals (N, 3)), and the box."""
    sizes = [len(tube[0]), len(preserve[0]), len(box)]
    value, gradient = network.value_and_gradient(torch.cat([tube[0], preserve[0], box]))
    moved, kept, free = value.split(sizes)
    normals = torch.cat([tube[1], preserve[1]])
    cosine = torch.cosine_similarity(gradient[: len(normals)], normals, dim=1)
    return (
        WEIGHTS.deformation * moved.abs().mean()
        + WEIGHTS.regression * kept.abs().mean()
        + WEIGHTS.normal * (1 - cosine).mean()
        + WEIGHTS.eikonal * (gradient.norm(dim=1) - 1).abs().mean()
        + WEIGHTS.boundary * torch.exp(-100 * free.abs()).mean()
    )
