# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit as the paper does it: points and normals of the surface, the eikonal equation elsewhere.

    L = 1500 mean |f|                on the surface
      + 2.5  mean (1 - cos(grad f, normal))
      + 5    mean | |grad f| - 1 |   at points anywhere in the box
      + 5    mean exp(-100 |f|)      at the same points

Rubab and Tong, "Interactive Stroke-based Neural SDF Sculpting", HPG 2025; the losses are those of
Sitzmann et al. 2020 with other weights. No distance is needed, but nothing tells the network how
far away the surface is, so it converges slowly and the sign may go wrong in the volume. Kept for
comparison. Model space. See docs/method.md, section 11.
"""

import torch
from torch import Tensor
from torch.nn.functional import cosine_similarity

from ..network import Siren
from ..solve.adam import Adam

SURFACE, NORMAL, EIKONAL, BOUNDARY = 1500.0, 2.5, 5.0, 5.0
SHARPNESS = 100.0  # of the boundary loss


class Learner:
    """Adam on a surface. `network` is the one that learns: its tensors change with each step."""

    def __init__(
        self, points: Tensor, normals: Tensor, network: Siren, batch: int, seed: int
    ) -> None:
        """Learn from `batch` of the surface `points` (N, 3), `normals` (N, 3) at a time."""
        self.network = network
        self._points, self._normals, self._batch = points, normals, batch
        self._generator = torch.Generator().manual_seed(seed)
        self._adam = Adam(network.parameters)

    def step(self, rate: float) -> float:
        """One step of learning rate `rate`; the mean |f| on its surface points before it."""
        chosen = torch.randint(len(self._points), (self._batch,), generator=self._generator)
        box = 2 * torch.rand(self._batch, 3, generator=self._generator) - 1  # (B, 3)
        leaves = [tensor.detach().requires_grad_() for tensor in self.network.parameters]
        network = self.network.with_parameters(leaves)
        value, gradient = network.value_and_gradient(torch.cat([self._points[chosen], box]))
        on, off = value.split(self._batch)
        on_gradient, off_gradient = gradient.split(self._batch)
        total = paper_loss(on, on_gradient, self._normals[chosen], off, off_gradient)
        self._adam.step(torch.autograd.grad(total, leaves), rate)
        return float(on.detach().abs().mean())


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
