# SPDX-License-Identifier: GPL-3.0-or-later
"""The Chamfer distance of the paper's tables 2 and 3, over all of the surface and in the tube.

    mean_a min_b |a - b| + mean_b min_a |a - b|

of 100,000 points a and b drawn on either surface. Two samplings of one surface have a distance,
too: about sqrt(area / points), the noise floor, below which nothing can be told.

The tube is the ball of one radius (of one height, where that is more) about each point of the path,
as in 3DNS: a region of space, the same for both surfaces, each of which gets its samples in it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from neural_sculpt_addon.field.problem.problem import Problem

from .surface import Array, Inside, Surface


def both_ways(a: Array, b: Array) -> float:
    """The Chamfer distance of points (N, 3) and (M, 3)."""
    return float(KDTree(a).query(b)[0].mean() + KDTree(b).query(a)[0].mean())


def tube_of(problem: Problem) -> Inside:
    """The tube about a stroke, all of its copies."""
    path = KDTree(np.concatenate([one.path.points for one in problem.placed]))
    brush = problem.stroke.brush
    reach = max(brush.radius, abs(brush.intensity)) * problem.stroke.largest_factor

    def inside(points: Array) -> np.ndarray:
        return np.isfinite(path.query(points, distance_upper_bound=reach)[0])

    return inside


@dataclass(frozen=True)
class Chamfer:
    """Of any surface from the `truth`, in `count` samples; those of the truth are drawn once."""

    truth: Surface
    tube: Inside
    count: int
    seed: int

    @cached_property
    def floor(self) -> dict[str, float]:
        """The noise floors."""
        again = self._drawn(self.truth, 1)
        return {f"{name}_floor": both_ways(self._asked[name], again[name]) for name in again}

    def of(self, surface: Surface) -> dict[str, float]:
        """The distances over the whole and in the tube."""
        found = self._drawn(surface, 2)
        return {name: both_ways(self._asked[name], found[name]) for name in found}

    @cached_property
    def _asked(self) -> dict[str, Array]:
        return self._drawn(self.truth, 0)

    def _drawn(self, surface: Surface, stream: int) -> dict[str, Array]:
        seed = 3 * self.seed + stream
        return {
            "whole": surface.sample(self.count, seed),
            "tube": surface.sample(self.count, seed, self.tube),
        }
