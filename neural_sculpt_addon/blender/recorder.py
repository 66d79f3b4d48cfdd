# SPDX-License-Identifier: GPL-3.0-or-later
"""A freehand stroke while it is drawn: points in, evenly spaced control points out. No bpy here.

All points are in model space.
"""

import math
from dataclasses import dataclass, field

MOST_POINTS = 512
"""Control points of one stroke; a longer one gets a coarser spacing."""

Point = tuple[float, float, float]


@dataclass
class StrokeRecorder:
    """Keeps a point when it is `spacing` away from the last one kept, and the very last point."""

    spacing: float
    points: list[Point] = field(default_factory=list)
    pressures: list[float] = field(default_factory=list)

    def add(self, point: Point, pressure: float = 1.0) -> bool:
        """Offer a point of the surface under the pen; whether it was kept."""
        if self.points and math.dist(point, self.points[-1]) < self.spacing:
            return False
        self._keep(point, pressure)
        return True

    def finish(self, point: Point | None, pressure: float = 1.0) -> None:
        """The pen was lifted at `point`, None when that was off the surface."""
        if point is not None and (not self.points or point != self.points[-1]):
            self._keep(point, pressure)

    def _keep(self, point: Point, pressure: float) -> None:
        self.points.append(point)
        self.pressures.append(pressure)
        if len(self.points) > MOST_POINTS:
            self.spacing *= 2
            del self.points[1::2], self.pressures[1::2]
