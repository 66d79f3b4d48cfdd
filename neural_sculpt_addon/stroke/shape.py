# SPDX-License-Identifier: GPL-3.0-or-later
"""A function of one variable that an artist shapes: by name, control points or table.

Base of the profile and of the modulation. Control points are joined by a Catmull-Rom spline whose
slopes are limited so that the curve stays C1 and inside its range; a table is what a curve widget
shows, sampled uniformly over the domain and joined by lines.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import reading
from ..common.errors import SculptError
from ..common.text import Text

Array = NDArray[np.float64]
Formula = Callable[[Array], NDArray[Any]]

LARGEST_NUMBER = 1000.0  # far outside of every domain and range; beyond, sums overflow
MOST_NUMBERS = 4096  # in one list of control points or one table


@dataclass(frozen=True)
class Shape:
    """Exactly one of `name`, `points` ((x, y) pairs, x increasing) and `table` is given."""

    name: str = ""
    points: tuple[tuple[float, float], ...] = ()
    table: tuple[float, ...] = ()

    WORD: ClassVar[str]
    DOMAIN: ClassVar[tuple[float, float]]
    RANGE: ClassVar[tuple[float, float]]
    FORMULAS: ClassVar[Mapping[str, Formula]]

    def __post_init__(self) -> None:
        """Refuse what is no function on the domain. SculptError."""
        if sum(map(bool, (self.name, self.points, self.table))) != 1:
            raise SculptError(
                "A {} needs one of: a name, control points, a table.", Text(self.WORD)
            )
        if self.name and self.name not in self.FORMULAS:
            names = ", ".join(self.FORMULAS)
            raise SculptError(
                "There is no {} named {}; choose one of {}.",
                Text(self.WORD),
                f"{self.name!r:.100}",
                names,
            )
        if len(self.points) == 1 or len(self.table) == 1:
            raise SculptError("A {} needs at least two points.", Text(self.WORD))
        numbers = np.array([*np.ravel(self.points), *self.table], float)
        if len(numbers) > MOST_NUMBERS or not (np.abs(numbers) <= LARGEST_NUMBER).all():
            raise SculptError(
                "A {} needs numbers from -1000 to 1000, at most {} of them.",
                Text(self.WORD),
                MOST_NUMBERS,
            )
        if self.points and (np.diff([x for x, _ in self.points]) < 1e-6).any():
            raise SculptError(
                "The control points of a {} must go from left to right.", Text(self.WORD)
            )

    def __call__(self, x: ArrayLike) -> Array:
        """Values at x, an array of any shape; x outside the domain counts as its nearest end."""
        x = np.clip(np.asarray(x, float), *self.DOMAIN)
        if self.name:
            return np.asarray(self.FORMULAS[self.name](x), float)
        if self.table:
            knots = np.linspace(*self.DOMAIN, len(self.table))
            return np.clip(np.interp(x, knots, self.table), *self.RANGE)
        return _catmull_rom(x, np.array(self.points), self.RANGE)

    def to_json(self) -> dict[str, Any]:
        """Plain data for a stroke file."""
        if self.name:
            return {"name": self.name}
        return (
            {"points": [list(p) for p in self.points]} if self.points else {"table": [*self.table]}
        )

    @classmethod
    def from_json(cls, data: object) -> Self:
        """Read what `to_json` wrote. SculptError when it is something else."""
        if not isinstance(data, Mapping) or len(data) != 1:
            raise SculptError('A {} is one of {"name"}, {"points"}, {"table"}.', Text(cls.WORD))
        try:
            if "points" in data:
                pairs = reading.numbers(data["points"]).tolist()  # (K, 2)
                return cls(points=tuple((x, y) for x, y in pairs))
            if "table" in data:
                return cls(table=tuple(map(float, reading.numbers(data["table"]).tolist())))
            return cls(name=reading.text(data["name"]))
        except (KeyError, *reading.UNREADABLE) as error:
            raise SculptError(
                "A {} cannot be read ({}).", Text(cls.WORD), f"{error!s:.100}"
            ) from error


def _catmull_rom(x: Array, points: Array, bounds: tuple[float, float]) -> Array:
    """Cubic Hermite spline through points (K, 2) with Catmull-Rom slopes, held constant outside.

    A slope is limited so that the Bezier points y +- slope h / 3 of both neighbouring spans lie
    inside `bounds`; by the convex hull property the curve then does, too, and remains C1.
    """
    low, high = bounds
    px, py = points[:, 0], np.clip(points[:, 1], low, high)  # (K,)
    slopes = np.gradient(py, edge_order=1) / np.gradient(px, edge_order=1)
    span = np.diff(px)  # (K - 1,)
    after, before = np.append(span, span[-1]), np.append(span[0], span)  # (K,)
    steepest = np.minimum((high - py) / after, (py - low) / before) * 3
    lowest = np.maximum((low - py) / after, (py - high) / before) * 3
    slopes = np.clip(slopes, lowest, steepest)

    x = np.clip(x, px[0], px[-1])
    k = np.clip(np.searchsorted(px, x, "right") - 1, 0, len(px) - 2)
    t = (x - px[k]) / span[k]
    return (
        py[k] * (1 + 2 * t) * (1 - t) ** 2
        + slopes[k] * span[k] * t * (1 - t) ** 2
        + py[k + 1] * t**2 * (3 - 2 * t)
        - slopes[k + 1] * span[k] * t**2 * (1 - t)
    )
