# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit as the paper does it: the surface's points and normals, and the eikonal equation elsewhere.

    L = 1500 mean |f|                on the surface
      + 2.5  mean (1 - cos(grad f, normal))
      + 5    mean | |grad f| - 1 |   at points anywhere in the box
      + 5    mean exp(-100 |f|)      at the same points

Rubab and Tong, "Interactive Stroke-based Neural SDF Sculpting", HPG 2025; the losses are those of
Sitzmann et al. 2020 with other weights. No distance is needed, but nothing tells the network how
far away the surface is, so it converges slowly and the sign may go wrong in the volume. Kept for
comparison. Model space.
"""

import math
from collections.abc import Iterator

import torch
from torch import Tensor
from torch.nn.functional import cosine_similarity

from .adam import Adam
from .fit_distance import Course, cosine
from .network import Siren

SURFACE, NORMAL, EIKONAL, BOUNDARY = 1500.0, 2.5, 5.0, 5.0
SHARPNESS = 100.0  # of the boundary loss


def learn(
    points: Tensor, normals: Tensor, course: Course, seed: int
) -> Iterator[tuple[Siren, float]]:
    """Adam on surface `points` (N, 3) with `normals` (N, 3); yields as `fit_distance.learn` does.

    The error is the mean |f| on the surface.
    """
    generator = torch.Generator().manual_seed(seed)
    network = Siren.random(generator=generator)
    parameters = [parameter.requires_grad_() for parameter in network.parameters]
    adam = Adam(parameters)
    error = math.nan
    for step in range(course.steps):
        chosen = torch.randint(len(points), (course.batch,), generator=generator)
        box = 2 * torch.rand(course.batch, 3, generator=generator) - 1  # (B, 3)
        value, gradient = network.value_and_gradient(torch.cat([points[chosen], box]))
        on, off = value[: course.batch], value[course.batch :]
        total = paper_loss(
            on, gradient[: course.batch], normals[chosen], off, gradient[course.batch :]
        )
        adam.step(torch.autograd.grad(total, parameters), course.rate * cosine(step / course.steps))
        latest = float(on.detach().abs().mean())
        error = latest if math.isnan(error) else 0.95 * error + 0.05 * latest
        yield network.with_parameters([parameter.detach() for parameter in parameters]), error


def paper_loss(
    on: Tensor, on_gradient: Tensor, normals: Tensor, off: Tensor, off_gradient: Tensor
) -> Tensor:
    """The loss of values (B,) and gradients (B, 3), on the surface and off it."""
    return (
        SURFACE * on.abs().mean()
        + NORMAL * (1 - cosine_similarity(on_gradient, normals, dim=1)).mean()
        + EIKONAL * (off_gradient.norm(dim=1) - 1).abs().mean()
        + BOUNDARY * torch.exp(-SHARPNESS * off.abs()).mean()
    )
