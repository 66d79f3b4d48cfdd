# SPDX-License-Identifier: GPL-3.0-or-later
"""The copies of a stroke on the surface, mirrored and turned: what is near to them, and where they
displace it to.

Where copies overlap, the larger displacement wins. Model space; relative distances are in radii of
the stroke.
See docs/method.md, section 2.
"""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.progress import Check, go_on
from ...stroke.curve import Array
from ...stroke.displacement import Displacement, displace
from ...stroke.path import Path, locate
from ...stroke.stroke import Direction, Ends, Stroke
from ..evaluate import normals
from ..field import Field
from ..mesh.surface import Samples
from ..projection import ARRIVED, ON_SURFACE, project
from ..threads import in_pieces
from .placement import PlacedStroke

MEASURED_RADII = 2.5
"""Radii: how far distances are told. Farther is slower; no solver or measure asks for more than
2.2."""

STEP = 1 / 1024
"""Step of the difference quotient that tells the slope of the displacement, radii. A larger one
rounds off the bends of a profile, a smaller one drowns in single precision."""

BEND = 5e-4
"""Step of the difference quotient of normals that tells the curvature, model units. A larger one
blurs detail, a smaller one drowns in single precision."""


@dataclass(frozen=True)
class Copies:
    """All copies of a stroke, the one that was drawn first.

    field: the unedited one
    guide: whose normals the surface is displaced along: `field`, or the same without detail that is
           fine for the stroke
    check: called by all methods while they work
    """

    placed: tuple[PlacedStroke, ...]
    field: Field
    guide: Field
    check: Check = go_on

    def close(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which points (N, 3) lie in the box around a path: all within MEASURED_RADII do."""
        return np.logical_or.reduce([close(one, points) for one in self.placed])

    @cached_property
    def meeting(self) -> list[list[PlacedStroke]]:
        """The other copies that come near to each copy."""
        low, high = (np.stack(side) for side in zip(*map(_box, self.placed), strict=True))  # (M, 3)
        meets = ((low[:, None] < high) & (low < high[:, None])).all(axis=2)
        np.fill_diagonal(meets, val=False)
        return [[self.placed[other] for other in np.flatnonzero(row)] for row in meets]

    def untouched(self, surface: Samples) -> NDArray[np.bool_]:
        """Which surface samples (N,) the stroke must leave where they are."""
        return self.relative_distance(surface, beyond_flat_ends=False) > 1

    def relative_distance(self, surface: Samples, beyond_flat_ends: bool = True) -> Array:
        """Distance (N,) of surface samples from the nearest copy of the stroke, in its radii.

        Infinite on the other sheet of thin parts and, more than MEASURED_RADII away, anywhere;
        without `beyond_flat_ends` also past a flat end, where a stroke does nothing.
        """

        relative_distance = np.full(len(surface.points), np.inf)
        for one in self.placed:
            some = np.flatnonzero(close(one, surface.points))
            there = surface.where(some)
            if self.guide is not self.field:
                there = there._replace(normals=normals(self.guide, there.points))
            measure = partial(_relative_distance, one, there, beyond_flat_ends)
            near = in_pieces(measure, len(some), self.check, light=True)
            relative_distance[some] = np.minimum(relative_distance[some], near)
        return relative_distance

    def uncovered(
        self, surface: Samples, tree: KDTree, spacing: float, reach: float
    ) -> NDArray[np.bool_]:
        """Which surface samples (N,) lie within `reach` radii, and farther than `spacing` from all
        points of a tree."""
        some = np.flatnonzero(self.close(surface.points))
        distance = tree.query(surface.points[some], distance_upper_bound=spacing)[0]
        some = some[~np.isfinite(distance)]
        near = self.relative_distance(surface.where(some), beyond_flat_ends=False) < reach
        uncovered = np.zeros(len(surface.points), bool)
        uncovered[some[near]] = True
        return uncovered

    def distance(self, points: NDArray[np.float32]) -> Array:
        """Distance (N,) of any points (N, 3) from the nearest path, in radii of the brush.

        Infinite more than MEASURED_RADII away.
        """
        distance = np.full(len(points), np.inf)
        for one in self.placed:
            some = np.flatnonzero(close(one, points))
            measure = partial(_distance, one, points[some])
            near = in_pieces(measure, len(some), self.check, light=True)
            distance[some] = np.minimum(distance[some], near)
        return distance

    def move(self, surface: Samples) -> tuple[Samples, Array]:
        """Displaced surface samples (N,), and by what factor (N,) their area is stretched.

        The samples have the normals of the field. Whether the displaced surface runs through itself
        is not looked at.
        """

        def part_of(part: slice) -> tuple[Samples, Array]:
            return self._move(surface.where(part))

        return in_pieces(part_of, len(surface.points), self.check)

    def _move(self, surface: Samples) -> tuple[Samples, Array]:
        points, guide = surface.points, self.guide
        upright = surface.normals if guide is self.field else normals(guide, points)
        moved = Samples(*(array.copy() for array in surface))
        largest, stretch = np.zeros((2, len(points)))
        stretch += 1
        for one in self.placed:
            some = np.flatnonzero(close(one, points))
            there = displace(*one, points[some], upright[some])
            wins = np.abs(there.amount) > largest[some]
            won = some[wins]
            goal, factor = displaced(guide, *one, surface.where(won), there.where(wins))
            moved.points[won], moved.normals[won], stretch[won] = *goal, factor
            largest[won] = np.abs(there.amount[wins])
        return moved, stretch

    def beside(
        self, surface: Samples, apart: float, jitter: np.random.Generator
    ) -> tuple[Samples, Samples]:
        """Samples of the unedited surface, each beside one of `surface` (N,), and where they are
        displaced to.

        apart: twice the farthest that they are beside it, along each axis
        """
        start, upright = surface
        away = jitter.uniform(-apart / 2, apart / 2, start.shape).astype(np.float32)
        away -= np.einsum("na,na->n", away, upright)[:, None] * upright
        found = project(self.field, start + away, tolerance=ARRIVED)
        before = Samples(found.points, found.normals).where(found.distance < ON_SURFACE)
        return before, self.move(before)[0]


def displaced(
    guide: Field, stroke: Stroke, path: Path, samples: Samples, displacement: Displacement
) -> tuple[Samples, Array]:
    """Where a stroke moves surface samples (N,), with the normals of the moved surface there, and
    by what factor (N,) it stretches the surface's area.

    The moved surface p + d w has the tangents t + (dd/dt) w + d dw/dt for tangents t of the
    surface. Their derivatives are one-sided differences, so this holds for every profile and end
    alike; `samples` have the normals of the surface, and `displacement` is by those of `guide`.
    """
    moved = samples.points + displacement.amount[:, None] * displacement.direction
    step = STEP * stroke.brush.radius
    first = np.cross(samples.normals, np.eye(3)[np.argmin(np.abs(samples.normals), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(samples.normals, first)
    axes, twice = np.concatenate([first, second]), np.tile(np.arange(len(first)), 2)
    upright, both = displacement.normals[twice], displacement.where(twice)
    places = samples.points[twice]
    bend = (normals(guide, places + BEND * axes) - upright) / BEND
    ahead = displace(stroke, path, places + step * axes, upright + step * bend, both)
    slope = (ahead.amount - both.amount) / step
    if stroke.direction is Direction.STROKE:
        bend = (ahead.direction - both.direction) / step
    tangents = axes + slope[:, None] * both.direction + both.amount[:, None] * bend
    one, other = np.split(tangents, 2)
    turned = np.cross(one, other)
    stretch = np.linalg.norm(turned, axis=1)
    turned /= np.maximum(stretch, 1e-12)[:, None]
    return Samples(moved.astype(np.float32), turned.astype(np.float32)), stretch


def close(one: PlacedStroke, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which points (N, 3) lie in the box around the path of one copy."""
    low, high = _box(one)
    return ((points > low) & (points < high)).all(axis=1)


def _box(one: PlacedStroke) -> tuple[Array, Array]:
    """Least and greatest coordinates (3,) of what lies within MEASURED_RADII of a path."""
    margin = MEASURED_RADII * one.stroke.largest_radius
    return one.path.box(margin)


def _relative_distance(
    one: PlacedStroke, surface: Samples, beyond_flat_ends: bool, part: slice
) -> Array:
    stroke, path = one
    there = displace(stroke, path, *surface.where(part))
    if beyond_flat_ends or stroke.ends is Ends.ROUND or len(path.points) == 1:
        return there.relative_distance
    return np.where(there.beyond, np.inf, there.relative_distance)


def _distance(one: PlacedStroke, points: NDArray[np.float32], part: slice) -> Array:
    return locate(one.path, points[part]).distance / one.stroke.brush.radius
