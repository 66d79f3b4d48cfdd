# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit asks of the field: where the zero set shall be after the stroke.

The tube moves to its targets, the untouched surface stays where it is. The images of a stroke,
mirrored and turned, are solved together; where they overlap, the larger displacement wins, and
where the displaced surface would run through itself, what bounds the shape counts (see `fold`).
Model space. See docs/method.md, section 2.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.errors import SculptError
from ...common.progress import Check, go_on
from ...stroke.brush import LEAST_RADIUS
from ...stroke.curve import Array
from ...stroke.displacement import displace
from ...stroke.path import Path, locate
from ...stroke.stroke import Ends, Stroke
from ..evaluate import normals, values_and_gradients
from ..field import Field
from ..mesh.surface import Samples
from ..nearest import search_tree
from ..threads import in_pieces, join
from .fold import SweptVolume, crossings
from .folded import Folded
from .lay import lay
from .prepare import Preparation
from .tube import COLUMNS, ROWS, Tube, displaced, sample_rim, sample_tube

FARTHEST = 2.5  # radii, of what nearness tells apart
GUIDED = 0.5  # radii: cells of the finest detail whose normals guide a stroke that folds
GUIDING = ROWS // 4, COLUMNS // 4  # of the tube that tells whether it does
THINNED = 2  # every so many samples of a tube are looked at for folds, which are larger than two
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


class DisplacedSurface(NamedTuple):
    """Samples (N,) of all of the surface under a stroke: its tubes and what these lack.

    before, after: where they are, and where they are displaced to
    f, gradient:   (N,), (N, 3) of the unedited field at the latter
    swept:         see `DisplacedTubes`
    """

    before: Samples
    after: Samples
    f: NDArray[np.float32]
    gradient: NDArray[np.float32]
    swept: SweptVolume | None


class _Sampled(NamedTuple):
    """What `DisplacedSurface` says of the tubes alone, and how their samples are found.

    tree: of every other sample before it is displaced, of those that were dropped, too
    """

    tubes: list[Tube]
    before: Samples
    after: Samples
    f: NDArray[np.float32]
    gradient: NDArray[np.float32]
    swept: SweptVolume | None
    tree: KDTree


@dataclass(frozen=True)
class Problem:
    """An edit to be solved.

    preparation: of the unedited field
    laid:        the stroke and its images
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

    @property
    def _radius(self) -> float:
        """The largest one of the stroke."""
        return self.stroke.brush.radius * self.stroke.largest_factor

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
        sampled = self._sample(rows, columns, jitter)
        return DisplacedTubes(sampled.tubes, sampled.swept)

    def displaced_surface(
        self, rows: int, columns: int, jitter: np.random.Generator, gap: float, gap_at_folds: float
    ) -> DisplacedSurface:
        """The same, and `gaps`: how far from all samples of the tubes these begin, elsewhere and
        where the displaced surface runs through itself."""
        _, before, after, f, gradient, swept, tree = self._sample(rows, columns, jitter)
        gaps = self.gaps(tree, gap) if swept is None else self._gaps_at_folds(after, gap_at_folds)
        more = values_and_gradients(self.field, gaps[1].points)
        return DisplacedSurface(*join([(before, after, f, gradient), (*gaps, *more)]), swept)

    def _sample(self, rows: int, columns: int, jitter: np.random.Generator | None) -> _Sampled:
        tubes, swept = self._whole_tubes(rows, columns, jitter), None
        before, after = join([(tube.surface, tube.target) for tube in tubes])

        def sample(part: slice) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            return values_and_gradients(self.field, after.points[part])

        f, gradient = in_pieces(sample, len(after.points), self.check)
        some = slice(None, None, THINNED)
        tree = search_tree(before.points[some])
        thin = before.where(some), after.where(some), self.check, tree, f[some]
        if crossings(self.field, *thin).any():
            swept = self.folded.swept
            kept = [self._bounding(tube) for tube in tubes]
            tubes = [tube.where(chosen) for tube, chosen in zip(tubes, kept, strict=True)]
            bounding = np.concatenate(kept)
            before, after = before.where(bounding), after.where(bounding)
            f, gradient = f[bounding], gradient[bounding]
        if not len(before.points):
            raise SculptError(
                "The stroke leaves nothing of the surface under it: a mask keeps all of it, its"
                " radius is too small, or its intensity so large that the surface runs through"
                " itself. Change one of them."
            )
        return _Sampled(tubes, before, after, f, gradient, swept, tree)

    def _bounding(self, tube: Tube) -> NDArray[np.bool_]:
        """Which samples of a tube bound the result, without single ones, which bound nothing."""
        kept = self.folded.bounding(tube.surface, tube.target)
        kept[kept] = tube.where(kept).in_cells()
        return kept

    def _whole_tubes(
        self, rows: int, columns: int, jitter: np.random.Generator | None = None
    ) -> list[Tube]:
        tubes = []
        for mine, others in zip(self.laid, self._meeting, strict=True):
            tube = sample_tube(self.field, *mine, rows, columns, jitter, self.check, self.guide)
            amount = np.abs(tube.displacement.amount)
            wins = np.ones(len(amount), bool)
            for other in others:
                self.check()
                close = _close(other, tube.surface.points)
                there = tube.surface.points[close], tube.displacement.normals[close]
                theirs = displace(*other, *there).amount
                wins[close] &= np.abs(theirs) <= amount[close]
            tubes.append(tube.where(wins) if others else tube)
        return tubes

    @cached_property
    def _meeting(self) -> list[list[Laid]]:
        """Of each copy the other ones that come near to it."""
        low, high = (np.stack(side) for side in zip(*map(_box, self.laid), strict=True))  # (M, 3)
        meets = ((low[:, None] < high) & (low < high[:, None])).all(axis=2)
        np.fill_diagonal(meets, val=False)
        return [[self.laid[other] for other in np.flatnonzero(row)] for row in meets]

    @cached_property
    def folded(self) -> Folded:
        """What is asked for where the displaced surface runs through itself."""
        proxy = self.preparation.proxy
        near = self.nearness(Samples(proxy.vertices, proxy.normals), beyond_flat_ends=False) < 1
        touched = near[proxy.triangles].any(axis=1)
        return Folded(
            self.field,
            proxy,
            touched,
            lambda surface: self.move(surface)[0],
            self.stroke.brush.radius * self.stroke.largest_factor,
            self.check,
        )

    def displaced(self, surface: Samples) -> tuple[Samples, Array]:
        """Where surface samples (N,) shall be, and by what factor (N,) their area is stretched.

        It shrinks to nothing where the displaced surface runs through itself and bounds nothing.
        The samples' normals are those of the field: samples of the surface that was asked for may
        lie beside what the field made of it.
        """
        surface = Samples(surface.points, normals(self.field, surface.points))
        moved, stretch = self.move(surface)
        if crossings(self.field, surface, moved, self.check).any():
            stretch[~self.folded.bounding(surface, moved)] = 0
        return moved, stretch

    def move(self, surface: Samples) -> tuple[Samples, Array]:
        """What `displaced` says of surface samples (N,) that have the normals of the field, without
        a look at where it runs through itself."""

        guide = self.guide  # whose making is shared by threads, as this is

        def part_of(part: slice) -> tuple[Samples, Array]:
            return self._move(surface.where(part), guide)

        return in_pieces(part_of, len(surface.points), self.check)

    def _move(self, surface: Samples, guide: Field) -> tuple[Samples, Array]:
        points = surface.points
        upright = surface.normals if guide is self.field else normals(guide, points)
        moved = Samples(*(array.copy() for array in surface))
        largest, stretch = np.zeros((2, len(points)))
        stretch += 1
        for one in self.laid:
            close = np.flatnonzero(_close(one, points))
            there = displace(*one, points[close], upright[close])
            wins = np.abs(there.amount) > largest[close]
            won = close[wins]
            goal, factor = displaced(guide, *one, surface.where(won), there.where(wins))
            moved.points[won], moved.normals[won], stretch[won] = *goal, factor
            largest[won] = np.abs(there.amount[wins])
        return moved, stretch

    @cached_property
    def guide(self) -> Field:
        """Whose normals the surface is displaced along: the field's, or, where the displaced
        surface would run through itself then, those without detail that is fine for the stroke.

        Normals that turn within less than the way to go fan out, and cross each other.
        """
        field = self.field
        if self.coarse.detail.levels == field.detail.levels:
            return field
        tubes = [sample_tube(field, *one, *GUIDING, check=self.check) for one in self.laid]
        if not crossings(field, *join([(t.surface, t.target) for t in tubes]), self.check).any():
            return field
        return self.coarse

    @cached_property
    def coarse(self) -> Field:
        """The field without detail that is fine for the stroke."""
        detail = self.field.detail.up_to(round(-math.log2(GUIDED * self._radius)))
        return replace(self.field, detail=detail)

    def gaps(self, tree: KDTree, spacing: float) -> tuple[Samples, Samples]:
        """Samples of the unedited surface under the stroke of which the tube's samples, those of
        `tree`, are farther than `spacing`, and where they are displaced to.

        A tube is projected from tangent planes, and so has gaps where the surface is steep to
        them: around legs and ears. The samples are vertices of the proxy.
        """
        proxy = self.preparation.proxy
        vertices = Samples(proxy.vertices, proxy.normals)
        vertices = vertices.where(
            np.logical_or.reduce([_close(m, vertices.points) for m in self.laid])
        )
        distance = tree.query(vertices.points, distance_upper_bound=spacing)[0]
        vertices = vertices.where(~np.isfinite(distance))
        vertices = vertices.where(self.nearness(vertices, beyond_flat_ends=False) < INNER)
        upright = Samples(vertices.points, normals(self.field, vertices.points))
        return vertices, self.move(upright)[0]

    def _gaps_at_folds(self, target: Samples, spacing: float) -> tuple[Samples, Samples]:
        """The same where the displaced surface runs through itself, by the displaced samples
        `target` of the tube: without those that bound nothing."""
        surface, moved, bounds, _ = self.folded.under
        tree = search_tree(target.points)
        far = ~np.isfinite(tree.query(moved.points, distance_upper_bound=spacing)[0])
        far &= bounds
        surface, moved = surface.where(far), moved.where(far)
        inner = self.nearness(surface, beyond_flat_ends=False) < INNER
        return surface.where(inner), moved.where(inner)

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
            some = surface.where(close)
            if self.guide is not self.field:
                some = some._replace(normals=normals(self.guide, some.points))
            measure = partial(_nearness, one, some, beyond_flat_ends)
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
    """Which points (N, 3) lie in the box around a path: all within `FARTHEST` radii do."""
    low, high = _box(one)
    return ((points > low) & (points < high)).all(axis=1)


def _box(one: Laid) -> tuple[Array, Array]:
    """Least and greatest coordinates (3,) of what lies within `FARTHEST` radii of a path."""
    margin = FARTHEST * one.stroke.brush.radius * one.stroke.largest_factor
    return one.path.points.min(axis=0) - margin, one.path.points.max(axis=0) + margin
