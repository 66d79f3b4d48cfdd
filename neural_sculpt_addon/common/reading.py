# SPDX-License-Identifier: GPL-3.0-or-later
"""JSON values read strictly: "0.1", true or null are no numbers, 1.5 is no integer.

Each function raises TypeError, ValueError or OverflowError; the caller knows the word to blame.
"""

import numpy as np
from numpy.typing import NDArray

UNREADABLE = (TypeError, ValueError, OverflowError)


def number(value: object) -> float:
    """A float from a JSON number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError("not a number")
    return float(value)


def integer(value: object) -> int:
    """An int from a JSON integer."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError("not an integer")
    return value


def flag(value: object) -> bool:
    """A bool from true or false."""
    if not isinstance(value, bool):
        raise TypeError("neither true nor false")
    return value


def text(value: object) -> str:
    """A str from a JSON string."""
    if not isinstance(value, str):
        raise TypeError("not a text")
    return value


def numbers(value: object) -> NDArray[np.float64]:
    """A float64 array, a copy, from an array or nested lists of numbers."""
    array = np.array(value)
    if array.dtype.kind not in "iuf":
        raise TypeError("not numbers")
    return array.astype(float)
