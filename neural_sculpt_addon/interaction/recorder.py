# SPDX-License-Identifier: GPL-3.0-or-later
"""A freehand stroke while it is drawn: points in, evenly spaced control points out. No bpy here.

Points are in model space, the mouse is in pixels of the window.
"""

import math
from dataclasses import dataclass, field

import numpy as np

MOST_RECORDED = 512
"""Control points of one stroke; a longer one gets a coarser spacing."""
PRESSURE_OFF = 0.1
"""How far the pressure may be off where simplifying leaves a point out."""

Point = tuple[float, float, float]
Mouse = tuple[float, float]


@dataclass
class Stabilizer:
    """A pen on a rope: it stands still until the rope is tight, then the mouse drags it along.

    length: of the rope, in pixels; with none the pen is where the mouse is
    """

    length: float
    pen: Mouse

    def pull(self, mouse: Mouse) -> Mouse:
        """The mouse moved; where the pen is now."""
        distance = math.dist(mouse, self.pen)
        if distance > self.length:
            part = 1 - self.length / distance
            x, y = self.pen
            self.pen = x + part * (mouse[0] - x), y + part * (mouse[1] - y)
        return self.pen


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
        self.keep(point, pressure)
        return True

    def finish(self, point: Point | None) -> None:
        """The pen was lifted at `point`, None when that was off the surface.

        A pen that is lifted presses no more: the pressure is the last one it had.
        """
        if point is None or (self.points and point == self.points[-1]):
            return
        pressure = self.pressures[-1] if self.pressures else 1.0
        if len(self.points) > 1 and math.dist(point, self.points[-1]) < self.spacing / 2:
            self.remove(-1)
        self.keep(point, pressure)

    def keep(self, point: Point, pressure: float = 1.0) -> None:
        """Append a point, however near it is."""
        self.points.append(point)
        self.pressures.append(pressure)
        if len(self.points) > MOST_RECORDED:
            self.spacing *= 2
            del self.points[1::2], self.pressures[1::2]

    def remove(self, index: int) -> None:
        """Drop a point."""
        del self.points[index], self.pressures[index]

    def simplify(self, tolerance: float) -> None:
        """Keep only the points that hold the line within `tolerance`, and the pressure within
        PRESSURE_OFF (Douglas and Peucker)."""
        pressures = tolerance / PRESSURE_OFF * np.array(self.pressures)  # (K,)
        points = np.column_stack([self.points, pressures])  # (K, 4)
        kept, spans = {0, len(points) - 1}, [(0, len(points) - 1)]
        while spans:
            first, last = spans.pop()
            if last - first < 2:
                continue
            chord = points[last] - points[first]
            offset = points[first + 1 : last] - points[first]  # (N, 3)
            along = np.clip(offset @ chord / max(chord @ chord, 1e-30), 0, 1)  # (N,)
            distance = np.linalg.norm(offset - along[:, None] * chord, axis=1)  # (N,)
            if distance.max() > tolerance:
                middle = first + 1 + int(distance.argmax())
                kept.add(middle)
                spans += [(first, middle), (middle, last)]
        self.points = [self.points[index] for index in sorted(kept)]
        self.pressures = [self.pressures[index] for index in sorted(kept)]
