# SPDX-License-Identifier: GPL-3.0-or-later
"""The profile b(v): cross-section of a stroke, v and b in [-1, 1] (paper, section 3).

Negative values carve where positive ones extrude; the profile need not be symmetric. v grows
towards n x u, the left of an artist who draws along u and sees n pointing at them.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .shape import Array, Formula, Shape


class Profile(Shape):
    """b(v), dimensionless; zero for |v| > 1."""

    WORD = "profile"
    DOMAIN = (-1.0, 1.0)
    RANGE = (-1.0, 1.0)
    FORMULAS: ClassVar[Mapping[str, Formula]] = {
        "linear": lambda v: 1 - np.abs(v),
        "cubic": lambda v: 1 - v**2 * (3 - 2 * np.abs(v)),
        "quintic": lambda v: 1 - np.abs(v) ** 3 * (10 - 15 * np.abs(v) + 6 * v**2),
    }

    def __call__(self, v: ArrayLike) -> Array:
        """b at v, an array of any shape."""
        return np.where(np.abs(v) <= 1, super().__call__(v), 0.0)

    def mirrored(self) -> "Profile":
        """The profile b(-v)."""
        points = tuple((-x, y) for x, y in reversed(self.points))
        return replace(self, points=points, table=self.table[::-1])
