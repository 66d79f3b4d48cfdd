# SPDX-License-Identifier: GPL-3.0-or-later
"""The copies of a stroke on the surface, mirrored and turned, and what lies near to them.

Model space. Nearness is in radii of the stroke. See docs/method.md, section 2.
"""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Check, go_on
from ...stroke.curve import Array
from ...stroke.displacement import displace
from ...stroke.path import locate
from ...stroke.stroke import Ends
from ..evaluate import normals
from ..field import Field
from ..mesh.surface import Samples
from ..threads import in_pieces
from .lay import Laid

FARTHEST = 2.5
"""Radii: how far nearness and distance are told. Farther is slower; no solver or measure asks for
more than 2.2."""


@dataclass(frozen=True)
class Copies:
    """All copies of a stroke, the one that was drawn first.

    field: the unedited one
    guide: whose normals the surface is displaced along: `field`, or the same without detail that is
           fine for the stroke
    check: called by all methods while they work
    """

    laid: tuple[Laid, ...]
    field: Field
    guide: Field
    check: Check = go_on

    def close(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which points (N, 3) lie in the box around a path: all within FARTHEST radii do."""
        return np.logical_or.reduce([close(one, points) for one in self.laid])

    @cached_property
    def meeting(self) -> list[list[Laid]]:
        """Of each copy the other ones that come near to it."""
        low, high = (np.stack(side) for side in zip(*map(_box, self.laid), strict=True))  # (M, 3)
        meets = ((low[:, None] < high) & (low < high[:, None])).all(axis=2)
        np.fill_diagonal(meets, val=False)
        return [[self.laid[other] for other in np.flatnonzero(row)] for row in meets]

    def untouched(self, surface: Samples) -> NDArray[np.bool_]:
        """Which surface samples (N,) the stroke must leave where they are."""
        return self.nearness(surface, beyond_flat_ends=False) > 1

    def nearness(self, surface: Samples, beyond_flat_ends: bool = True) -> Array:
        """Distance (N,) of surface samples from the nearest copy of the stroke, in its radii.

        Infinite on the other sheet of thin parts and, more than FARTHEST radii away, anywhere;
        without `beyond_flat_ends` also past a flat end, where a stroke does nothing.
        """

        nearness = np.full(len(surface.points), np.inf)
        for one in self.laid:
            some = np.flatnonzero(close(one, surface.points))
            there = surface.where(some)
            if self.guide is not self.field:
                there = there._replace(normals=normals(self.guide, there.points))
            measure = partial(_nearness, one, there, beyond_flat_ends)
            near = in_pieces(measure, len(some), self.check, light=True)
            nearness[some] = np.minimum(nearness[some], near)
        return nearness

    def distance(self, points: NDArray[np.float32]) -> Array:
        """Distance (N,) of any points (N, 3) from the nearest path, in radii of the brush.

        Infinite more than FARTHEST radii away.
        """
        distance = np.full(len(points), np.inf)
        for one in self.laid:
            some = np.flatnonzero(close(one, points))
            measure = partial(_distance, one, points[some])
            near = in_pieces(measure, len(some), self.check, light=True)
            distance[some] = np.minimum(distance[some], near)
        return distance


def close(one: Laid, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which points (N, 3) lie in the box around the path of one copy."""
    low, high = _box(one)
    return ((points > low) & (points < high)).all(axis=1)


def _box(one: Laid) -> tuple[Array, Array]:
    """Least and greatest coordinates (3,) of what lies within FARTHEST radii of a path."""
    margin = FARTHEST * one.stroke.brush.radius * one.stroke.largest_factor
    return one.path.points.min(axis=0) - margin, one.path.points.max(axis=0) + margin


def _nearness(one: Laid, surface: Samples, beyond_flat_ends: bool, part: slice) -> Array:
    stroke, path = one
    there = displace(stroke, path, *surface.where(part))
    if beyond_flat_ends or stroke.ends is Ends.ROUND or len(path.points) == 1:
        return there.nearness
    return np.where(there.beyond, np.inf, there.nearness)


def _distance(one: Laid, points: NDArray[np.float32], part: slice) -> Array:
    return locate(one.path, points[part]).distance / one.stroke.brush.radius
