# SPDX-License-Identifier: GPL-3.0-or-later
"""Folded surface: what is asked for where it runs through itself, as triangles.

    mesh under the stroke -> divided until it is fine -> swept volume -> what bounds something

Model space. See docs/method.md, section 2.
"""

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ...common.progress import Check
from ...stroke.curve import Array
from ..evaluate import normals
from ..field import Field
from ..mesh.refinement.subdivide import divide
from ..mesh.surface import Samples, SurfaceMesh
from ..projection import ARRIVED, project
from ..threads import SEARCHED, in_pieces, join
from .fold import SweptVolume, bounding, passes, steep

FINE_EDGE = 1 / 16  # radii: of the triangles that tell what the stroke sweeps over
CUT = 1 / 32  # radii: edges from a vertex that bounds something to one that does not
SHORTEST = 1 / 8  # of the former: edges that get no shorter, as where a profile jumps
MOST_VERTICES = 12_000  # of triangles with edges of FINE_EDGE; the longest edges are halved first
MOST_CUT = 15_000  # vertices once edges longer than CUT are halved, too
BURIED = 0.5  # winding number of the new shape, from which on a point lies in it


class Under(NamedTuple):
    """The surface under a stroke.

    before, after: its vertices (N,), and where they are displaced to
    bounds:        (N,), which of them bound something once they are displaced
    triangles:     (T, 3)
    """

    before: Samples
    after: Samples
    bounds: NDArray[np.bool_]
    triangles: NDArray[np.int64]


class _Moved(NamedTuple):
    points: NDArray[np.float32]  # (N, 3)
    normals: NDArray[np.float32]
    moved: NDArray[np.float32]
    moved_normals: NDArray[np.float32]


class _Bounding(NamedTuple):
    points: NDArray[np.float32]  # (N, 3)
    normals: NDArray[np.float32]
    moved: NDArray[np.float32]
    moved_normals: NDArray[np.float32]
    bounds: NDArray[np.bool_]


class Folded:
    """The surface that a stroke asks for where the displaced surface runs through itself."""

    def __init__(
        self,
        field: Field,
        below: SurfaceMesh,
        held: SurfaceMesh,
        move: Callable[[Samples], Samples],
        radius: float,
        check: Check,
    ) -> None:
        """Nothing is divided yet.

        below:  the surface of the field under the stroke
        held:   its surface elsewhere
        move:   where samples of the surface are displaced to
        radius: of the stroke
        """
        self._field, self._below, self._held = field, below, held
        self._move, self._radius, self._check = move, radius, check

    @cached_property
    def under(self) -> Under:
        """The surface under the stroke, whose edges are short where one end bounds something and
        the other one does not: such a triangle would hang over."""
        finest = CUT * self._radius

        def excess(one: _Bounding, other: _Bounding) -> Array:
            length = np.linalg.norm(one.moved - other.moved, axis=1)
            return np.where((one.bounds != other.bounds) & (length > finest), length, 0)

        def middles(one: _Bounding, other: _Bounding) -> _Bounding:
            return with_bounds(self._halfway(one.points, other.points))

        def with_bounds(some: _Moved) -> _Bounding:
            before, after = Samples(*some[:2]), Samples(*some[2:])
            return _Bounding(*some, self.bounding(before, after))

        triangles, found = self._divided
        triangles, found = divide(triangles, with_bounds(found), excess, middles, MOST_CUT)
        before, after = Samples(*found[:2]), Samples(*found[2:4])
        return Under(before, after, found.bounds, triangles.astype(np.int64))

    @cached_property
    def _divided(self) -> tuple[NDArray[np.int32], _Moved]:
        """Triangles and vertices of the surface under the stroke, of which little is known yet.

        A tube is a grid on tangent planes: it has holes where the surface is steep to them, and few
        samples where an edge fans out. So a mesh's triangles are divided until they are fine
        before and after, and their vertices brought to the surface.
        """
        finest = FINE_EDGE * self._radius

        def excess(one: _Moved, other: _Moved) -> Array:
            was = np.linalg.norm(one.points - other.points, axis=1)
            now = np.linalg.norm(one.moved - other.moved, axis=1)
            length = np.maximum(was, np.where(was > finest * SHORTEST, now, 0))
            return np.where(length > finest, length, 0)

        def middles(one: _Moved, other: _Moved) -> _Moved:
            return self._halfway(one.points, other.points)

        some, corners = np.unique(self._below.triangles, return_inverse=True)
        vertices = self._below.vertices.points[some]
        found = self._moved(Samples(vertices, normals(self._field, vertices)))
        triangles = corners.reshape(-1, 3).astype(np.int32)
        return divide(triangles, found, excess, middles, MOST_VERTICES)

    def _halfway(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> _Moved:
        """The middles of edges, brought to the surface."""
        start = (one + other) / 2

        def bring(part: slice) -> Samples:
            return Samples(*project(self._field, start[part], tolerance=ARRIVED)[:2])

        return self._moved(in_pieces(bring, len(start), self._check))

    def _moved(self, before: Samples) -> _Moved:
        return _Moved(*before, *self._move(before))

    @cached_property
    def whole(self) -> tuple[Samples, Samples, NDArray[np.int64]]:
        """Vertices (N,) of the surface under the stroke, where they are displaced to, and triangles
        (T, 3). What bounds nothing is among them."""
        triangles, found = self._divided
        return Samples(*found[:2]), Samples(*found[2:]), triangles.astype(np.int64)

    @cached_property
    def folds_over_relief(self) -> bool:
        """Whether the displaced surface runs through itself, or has cliffs. Relief that only comes
        close to where its neighbours were does neither."""
        before, after, triangles = self.whole
        cliffs = steep(before, after, triangles).any()
        return bool(cliffs or passes(self._field, before, after, self._check))

    @cached_property
    def swept(self) -> SweptVolume:
        """What the surface sweeps over."""
        return SweptVolume(self._field, *self.whole, self._radius, self._check)

    def inside(self, points: NDArray[np.float32], f: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which of any points (N, 3), where the field was f (N,), are inside of the new surface.

        The old surface and its triangles are not the same: a point between both is outside by one
        and inside by the other. So winding numbers of points close to the old surface are taken a
        little farther away from it, on the side that f tells.
        """
        aside = self.swept.beside
        some = np.flatnonzero(np.abs(f) < aside)
        asked = points.copy()
        way = aside * np.where(f[some] < 0, -1, 1).astype(np.float32)
        asked[some] += way[:, None] * normals(self._field, points[some])
        return (f < 0) + self.swept.winding(asked) > BURIED

    def bounding(self, before: Samples, after: Samples) -> NDArray[np.bool_]:
        """Which displaced samples (N,) bound something."""
        return bounding(self._field, self.swept, before, after, self._check)

    def walls(self, apart: float, random: np.random.Generator) -> tuple[Samples, Samples]:
        """Samples of the walls that open where the displacement jumps, before and after it, `apart`
        from each other in the mean. Samples of the surface leave these walls empty.

        Over folds of other strokes most walls bound nothing, at no corner and not in their middle:
        these get none.
        """
        before, after, bounds, triangles = self.under
        walls = triangles[steep(before, after, triangles).any(axis=1)]
        corners = after.points[walls]  # (W, 3, 3)
        turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        twice = np.linalg.norm(turned, axis=1)
        normal = (turned / np.maximum(twice, np.finfo(float).tiny)[:, None]).astype(np.float32)

        def at(chosen: NDArray[np.intp], share: Array) -> tuple[Samples, Samples]:
            """Places (K, 3) in the chosen walls, by shares (K, 3) of their corners."""
            part = share.astype(np.float32)[:, :, None]
            start, goal = (
                Samples(np.sum(part * some.points[walls[chosen]], axis=1), normal[chosen])
                for some in (before, after)
            )
            return start, goal

        bounding = bounds[walls].any(axis=1)
        unsure = np.flatnonzero(~bounding)
        bounding[unsure] = self.bounding(*at(unsure, np.full((len(unsure), 3), 1 / 3)))
        count = np.floor(twice / 2 / apart**2 + random.uniform(size=len(walls))).astype(int)
        count[(twice == 0) | ~bounding] = 0
        chosen = np.repeat(np.arange(len(walls)), count)
        start, goal = at(chosen, random.dirichlet((1, 1, 1), len(chosen)))
        bounds = self.bounding(start, goal)
        return start.where(bounds), goal.where(bounds)

    def bounding_nothing(self) -> tuple[Samples, Samples]:
        """Vertices of `under` that bound nothing once they are displaced, and where they are then.
        What they pass on their way is added or carved all the same."""
        nothing = ~self.under.bounds
        return self.under.before.where(nothing), self.under.after.where(nothing)

    @cached_property
    def triangles(self) -> tuple[Samples, NDArray[np.int64], NDArray[np.bool_]]:
        """The surface that is asked for: vertices, triangles (T, 3), and which of these (T,) are
        displaced.

        The triangles under the stroke that bound something, and those elsewhere that the stroke
        does not swallow.
        """
        beside, (before, moved, bounds, triangles) = self._held.vertices, self.under
        bounding = triangles[bounds[triangles].any(axis=1)]
        moves = (moved.points != before.points).any(axis=1)[bounding].any(axis=1)
        held = self._held.triangles.astype(np.int64)
        left = ~self.swept.swallows(beside.points)
        held = held[left[held].any(axis=1)] + len(moved.points)
        displaced = np.append(moves, np.zeros(len(held), bool))
        return join([moved, beside]), np.concatenate([bounding, held]), displaced

    def distance(self, points: NDArray[np.float32]) -> Array:
        """Distance (N,) of points (N, 3) from the surface that is asked for.

        The points are near a place where that runs through itself: of the triangles that the stroke
        does not displace, only those in the box around such places are searched.
        """
        tree, vertices, triangles = self._tree

        def measure(part: slice) -> Array:
            square = tree.squared_distance(vertices, triangles, points[part].astype(float))[0]
            return np.sqrt(np.asarray(square))

        return in_pieces(measure, len(points), self._check, light=True, size=SEARCHED)

    @cached_property
    def _tree(self) -> tuple[igl.AABB, Array, NDArray[np.int64]]:
        surface, triangles, displaced = self.triangles
        held = self.swept.in_box(surface.points)[triangles].any(axis=1)
        triangles = triangles[displaced | held]
        tree, vertices = igl.AABB(), surface.points.astype(float)
        self._check()
        tree.init(vertices, triangles)
        return tree, vertices, triangles
