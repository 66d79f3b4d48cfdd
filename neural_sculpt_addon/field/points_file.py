# SPDX-License-Identifier: GPL-3.0-or-later
"""Points to sample a field at, and the samples, as NumPy files.

Files come from outside: nothing in them is executed, and their size is bounded.
"""

import io
from pathlib import Path
from tokenize import TokenError

import numpy as np
from numpy.typing import NDArray

from ..common.errors import SculptError
from ..common.whole_file import write_whole
from .field import Sampled

MOST_POINTS = 1 << 26  # 1 GiB of samples

# What NumPy raises on damaged files.
_DAMAGE = (
    *(ArithmeticError, MemoryError, RecursionError, SyntaxError, TokenError),
    *(TypeError, ValueError),
)


def read(path: Path) -> NDArray:
    """Points (N, 3) of a .npy file, finite numbers. SculptError when it holds none."""
    name = f"{path.name:.100}"
    try:
        points = np.lib.format.open_memmap(path, mode="r")  # executes nothing, reads when asked
    except OSError as error:
        raise SculptError(
            "{} cannot be read: {}.", name, error.strerror or "no .npy file"
        ) from error
    except _DAMAGE as error:
        raise SculptError("{} is no NumPy array of numbers (.npy).", name) from error
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        shape = f"{points.dtype!s:.30} {points.shape!s:.30}"
        raise SculptError("{} holds {}; points are numbers (N, 3).", name, shape)
    if len(points) > MOST_POINTS:
        raise SculptError("{} holds more than {} points; sample them in parts.", name, MOST_POINTS)
    if not np.isfinite(points).all():
        raise SculptError("{} holds NaN or infinite coordinates.", name)
    return points


def write(path: Path, sampled: Sampled) -> None:
    """Write the arrays `f` and `gradient` (.npz). SculptError when it cannot be written."""
    buffer = io.BytesIO()
    np.savez(buffer, f=sampled.f, gradient=sampled.gradient)
    write_whole(path, buffer.getvalue())
