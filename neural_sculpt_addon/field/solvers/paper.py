# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's solver: Adam on all weights (section 4), without the faults of the authors' code.

    L = 1500 mean|f| + 2.5 mean(1 - cos(grad f, n)) + 5 mean| |grad f| - 1 | + 5 mean exp(-100|f|)

The first two terms are over the tube's targets and the preserve set, the last two over points of
the box. Samples are drawn and projected once: the unedited network, which determines them, does not
change while the copy learns. The gradient of f is in closed form, so one backward pass suffices.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ...stroke.progress import Progress, silent
from ..network import Siren
from ..problem import Problem

PRESERVE_SAMPLES = 10_000
BOX_SAMPLES = 10_000
LEARNING_RATE = 1e-4


@dataclass(frozen=True)
class Weights:
    """Of the four loss terms; the defaults are the paper's."""

    regression: float = 1.5e3
    eikonal: float = 5.0
    normal: float = 2.5
    boundary: float = 5.0


PAPER = Weights()
Points = NDArray[np.float32]


def solve(
    problem: Problem, progress: Progress = silent, epochs: int = 100, weights: Weights = PAPER
) -> Siren:
    """Fine-tune a copy of the network for `epochs` full-batch steps; the last iterate counts.

    50 epochs are the paper's speed setting, 100 its quality setting.
    """
    device = problem.network.device
    generator = torch.Generator().manual_seed(problem.seed)
    kept = torch.randperm(len(problem.preserve.points), generator=generator)[:PRESERVE_SAMPLES]
    points = _join(problem.tube.points, problem.preserve.points, kept).to(device)  # (N, 3)
    normals = _join(problem.tube.normals, problem.preserve.normals, kept).to(device)  # (N, 3)
    parameters = [p.clone().requires_grad_() for p in problem.network.parameters]
    network = problem.network.with_parameters(parameters)
    adam = torch.optim.Adam(parameters, lr=LEARNING_RATE)
    for epoch in range(epochs):
        progress(epoch / epochs, f"Epoch {epoch + 1} of {epochs}")
        box = (2 * torch.rand(BOX_SAMPLES, 3, generator=generator) - 1).to(device)
        adam.zero_grad()
        loss(network, points, normals, box, weights).backward()
        adam.step()
    return problem.network.with_parameters([p.detach() for p in parameters])


def loss(network: Siren, points: Tensor, normals: Tensor, box: Tensor, weights: Weights) -> Tensor:
    """The paper's loss for surface targets (N, 3) with unit normals and box points (M, 3)."""
    value, gradient = network.value_and_gradient(torch.cat([points, box]))
    on, off = value.split([len(points), len(box)])
    along, around = gradient.split([len(points), len(box)])
    return (
        weights.regression * on.abs().mean()
        + weights.normal * (1 - torch.cosine_similarity(along, normals, dim=1)).mean()
        + weights.eikonal * (around.norm(dim=1) - 1).abs().mean()
        + weights.boundary * torch.exp(-100 * off.abs()).mean()
    )


def _join(tube: Points, preserve: Points, kept: Tensor) -> Tensor:
    return torch.cat([torch.from_numpy(tube), torch.from_numpy(preserve)[kept]])
