# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit asks of the field: where the zero set shall be after the stroke.

The tube moves to its targets, the untouched surface stays where it is. Mirror images of a stroke
are solved together; where they overlap, the larger displacement wins, and where the displaced
surface would run through itself, what bounds the shape counts (see `fold`). Model space.
See docs/method.md, section 2.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..stroke.brush import LEAST_RADIUS
from ..stroke.curve import Array
from ..stroke.displacement import displace
from ..stroke.errors import SculptError
from ..stroke.path import Path, locate
from ..stroke.progress import Check, go_on
from ..stroke.stroke import Ends, Stroke
from .evaluate import values_and_gradients
from .field import Field
from .fold import SweptVolume, crossings, lost
from .lay import lay
from .nearest import search_tree
from .prepare import Preparation
from .surface import Samples
from .threads import in_pieces, join
from .tube import COLUMNS, ROWS, Tube, displaced, sample_rim, sample_tube

FARTHEST = 2.5  # radii, of what nearness tells apart
INNER = 0.95  # radii, within which a tube without gaps has samples


class Laid(NamedTuple):
    """One copy of a stroke and its path on the surface."""

    stroke: Stroke
    path: Path


class DisplacedTubes(NamedTuple):
    """The tube of each copy of a stroke, and what tells inside from outside of the result.

    swept: the volume between tubes and targets; None where the displaced surface does not run
           through itself, so that the planes of its samples tell
    """

    tubes: list[Tube]
    swept: SweptVolume | None

    def joined(self, name: str) -> Samples:
        """Samples of all tubes: their `surface`, or their `target`."""
        return join([getattr(tube, name) for tube in self.tubes])


@dataclass(frozen=True)
class Problem:
    """An edit to be solved.

    preparation: of the unedited field
    laid:        the stroke and its mirror images
    seed:        of all random numbers that the solver draws
    check:       called by all methods while they work
    """

    preparation: Preparation
    laid: tuple[Laid, ...]
    seed: int
    check: Check = go_on

    @property
    def field(self) -> Field:
        """The unedited field."""
        return self.preparation.field

    @property
    def stroke(self) -> Stroke:
        """The stroke as it was drawn, the first of its copies."""
        return self.laid[0].stroke

    def tubes(
        self, rows: int = ROWS, columns: int = COLUMNS, jitter: np.random.Generator | None = None
    ) -> list[Tube]:
        """The tube of each copy, as of `displaced_tubes`."""
        return self.displaced_tubes(rows, columns, jitter).tubes

    def displaced_tubes(
        self, rows: int, columns: int, jitter: np.random.Generator | None = None
    ) -> "DisplacedTubes":
        """The tube of each copy, without what another copy displaces farther, and without what
        bounds nothing where the displaced surface runs through itself.

        SculptError when nothing is left.
        """
        tubes = self._whole_tubes(rows, columns, jitter)
        lost, swept = self._lost(tubes)
        tubes = [tube.where(~gone) for tube, gone in zip(tubes, lost, strict=True)]
        if not any(len(tube.surface.points) for tube in tubes):
            raise SculptError(
                "The stroke leaves nothing of the surface under it: its radius is too small, or its"
                " intensity so large that the surface runs through itself. Change one of them."
            )
        return DisplacedTubes(tubes, swept)

    def _whole_tubes(
        self, rows: int, columns: int, jitter: np.random.Generator | None = None
    ) -> list[Tube]:
        tubes = []
        for mine in self.laid:
            tube = sample_tube(self.field, *mine, rows, columns, jitter, self.check)
            amount = np.abs(tube.displacement.amount)
            wins = np.ones(len(amount), bool)
            for other in self.laid:
                if other is not mine:
                    self.check()
                    close = _close(other, tube.surface.points)
                    theirs = displace(*other, *tube.surface.where(close)).amount
                    wins[close] &= np.abs(theirs) <= amount[close]
            tubes.append(tube.where(wins))
        return tubes

    def _lost(self, tubes: list[Tube]) -> tuple[list[NDArray[np.bool_]], SweptVolume | None]:
        """Which targets of each of the tubes bound nothing of the displaced shape, and the volume
        that tells, where the displaced surface runs through itself at all."""
        before, after = join([(tube.surface, tube.target) for tube in tubes])
        if not crossings(self.field, before, after, self.check).any():
            return [np.zeros(len(tube.surface.points), bool) for tube in tubes], None
        swept = SweptVolume(tubes, self.check)
        return [lost(self.field, swept, tube, self.check) for tube in tubes], swept

    def displaced(self, surface: Samples) -> tuple[Samples, Array]:
        """Where surface samples (N,) shall be, and by what factor (N,) their area is stretched.

        It shrinks to nothing where the displaced surface runs through itself and bounds nothing.
        The samples' normals are those of the field: samples of the surface that was asked for may
        lie beside what the field made of it.
        """

        def move(part: slice) -> tuple[Samples, Samples, Array]:
            return self._displaced(surface.where(part))

        surface, moved, stretch = in_pieces(move, len(surface.points), self.check)
        if crossings(self.field, surface, moved, self.check).any():
            tree, gone = self._known_lost
            under = np.flatnonzero((moved.points != surface.points).any(axis=1))
            stretch[under[gone[tree.query(surface.points[under])[1]]]] = 0
        return moved, stretch

    @cached_property
    def _known_lost(self) -> tuple[KDTree, NDArray[np.bool_]]:
        """Where the surface is displaced, and what of it is lost."""
        tubes = self._whole_tubes(ROWS // 2, COLUMNS // 2)
        return search_tree(join([tube.surface.points for tube in tubes])), join(
            self._lost(tubes)[0]
        )

    def _displaced(self, surface: Samples) -> tuple[Samples, Samples, Array]:
        """Surface samples with the field's normals, where they shall be, and their stretch."""
        moved = Samples(*(array.copy() for array in surface))
        _, gradient = values_and_gradients(self.field, surface.points)
        normals = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
        surface = Samples(surface.points, normals)
        largest, stretch = np.zeros((2, len(moved.points)))
        stretch += 1
        for one in self.laid:
            close = np.flatnonzero(_close(one, surface.points))
            there = displace(*one, *surface.where(close))
            wins = np.abs(there.amount) > largest[close]
            won = close[wins]
            goal, factor = displaced(self.field, *one, surface.where(won), there.where(wins))
            moved.points[won], moved.normals[won], stretch[won] = *goal, factor
            largest[won] = np.abs(there.amount[wins])
        return surface, moved, stretch

    def gaps(self, surface: Samples, spacing: float) -> tuple[Samples, Samples]:
        """Samples of the unedited surface under the stroke of which the tube's samples `surface`
        are farther than `spacing`, and where they are displaced to.

        A tube is projected from tangent planes, and so has gaps where the surface is steep to
        them: around legs and ears. The samples are vertices of the proxy. There are none where the
        displaced surface runs through itself.
        """
        proxy = self.preparation.proxy
        vertices = Samples(proxy.vertices, proxy.normals)
        vertices = vertices.where(
            np.logical_or.reduce([_close(m, vertices.points) for m in self.laid])
        )
        distance = search_tree(surface.points).query(vertices.points, distance_upper_bound=spacing)[
            0
        ]
        vertices = vertices.where(~np.isfinite(distance))
        vertices = vertices.where(self.nearness(vertices, beyond_flat_ends=False) < INNER)
        return vertices, self.displaced(vertices)[0]

    def rim(self, reach: float, count: int, jitter: np.random.Generator) -> Samples:
        """About `count` samples of the untouched surface within `reach` radii of each copy."""
        rim = join(
            [sample_rim(self.field, *one, reach, count, jitter, self.check) for one in self.laid]
        )
        return rim.where(self.untouched(rim))

    def untouched(self, surface: Samples) -> NDArray[np.bool_]:
        """Which surface samples (N,) the stroke must leave where they are."""
        return self.nearness(surface, beyond_flat_ends=False) > 1

    @cached_property
    def known_nearness(self) -> Array:
        """`nearness` of the samples that the preparation has of the surface."""
        return self.nearness(self.preparation.surface)

    @cached_property
    def known_untouched(self) -> NDArray[np.bool_]:
        """Which of those samples the stroke must leave where they are."""
        if any(stroke.ends is Ends.FLAT for stroke, _ in self.laid):
            return self.untouched(self.preparation.surface)
        return self.known_nearness > 1

    def nearness(self, surface: Samples, beyond_flat_ends: bool = True) -> Array:
        """Distance (N,) of surface samples from the nearest copy of the stroke, in its radii.

        Infinite on the other sheet of thin parts and, more than `FARTHEST` radii away, anywhere;
        without `beyond_flat_ends` also past a flat end, where a stroke does nothing.
        """

        nearness = np.full(len(surface.points), np.inf)
        for one in self.laid:
            close = np.flatnonzero(_close(one, surface.points))
            measure = partial(_nearness, one, surface.where(close), beyond_flat_ends)
            near = in_pieces(measure, len(close), self.check, light=True)
            nearness[close] = np.minimum(nearness[close], near)
        return nearness

    def distance(self, points: NDArray[np.float32]) -> Array:
        """Distance (N,) of any points (N, 3) from the nearest path, in radii of the brush.

        Infinite more than `FARTHEST` radii away.
        """
        distance = np.full(len(points), np.inf)
        for one in self.laid:
            close = np.flatnonzero(_close(one, points))
            measure = partial(_distance, one, points[close])
            near = in_pieces(measure, len(close), self.check, light=True)
            distance[close] = np.minimum(distance[close], near)
        return distance


def pose(preparation: Preparation, stroke: Stroke, check: Check = go_on) -> Problem:
    """The problem that `stroke` poses.

    check: called between pieces of all the work on it, some ten ms each; may raise

    SculptError when it does not lie on the surface or has no width.
    """
    if not stroke.largest_factor:
        raise SculptError("The stroke has no width: its pressure is zero. Draw it again.")
    if (radius := stroke.brush.radius * stroke.largest_factor) < LEAST_RADIUS:
        raise SculptError(
            f"With its pressure the stroke has a radius of {radius:.2g}; the least is 0.001. Use a"
            " larger radius, or press harder."
        )
    laid = []
    for copy in stroke.copies():
        check()
        laid.append(Laid(copy, lay(preparation.field, copy)))
    return Problem(preparation, tuple(laid), stroke.seed, check)


def _nearness(one: Laid, surface: Samples, beyond_flat_ends: bool, part: slice) -> Array:
    stroke, path = one
    there = displace(stroke, path, *surface.where(part))
    if beyond_flat_ends or stroke.ends is Ends.ROUND or len(path.points) == 1:
        return there.nearness
    return np.where(there.beyond, np.inf, there.nearness)


def _distance(one: Laid, points: NDArray[np.float32], part: slice) -> Array:
    return locate(one.path, points[part]).distance / one.stroke.brush.radius


def _close(one: Laid, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which points (N, 3) lie in a box around a path: all within `FARTHEST` radii do."""
    margin = FARTHEST * one.stroke.brush.radius * one.stroke.largest_factor
    low, high = one.path.points.min(axis=0) - margin, one.path.points.max(axis=0) + margin
    return ((points > low) & (points < high)).all(axis=1)
