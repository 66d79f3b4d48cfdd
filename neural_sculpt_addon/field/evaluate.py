# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation of a field at many points: NumPy in, NumPy out, no autograd.

The network is so small that overhead decides. On the CPU, chunks that fit the cache go to a pool
of threads, and NumPy takes the sines: half of the work, and torch needs a sixth longer for them.
Points are in model space.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from .network import Siren
from .threads import in_pool, pool, threads

CHUNK = 2048
GRADIENT_CHUNK = 1536  # takes three times the memory
FEW = 512  # points that are not worth a second thread
DEVICE_CHUNK = 1 << 18


def values(network: Siren, points: ArrayLike) -> NDArray[np.float32]:
    """f at `points` (N, 3) -> (N,) float32."""
    plan = _Plan(network)
    out = np.empty(len(x := _points(points)), np.float32)

    def evaluate(part: slice) -> None:
        h, _ = plan.forward(torch.from_numpy(x[part]).to(plan.device))
        out[part] = torch.addmv(plan.last_bias, h, plan.last_weight[0]).cpu().numpy()

    _in_chunks(evaluate, len(x), CHUNK, plan.device)
    return out


def values_and_gradients(
    network: Siren, points: ArrayLike
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """f (N,) and grad f (N, 3), both float32, at `points` (N, 3)."""
    plan = _Plan(network)
    x = _points(points)
    value = np.empty(len(x), np.float32)
    gradient = np.empty((len(x), 3), np.float32)

    def evaluate(part: slice) -> None:
        h, slopes = plan.forward(torch.from_numpy(x[part]).to(plan.device), slopes=True)
        value[part] = torch.addmv(plan.last_bias, h, plan.last_weight[0]).cpu().numpy()
        back = plan.last_weight
        for weight, slope in zip(reversed(plan.weights), reversed(slopes), strict=True):
            back = slope.mul_(back) @ weight  # (n, width below)
        gradient[part] = back.cpu().numpy()

    _in_chunks(evaluate, len(x), GRADIENT_CHUNK, plan.device)
    return value, gradient


class _Plan:
    """A network with omega folded into its weights.

    These lie in memory by columns: MKL multiplies by three columns side by side 3 times slower.
    """

    def __init__(self, network: Siren) -> None:
        layers = list(zip(network.weights, network.biases, network.omegas, strict=False))
        self.device = network.device
        self.weights = [(omega * weight).T.contiguous().T for weight, _, omega in layers]
        self.biases = [omega * bias for _, bias, omega in layers]
        self.last_weight, self.last_bias = network.weights[-1], network.biases[-1]

    def forward(self, h: Tensor, slopes: bool = False) -> tuple[Tensor, list[Tensor]]:
        """The last hidden layer (n, width) and, if wanted, the cosines of every layer."""
        cosines = []
        for weight, bias in zip(self.weights, self.biases, strict=True):
            h = torch.addmm(bias, h, weight.T)
            if slopes:
                cosines.append(_cosine(h))
            _sine(h)
        return h, cosines


def _sine(h: Tensor) -> None:
    """Put sin(h) in the place of h."""
    if h.device.type == "cpu":
        np.sin(h.numpy(), out=h.numpy())
    else:
        h.sin_()


def _cosine(h: Tensor) -> Tensor:
    return torch.from_numpy(np.cos(h.numpy())) if h.device.type == "cpu" else torch.cos(h)


def _points(points: ArrayLike) -> NDArray[np.float32]:
    return np.ascontiguousarray(points, np.float32).reshape(-1, 3)


def _in_chunks(
    evaluate: Callable[[slice], None], count: int, chunk: int, device: torch.device
) -> None:
    """Let `evaluate` do all of `count` points, on the CPU in equal chunks for each thread."""
    in_cache = device.type == "cpu"
    together = in_cache and not in_pool()
    chunks = max(1, math.ceil(count / (chunk if in_cache else DEVICE_CHUNK)))
    if together and count > FEW:
        chunks = threads() * math.ceil(chunks / threads())
    ends = [count * number // chunks for number in range(chunks + 1)]
    parts = [slice(*pair) for pair in pairwise(ends)]

    def task(part: slice) -> None:
        with torch.inference_mode():
            evaluate(part)

    if len(parts) <= 1 or not together:
        for part in parts:
            task(part)
    else:
        list(pool().map(task, parts))  # list: raise what a chunk raised
