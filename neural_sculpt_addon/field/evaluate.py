# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation of a field at many points: NumPy in, NumPy out, no autograd.

On the CPU, chunks that fit the cache go to a pool of threads with one torch thread each. How points
are divided depends on their number alone, so any number of cores gives the same bits. Model space.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from .threads import in_pool, pool

if TYPE_CHECKING:  # a field samples itself by these functions
    from .field import Field

CHUNK = 2048
GRADIENT_CHUNK = 1536  # takes three times the memory
DEVICE_CHUNK = 1 << 18


def values(field: "Field", points: ArrayLike) -> NDArray[np.float32]:
    """f at `points` (N, 3) -> (N,) float32."""
    out = np.empty(len(x := _points(points)), np.float32)

    def evaluate(part: slice) -> None:
        out[part] = field.value(torch.from_numpy(x[part]).to(field.device)).cpu().numpy()

    _in_chunks(evaluate, len(x), CHUNK, field.device)
    return out


def values_and_gradients(
    field: "Field", points: ArrayLike
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """f (N,) and grad f (N, 3), both float32, at `points` (N, 3)."""
    x = _points(points)
    value = np.empty(len(x), np.float32)
    gradient = np.empty((len(x), 3), np.float32)

    def evaluate(part: slice) -> None:
        f, slope = field.value_and_gradient(torch.from_numpy(x[part]).to(field.device))
        value[part], gradient[part] = f.cpu().numpy(), slope.cpu().numpy()

    _in_chunks(evaluate, len(x), GRADIENT_CHUNK, field.device)
    return value, gradient


def _points(points: ArrayLike) -> NDArray[np.float32]:
    return np.ascontiguousarray(points, np.float32).reshape(-1, 3)


def _in_chunks(
    evaluate: Callable[[slice], None], count: int, chunk: int, device: torch.device
) -> None:
    """Let `evaluate` do all of `count` points, on the CPU in equal chunks."""
    on_cpu = device.type == "cpu"
    chunks = -(-count // (chunk if on_cpu else DEVICE_CHUNK))
    ends = [count * number // max(chunks, 1) for number in range(chunks + 1)]
    parts = [slice(*pair) for pair in pairwise(ends)]

    def task(part: slice) -> None:
        with torch.inference_mode():
            evaluate(part)

    if in_pool() or not on_cpu:
        for part in parts:
            task(part)
    else:
        list(pool().map(task, parts))  # list: raise what a chunk raised
