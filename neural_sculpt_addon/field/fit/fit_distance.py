# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit by distance: a network learns value and gradient of a mesh's signed distance.

    L = mean( (f - d)^2 / (|d| + SOFTNESS) ) + GRADIENT_WEIGHT mean( |grad f - grad d|^2 )

The samples crowd near the surface and the weight falls with the distance from it. The gradient of
the distance points away from the closest point, so it costs nothing and teaches the normals; only
the samples near the surface learn it, for it doubles the work. The derivatives of L by the weights,
second derivatives of the network among them, are written out: one pass up, one down, and the same
back (autograd is the oracle in the tests). Model space. See docs/method.md, section 5.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ...common.progress import Progress, silent
from ..network import Siren
from ..solve.adam import Adam
from .mesh_distance import MeshDistance

NEAR_DEVIATION, AROUND_DEVIATION = 0.01, 0.06
"""Standard deviations of the samples' distance from the surface."""

NEAR_SHARE, AROUND_SHARE = 0.6, 0.15  # the rest is uniform in the sampled box
SAMPLED_BOX = 1.15
"""Half the edge of the sampled box. With 1, islands grow on the faces of the real box."""

SOFTNESS = 0.03  # model units: the smaller, the more samples near the surface weigh
GRADIENT_WEIGHT = 0.045  # of slopes against values in the loss
BETAS = (0.9, 0.98)  # of Adam, the second by custom 0.999: shorter memory


@dataclass(frozen=True)
class TrainingSamples:
    """What the network learns, float32."""

    points: Tensor  # (N, 3)
    values: Tensor  # (N,)
    gradients: Tensor  # (M, 3), of the first M points, which are those close to the surface


def sample(
    distance: MeshDistance, count: int, rng: np.random.Generator, progress: Progress = silent
) -> TrainingSamples:
    """`count` points near the surface and in the box, with the distance there."""
    near, around = int(NEAR_SHARE * count), int(AROUND_SHARE * count)
    spread = rng.permutation(np.repeat([NEAR_DEVIATION, AROUND_DEVIATION], [near, around]))[:, None]
    points = distance.surface(near + around, rng, films=True).points
    points = points + spread * rng.standard_normal(points.shape)
    rest = rng.uniform(-SAMPLED_BOX, SAMPLED_BOX, (count - near - around, 3))
    points = np.concatenate([points, rest]).clip(-SAMPLED_BOX, SAMPLED_BOX)
    found = distance(points, progress)
    close = np.arange(count) < near + around
    return arranged(points, found.value, found.gradient, close)


def arranged(
    points: NDArray, values: NDArray, gradients: NDArray, close: NDArray
) -> TrainingSamples:
    """Samples of which `close` (N,) come first: points (N, 3), values (N,), gradients (N, 3)."""
    order = np.argsort(~close, kind="stable")
    gradients = gradients[order[: close.sum()]]
    return TrainingSamples(*(_float(array) for array in (points[order], values[order], gradients)))


class Learner:
    """Adam on samples. `network` is the one that learns: its tensors change with each step."""

    def __init__(self, samples: TrainingSamples, network: Siren, batch: int, seed: int) -> None:
        """Learn from `batch` samples at a time; one torch thread does best."""
        generator = torch.Generator().manual_seed(seed)
        sizes = [tensor.numel() for tensor in network.parameters]
        self._weights = torch.cat([tensor.flatten() for tensor in network.parameters])  # one tensor
        views = zip(self._weights.split(sizes), network.parameters, strict=True)
        self.network = network.with_parameters([view.view_as(like) for view, like in views])
        self._samples = samples
        self._adam = Adam([self._weights], BETAS)
        count, close = len(samples.points), len(samples.gradients)
        taught = round(batch * close / count)
        self._close = _Deck(range(close), taught, generator)
        self._others = _Deck(range(close, count), batch - taught, generator)

    def step(self, rate: float) -> float:
        """One step of learning rate `rate`; the mean |f - d| of its close samples before it."""
        close = self._close.deal()
        index = torch.cat([close, self._others.deal()])
        samples = self._samples
        batch = TrainingSamples(
            samples.points[index], samples.values[index], samples.gradients[close]
        )
        error, slopes = loss_gradients(self.network, batch)
        self._adam.step([torch.cat([slope.flatten() for slope in slopes])], rate)
        return error


class _Deck:
    """Indices dealt `hand` at a time, each once before any comes again."""

    def __init__(self, indices: range, hand: int, generator: torch.Generator) -> None:
        self._indices, self._hand, self._generator = indices, hand, generator
        self._rest = torch.empty(0, dtype=torch.int64)

    def deal(self) -> Tensor:
        """The next indices (hand,), fewer when there are not so many."""
        if len(self._rest) < self._hand:
            count = len(self._indices)
            self._rest = self._indices.start + torch.randperm(count, generator=self._generator)
        dealt, self._rest = self._rest[: self._hand], self._rest[self._hand :]
        return dealt


@torch.no_grad()
def loss_gradients(network: Siren, batch: TrainingSamples) -> tuple[float, list[Tensor]]:
    """The mean |f - d| of the close samples, and dL / dparameter in the order of the parameters.

    Notation: h_k = sin z_k, s_k = cos z_k, z_k = omega_k (W_k h_{k-1} + b_k); going down, for the
    close samples only, u_L = w, p_k = u_k s_k, u_{k-1} = p_k omega_k W_k, grad f = u_0. A bar is
    dL / d(quantity).
    """
    count, close = len(batch.points), len(batch.gradients)
    scaled = [w * omega for w, omega in zip(network.weights, network.omegas, strict=False)]
    h, s = [batch.points], []
    for weight, bias, omega in zip(scaled, network.biases, network.omegas, strict=False):
        z = torch.addmm(omega * bias, h[-1], weight.T)  # (N, width)
        s.append(torch.cos(z))
        h.append(z.sin_())
    last = network.weights[-1]  # (1, width)
    off = torch.addmv(network.biases[-1], h[-1], last[0]).sub_(batch.values)  # (N,)
    u, p = [last], []  # from the top down
    for weight, slope in zip(reversed(scaled), reversed(s), strict=True):
        p.append(u[-1] * slope[:close])  # (M, width)
        u.append(p[-1] @ weight)  # (M, width below)
    u, p = u[::-1], p[::-1]

    value_bar = 2 / count * off / (batch.values.abs() + SOFTNESS)  # (N,)
    u_bar = (u[0] - batch.gradients).mul_(2 / max(close, 1) * GRADIENT_WEIGHT)  # (M, 3)

    weight_bars, s_bars = [], []
    for weight, slope, above, down in zip(scaled, s, u[1:], p, strict=True):  # up the gradient
        p_bar = u_bar @ weight.T  # (M, width)
        weight_bars.append(down.T @ u_bar)  # (out, in)
        u_bar = p_bar * slope[:close]
        s_bars.append(p_bar.mul_(above))
    slopes = [value_bar.sum()[None], (u_bar.sum(dim=0) + value_bar @ h[-1])[None]]
    h_bar = value_bar[:, None] * last
    for layer in reversed(range(len(scaled))):  # back down through the value
        z_bar = h_bar.mul_(s[layer])  # (N, width)
        z_bar[:close].sub_(s_bars[layer].mul_(h[layer + 1][:close]))
        omega = network.omegas[layer]
        slopes.append(omega * z_bar.sum(dim=0))
        slopes.append(omega * weight_bars[layer].addmm_(z_bar.T, h[layer]))
        h_bar = z_bar @ scaled[layer] if layer else z_bar
    return float(off[: close or count].abs().mean()), slopes[::-1]


def _float(array: NDArray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, np.float32))
