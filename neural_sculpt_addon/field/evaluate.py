# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation of a field at many points: NumPy in, NumPy out, no autograd.

On the CPU, chunks that fit the cache go to a pool of threads with one torch thread each. How points
are divided depends on their number and the network alone, so any number of cores gives the same
bits. A cancel is heard before each chunk, which has fewer points where the network is large.
Model space.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from ..common.progress import look
from .geometry import unit
from .network import Siren
from .threads import parallel, shares

CHUNK = 2048  # points whose activations fit the cache of a core
GRADIENT_CHUNK = 1536  # takes three times the memory
DEVICE_CHUNK = 1 << 18  # on a graphics card: more are fewer calls, and more of its memory
WORK = 1 << 30
"""Multiplications in a chunk, on the CPU, at most: some 100 ms."""


class Evaluated(Protocol):
    """What can be evaluated: a `Field`, which samples itself by these functions."""

    @property
    def network(self) -> Siren: ...
    @property
    def device(self) -> torch.device: ...
    def value(self, x: Tensor) -> Tensor: ...
    def value_and_gradient(self, x: Tensor) -> tuple[Tensor, Tensor]: ...


def values(field: Evaluated, points: ArrayLike) -> NDArray[np.float32]:
    """f at `points` (N, 3) -> (N,) float32."""
    out = np.empty(len(x := _points(points)), np.float32)

    def evaluate(part: slice) -> None:
        out[part] = field.value(torch.from_numpy(x[part]).to(field.device)).cpu().numpy()

    _in_chunks(evaluate, len(x), chunk(field, CHUNK, 1), field.device)
    return out


def values_and_gradients(
    field: Evaluated, points: ArrayLike
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """f (N,) and grad f (N, 3), both float32, at `points` (N, 3)."""
    x = _points(points)
    value = np.empty(len(x), np.float32)
    gradient = np.empty((len(x), 3), np.float32)

    def evaluate(part: slice) -> None:
        f, slope = field.value_and_gradient(torch.from_numpy(x[part]).to(field.device))
        value[part], gradient[part] = f.cpu().numpy(), slope.cpu().numpy()

    _in_chunks(evaluate, len(x), chunk(field, GRADIENT_CHUNK, 2), field.device)
    return value, gradient


def normals(field: Evaluated, points: ArrayLike) -> NDArray[np.float32]:
    """The directions (N, 3) of grad f, of unit length, at `points` (N, 3)."""
    gradient = values_and_gradients(field, points)[1]
    return unit(gradient)


def chunk(field: Evaluated, most: int, passes: int) -> int:
    """Points, `most` of them, that go through the network so often within WORK."""
    if field.device.type != "cpu":
        return DEVICE_CHUNK
    weights = sum(weight.numel() for weight in field.network.weights)
    return max(1, min(most, WORK // (passes * weights)))


def _points(points: ArrayLike) -> NDArray[np.float32]:
    return np.ascontiguousarray(points, np.float32).reshape(-1, 3)


def _in_chunks(
    evaluate: Callable[[slice], None], count: int, size: int, device: torch.device
) -> None:
    """Let `evaluate` do all of `count` points, in equal chunks of `size` at most."""
    parts = shares(count, size)

    def task(part: slice) -> None:
        look()
        with torch.inference_mode():
            evaluate(part)

    if device.type == "cpu":
        parallel(task, parts)
    else:
        for part in parts:
            task(part)
