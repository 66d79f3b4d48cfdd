# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit by distance: a network learns the value and the gradient of a mesh's signed distance.

    L = mean( (f - d)^2 / (|d| + SOFTNESS) + GRADIENT_WEIGHT |grad f - grad d|^2 )

The samples crowd near the surface and the weight falls with the distance from it. The gradient of
the distance points away from the closest point, so it costs nothing and teaches the normals. The
derivatives of L by the weights, second derivatives of the network among them, are written out: one
pass up, one down, and the same back, a quarter faster than autograd (the oracle in the tests).
Model space.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ..stroke.progress import Progress, silent
from .adam import Adam
from .mesh_distance import MeshDistance
from .network import Siren

OMEGAS = (42.0, 30.0)  # of the first layer and the second: a little more detail than 30, 30
NEAR, AROUND = 0.01, 0.06  # standard deviations of the samples' distance from the surface
NEAR_SHARE, AROUND_SHARE = 0.45, 0.25  # the rest is uniform in the sampled box
BOX = 1.15  # half the edge of the sampled box; with 1, islands grow on the faces of the real box
SOFTNESS = 0.03
GRADIENT_WEIGHT = 0.03
BETAS = (0.95, 0.99)


@dataclass(frozen=True)
class Course:
    """How long to learn: Adam steps, samples in each, samples in all, first learning rate."""

    steps: int
    batch: int
    samples: int
    rate: float


@dataclass(frozen=True)
class Samples:
    """What the network learns, float32."""

    points: Tensor  # (N, 3)
    values: Tensor  # (N,)
    gradients: Tensor  # (N, 3)
    certain: Tensor  # (N,), 0 where the gradient is a guess

    def __getitem__(self, index: Tensor) -> "Samples":
        return Samples(
            self.points[index], self.values[index], self.gradients[index], self.certain[index]
        )


def sample(
    distance: MeshDistance, count: int, rng: np.random.Generator, progress: Progress = silent
) -> Samples:
    """`count` points near the surface and in the box, with the distance there."""
    near, around = int(NEAR_SHARE * count), int(AROUND_SHARE * count)
    spread = np.repeat([NEAR, AROUND], [near, around])[:, None]
    points = distance.surface(near + around, rng).points
    points = points + spread * rng.standard_normal(points.shape)
    rest = rng.uniform(-BOX, BOX, (count - near - around, 3))
    points = np.concatenate([points, rest]).clip(-BOX, BOX)
    found = distance(points, progress)
    return Samples(*(_float(array) for array in (points, *found)))


def learn(samples: Samples, course: Course, seed: int) -> Iterator[tuple[Siren, float]]:
    """Adam on `samples`, one torch thread; yields the network and its error as it goes.

    The error is the mean |f - d| near the surface, model units, over the latest steps. The tensors
    of the yielded network change in place until the iterator ends.
    """
    generator = torch.Generator().manual_seed(seed)
    network = Siren.random(omega=OMEGAS, generator=generator)
    parameters = list(network.parameters)
    adam = Adam(parameters, BETAS)
    order, position, error = torch.empty(0, dtype=torch.int64), 0, math.nan
    for step in range(course.steps):
        if position + course.batch > len(order):
            order, position = torch.randperm(len(samples.points), generator=generator), 0
        batch = samples[order[position : position + course.batch]]
        position += course.batch
        latest, slopes = loss_gradients(network, batch)
        adam.step(slopes, course.rate * cosine(step / course.steps))
        error = latest if math.isnan(error) else 0.95 * error + 0.05 * latest
        yield network, error


def cosine(fraction: float) -> float:
    """The share of the first learning rate that is left after `fraction` of the steps."""
    return 0.5 * (1 + math.cos(math.pi * fraction))


@torch.no_grad()
def loss_gradients(network: Siren, batch: Samples) -> tuple[float, list[Tensor]]:
    """The mean |f - d| near the surface, and dL / dparameter in the order of the parameters.

    Notation: h_k = sin z_k, s_k = cos z_k, z_k = omega_k (W_k h_{k-1} + b_k); going down,
    u_L = w, p_k = u_k s_k, u_{k-1} = p_k omega_k W_k, grad f = u_0. A bar is dL / d(quantity).
    """
    count, layers = len(batch.points), len(network.omegas)
    scaled = [w * omega for w, omega in zip(network.weights, network.omegas, strict=False)]
    h, s = [batch.points], []
    for weight, bias, omega in zip(scaled, network.biases, network.omegas, strict=False):
        z = torch.addmm(omega * bias, h[-1], weight.T)  # (N, width)
        s.append(torch.cos(z))
        h.append(z.sin_())
    value = torch.addmv(network.biases[-1], h[-1], network.weights[-1][0])  # (N,)
    u, p = [network.weights[-1]], []  # from the top down
    for weight, slope in zip(reversed(scaled), reversed(s), strict=True):
        p.append(u[-1] * slope)  # (N, width)
        u.append(p[-1] @ weight)  # (N, width below)
    u, p = u[::-1], p[::-1]

    off = value - batch.values  # (N,)
    nearness = 1 / (batch.values.abs() + SOFTNESS)  # (N,)
    value_bar = 2 / count * nearness * off  # (N,)
    u_bar = 2 / count * GRADIENT_WEIGHT * batch.certain[:, None] * (u[0] - batch.gradients)

    weight_bars, s_bars = [], []
    for layer in range(layers):  # back up through the gradient
        p_bar = u_bar @ scaled[layer].T  # (N, width)
        weight_bars.append(p[layer].T @ u_bar)  # (out, in)
        s_bars.append(p_bar * u[layer + 1])
        u_bar = p_bar * s[layer]
    slopes = [value_bar.sum()[None], (u_bar.sum(dim=0) + value_bar @ h[-1])[None]]
    h_bar = value_bar[:, None] * network.weights[-1]
    for layer in reversed(range(layers)):  # back down through the value
        z_bar = h_bar * s[layer] - s_bars[layer] * h[layer + 1]  # (N, width)
        omega = network.omegas[layer]
        slopes.append(omega * z_bar.sum(dim=0))
        slopes.append(omega * (weight_bars[layer] + z_bar.T @ h[layer]))
        h_bar = z_bar @ scaled[layer]
    near = batch.values.abs() < AROUND
    return float(off[near].abs().mean()), slopes[::-1]


def _float(array: NDArray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, np.float32))
