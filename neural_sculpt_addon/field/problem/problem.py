# SPDX-License-Identifier: GPL-3.0-or-later
"""The problem that a stroke poses: where the zero set of the field shall be after it.

The tube moves to its targets, the untouched surface stays where it is. The images of a stroke,
mirrored and turned, are solved together; where they overlap, the larger displacement wins, and
where the displaced surface would run through itself, what bounds the shape counts (see `fold`).
Model space. See docs/method.md, section 2.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.errors import SculptError
from ...common.progress import Check, go_on
from ...stroke.curve import Array
from ...stroke.displacement import displace
from ...stroke.stroke import Ends, Stroke
from ..evaluate import normals, values_and_gradients
from ..field import Field
from ..geometry import search_tree
from ..levels import spacing
from ..mesh.local_extraction import extract_near
from ..mesh.surface import Samples, SurfaceMesh
from ..threads import in_pieces, join
from .cliffs import has_cliffs
from .copies import Copies, close
from .fold import SweptVolume, crossings
from .folded import Folded
from .placement import PlacedStroke
from .prepare import Preparation
from .tube import COLUMNS, ROWS, Tube, sample_rim, sample_tube

GUIDED = 1.0
"""Radii: cells of the finest detail whose normals guide a stroke that folds. Larger ones lose the
shape under the stroke, smaller ones keep what fans out."""

STEEP = 0.7
"""Cosine, 45 degrees: where fine detail leans more it is relief, in the walls of which tubes have
holes. Creases and folds of fitted meshes hardly lean."""

MOST_STRETCH = 3  # times as many samples at most where the surface is stretched: 70 degree walls
THINNED = 2  # every so many samples of a tube are looked at for folds, which are larger than two
TIMES_AS_FINE = 1, 2, 4  # times as fine as the proxy can the mesh under a stroke that folds be
MOST_UNDER = 40_000  # of that mesh, about
INNER = 0.95  # radii, within which a tube without gaps has samples


def coarse_level(stroke: Stroke) -> int:
    """The finest level of detail that is not fine for the stroke."""
    return round(-math.log2(GUIDED * stroke.largest_radius))


def coarse(field: Field, stroke: Stroke) -> Field:
    """The field without detail that is fine for the stroke."""
    return replace(field, detail=field.detail.up_to(coarse_level(stroke)))


class DisplacedTubes(NamedTuple):
    """The tube of each copy of a stroke, and what tells inside from outside of the result.

    swept: the volume between tubes and targets; None where the displaced surface has no cliffs and
           does not run through itself, so that the planes of its samples tell
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

    stretch: (N,), by what factor the area is stretched there
    tree:    of every other sample before it is displaced, of those that were dropped, too
    """

    tubes: list[Tube]
    before: Samples
    after: Samples
    stretch: Array
    f: NDArray[np.float32]
    gradient: NDArray[np.float32]
    swept: SweptVolume | None
    tree: KDTree


@dataclass(frozen=True)
class Problem:
    """An edit to be solved.

    preparation: of the unedited field
    placed:        the stroke and its images
    guide:       whose normals the surface is displaced along, see `Copies`
    seed:        of all random numbers that the solver draws
    check:       called by all methods while they work
    """

    preparation: Preparation
    placed: tuple[PlacedStroke, ...]
    guide: Field
    seed: int
    check: Check = go_on

    @property
    def field(self) -> Field:
        """The unedited field."""
        return self.preparation.field

    @property
    def stroke(self) -> Stroke:
        """The stroke as it was drawn, the first of its copies."""
        return self.placed[0].stroke

    @property
    def is_guided(self) -> bool:
        """Whether the stroke would fold over detail that is fine for it: see `pose`."""
        return self.guide is not self.field

    @cached_property
    def copies(self) -> Copies:
        """The stroke and its images, and what lies near to them."""
        return Copies(self.placed, self.field, self.guide, self.check)

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
        self,
        rows: int,
        columns: int,
        jitter: np.random.Generator,
        apart: float,
        gap: float,
        fine_gap: float,
    ) -> DisplacedSurface:
        """Samples of all tubes, more of them where the surface is stretched, and those of `gaps`.

        apart:    how far from each other the tubes' samples are, before they are displaced
        gap:      how far from all of them gaps begin
        fine_gap: the same over relief, and where the displaced surface runs through itself
        """
        sampled = self._sample(rows, columns, jitter)
        _, before, after, stretch, f, gradient, swept, tree = sampled
        more = np.minimum(stretch, MOST_STRETCH) - 1 + jitter.uniform(size=len(stretch))
        stretched = np.repeat(np.arange(len(more)), np.maximum(more, 0).astype(int))
        folds = swept is not None
        beside = self.beside if folds else self.copies.beside
        parts = [beside(before.where(stretched), apart, jitter)]
        if folds:
            surface, moved, bounds, _ = self.folded.under
            under = surface.where(bounds), moved.where(bounds)
            parts.append(self._fine_gaps(*under, after, fine_gap))
            parts.append(self.folded.walls(apart, jitter))
        elif self.is_over_relief:
            parts.append(self._fine_gaps(*self.folded.whole[:2], after, fine_gap))
        else:
            parts.append(self.gaps(tree, gap))
        added = join(parts)
        values = values_and_gradients(self.field, added[1].points)
        return DisplacedSurface(*join([(before, after, f, gradient), (*added, *values)]), swept)

    def beside(
        self, surface: Samples, apart: float, jitter: np.random.Generator
    ) -> tuple[Samples, Samples]:
        """Samples as of `Copies.beside`, without those that bound nothing where the displaced
        surface runs through itself."""
        before, after = self.copies.beside(surface, apart, jitter)
        bounding = self.folded.bounding(before, after)
        return before.where(bounding), after.where(bounding)

    def _sample(self, rows: int, columns: int, jitter: np.random.Generator | None) -> _Sampled:
        tubes, swept = self._whole_tubes(rows, columns, jitter), None
        before, after, stretch = join([(tube.surface, tube.target, tube.stretch) for tube in tubes])

        def sample(part: slice) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            return values_and_gradients(self.field, after.points[part])

        f, gradient = in_pieces(sample, len(after.points), self.check)
        some = slice(None, None, THINNED)
        tree = search_tree(before.points[some])
        if self.is_over_relief:  # in whose steep walls tubes have gaps
            folds = self.folded.folds_over_relief
        else:
            thin = before.where(some), after.where(some), self.check, tree, f[some]
            folds = self.has_cliffs or crossings(self.field, *thin).any()
        if folds:
            swept = self.folded.swept
            kept = self._bounding(tubes)
            tubes = [tube.where(chosen) for tube, chosen in zip(tubes, kept, strict=True)]
            bounding = np.concatenate(kept)
            before, after = before.where(bounding), after.where(bounding)
            stretch, f, gradient = stretch[bounding], f[bounding], gradient[bounding]
        if not len(before.points):
            raise SculptError(
                "The stroke leaves nothing of the surface under it: a mask keeps all of it, its"
                " radius is too small, or its intensity so large that the surface runs through"
                " itself. Change one of them."
            )
        return _Sampled(tubes, before, after, stretch, f, gradient, swept, tree)

    def _bounding(self, tubes: list[Tube]) -> list[NDArray[np.bool_]]:
        """Which samples of the tubes bound the result, without single ones, which bound nothing
        unless there are no others: the wall of a narrow hole is thinner than their distance."""
        every = [self.folded.bounding(tube.surface, tube.target) for tube in tubes]
        together = [kept.copy() for kept in every]
        for tube, kept in zip(tubes, together, strict=True):
            kept[kept] = tube.where(kept).in_cells()
        return together if any(kept.any() for kept in together) else every

    def _whole_tubes(
        self, rows: int, columns: int, jitter: np.random.Generator | None = None
    ) -> list[Tube]:
        tubes = []
        for mine, others in zip(self.placed, self.copies.meeting, strict=True):
            tube = sample_tube(self.field, *mine, rows, columns, jitter, self.check, self.guide)
            amount = np.abs(tube.displacement.amount)
            wins = np.ones(len(amount), bool)
            for other in others:
                self.check()
                some = close(other, tube.surface.points)
                there = tube.surface.points[some], tube.displacement.normals[some]
                theirs = displace(*other, *there).amount
                wins[some] &= np.abs(theirs) <= amount[some]
            tubes.append(tube.where(wins) if others else tube)
        return tubes

    @cached_property
    def covered(self) -> NDArray[np.bool_]:
        """Which vertices of the proxy lie under the stroke."""
        vertices = self.preparation.mesh.vertices
        return self.copies.relative_distance(vertices, beyond_flat_ends=False) < 1

    @property
    def held(self) -> Samples:
        """Vertices of the proxy that the stroke must leave where they are."""
        return self.preparation.mesh.vertices.where(~self.covered)

    @cached_property
    def is_over_relief(self) -> bool:
        """Whether the stroke carries relief along: detail that is fine for it, in steep walls of
        which tubes have holes. One that has a guide does."""
        smooth = coarse(self.field, self.stroke)
        if self.is_guided or smooth.detail.levels == self.field.detail.levels:
            return self.is_guided
        proxy, under = self.preparation.proxy, self.covered
        cosine = (normals(smooth, proxy.vertices[under]) * proxy.normals[under]).sum(axis=1)
        return bool((cosine < STEEP).any())

    @cached_property
    def has_cliffs(self) -> bool:
        """Whether the displacement jumps somewhere: see `cliffs`."""
        return has_cliffs(self.placed, self.preparation.mesh, self.check)

    @cached_property
    def folded(self) -> Folded:
        """The surface asked for where the displaced surface runs through itself or has cliffs."""
        proxy, whole, stroke = self.preparation.proxy, self.preparation.mesh, self.stroke
        covered = self.covered.copy()
        if not covered.any():  # thinner than a triangle is wide
            paths = np.concatenate([one.path.points for one in self.placed])
            covered[search_tree(proxy.vertices).query(paths)[1]] = True
        touched = covered[whole.triangles].any(axis=1)
        under, held = whole.where(touched), whole.where(~touched)
        times = self._finer(under)
        if times > 1:
            reach = stroke.largest_factor + 2 * self.preparation.spacing / stroke.brush.radius

            def is_near(points: NDArray[np.float32]) -> NDArray[np.bool_]:
                return self.copies.distance(points) < reach

            cells, start = proxy.active.cells, under.points()
            under = extract_near(self.field, start, is_near, cells, times, self.check)
        return Folded(
            self.field,
            under,
            held,
            lambda surface: self.copies.move(surface)[0],
            stroke.largest_radius,
            self.check,
        )

    def _finer(self, under: SurfaceMesh) -> int:
        """How many times as fine as the proxy the mesh under a stroke that folds is.

        Its cells are those of the finest detail there, or larger where those would be too many.
        """
        finest = self.field.detail.finest_at(under.points()).max(initial=0)
        most = min(
            self.preparation.spacing / spacing(finest),
            math.sqrt(MOST_UNDER / max(len(under.triangles), 1)),
        )
        return max((times for times in TIMES_AS_FINE if times <= most), default=1)

    def displaced(self, surface: Samples) -> tuple[Samples, Array]:
        """Where surface samples (N,) shall be, and by what factor (N,) their area is stretched.

        It shrinks to nothing where the displaced surface runs through itself and bounds nothing.
        The samples' normals are those of the field: samples of the surface that was asked for may
        lie beside what the field made of it.
        """
        surface = Samples(surface.points, normals(self.field, surface.points))
        moved, stretch = self.copies.move(surface)
        if crossings(self.field, surface, moved, self.check).any():
            stretch[~self.folded.bounding(surface, moved)] = 0
        return moved, stretch

    def gaps(self, tree: KDTree, spacing: float) -> tuple[Samples, Samples]:
        """Samples of the unedited surface under the stroke of which the tube's samples, those of
        `tree`, are farther than `spacing`, and where they are displaced to.

        A tube is projected from tangent planes, and so has gaps where the surface is steep to
        them: around legs and ears. The samples are vertices of the proxy.
        """
        proxy = self.preparation.proxy
        vertices = Samples(proxy.vertices, proxy.normals)
        vertices = vertices.where(self.copies.uncovered(vertices, tree, spacing, INNER))
        upright = Samples(vertices.points, normals(self.field, vertices.points))
        if not len(upright.points):
            return upright, upright
        return vertices, self.copies.move(upright)[0]

    def _fine_gaps(
        self, surface: Samples, moved: Samples, target: Samples, spacing: float
    ) -> tuple[Samples, Samples]:
        """`gaps` among the vertices of `Folded`, which are finer than the proxy's.

        surface, moved: such vertices (N,), and where they are displaced to
        target:         displaced samples of the tubes; what is farther from all of them is a gap
        """

        def facing(some: Samples) -> NDArray[np.float32]:
            """Places and normals (N, 6): both sides of a thin part are far from each other."""
            return np.column_stack([some.points, np.float32(spacing) * some.normals])

        tree = search_tree(facing(target))
        far = ~np.isfinite(tree.query(facing(moved), distance_upper_bound=spacing)[0])
        surface, moved = surface.where(far), moved.where(far)
        inner = self.copies.relative_distance(surface, beyond_flat_ends=False) < INNER
        return surface.where(inner), moved.where(inner)

    def rim(self, reach: float, count: int, jitter: np.random.Generator) -> Samples:
        """About `count` samples of the untouched surface within `reach` radii of each copy."""
        rim = join(
            [sample_rim(self.field, *one, reach, count, jitter, self.check) for one in self.placed]
        )
        return rim.where(self.copies.untouched(rim))

    @cached_property
    def known_relative_distance(self) -> Array:
        """`Copies.relative_distance` of the samples that the preparation has of the surface."""
        return self.copies.relative_distance(self.preparation.surface)

    @cached_property
    def known_untouched(self) -> NDArray[np.bool_]:
        """Which of those samples the stroke must leave where they are."""
        if any(stroke.ends is Ends.FLAT for stroke, _ in self.placed):
            return self.copies.untouched(self.preparation.surface)
        return self.known_relative_distance > 1
