# SPDX-License-Identifier: GPL-3.0-or-later
"""The modulation m(u): strength along a stroke, u in [0, 1] by arc length (paper, section 3).

The formulas are those of the paper's figures; the sinusoidal one reaches 2.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from .shape import Formula, Shape


class Modulation(Shape):
    """m(u), dimensionless."""

    WORD = "modulation"
    DOMAIN = (0.0, 1.0)
    RANGE = (-2.0, 2.0)
    FORMULAS: ClassVar[Mapping[str, Formula]] = {
        "identity": lambda u: 1 + 0 * u,
        "linear": lambda u: 1 - u,
        "exponential": lambda u: np.exp(-6 * u),
        "central": lambda u: np.exp(-6 * (u - 0.5) ** 2),
        "inverse_central": lambda u: 1 - np.exp(-6 * (u - 0.5) ** 2),
        "sinusoidal": lambda u: 1 + np.sin(10 * (u - 0.5)),
    }
