# SPDX-License-Identifier: GPL-3.0-or-later
"""Folds: where a displaced surface runs through itself, and which parts of it bound nothing then.

A surface that is displaced farther than its radius of curvature folds over; one that is displaced
farther than a wall is thick comes out behind it; the sides of a groove meet. `crossings` finds that
by samples. Winding numbers tell which parts bound nothing (Jacobson et al., "Robust inside-outside
segmentation using generalized winding numbers", 2013): the sum of that of the shape before and that
of the volume between tubes and their targets is 0 just outside of what bounds the shape. Model
space. See docs/method.md, section 2.
"""

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.progress import Check
from ..evaluate import values
from ..field import Field
from ..geometry import search_tree
from ..mesh.surface import Samples
from ..threads import SEARCHED, in_pieces

WRONG_SIDE = 2e-3  # of f0 behind a wall: the surface may be as far off the one asked for
CLOSE = 0.9  # of a displacement; the rest is for samples that are not everywhere
FACING = 0.5  # cosine between a sample's way and its normal; steeper walls slip along the surface
BESIDE = 1 / 64  # radii: how far outside and inside of a sample winding numbers are taken
NEAR_CROSSING = 0.5  # radii from the ways of crossing samples, where normals do not tell the sides
CLIFF = 8  # times its length before: what is stretched more has walls
PRECISION = 1e-6  # of places and normals in single precision
BOUND = 0.5  # |winding numbers| below count as 0
ORDER, ACCURACY_SCALE = 2, 1.25
"""Of the series of winding numbers, as libigl calls them: its order, and the radii of a part from
which on the part is seen by its series: within 0.05."""
WOUND = 2048  # points at a time: igl shares more than a thousand among threads of its own


def crossings(
    field: Field,
    before: Samples,
    after: Samples,
    check: Check,
    tree: KDTree | None = None,
    f: NDArray[np.float32] | None = None,
) -> NDArray[np.bool_]:
    """Which samples (N,) have run through the surface `before` or `after`, as they show themselves.

    Carved ones come out on the other side of a wall, raised ones run into another part. Others come
    closer to some part than it is displaced itself, or are turned over.

    tree: of the samples before
    f:    (N,), of the field at the samples after
    """
    if not len(before.points):
        return np.zeros(0, bool)
    far = np.linalg.norm(after.points - before.points, axis=1)
    tree = search_tree(before.points) if tree is None else tree

    def is_close(part: slice) -> NDArray[np.bool_]:
        return _closer(after.points[part], tree, far)[0]

    close = in_pieces(is_close, len(far), check, size=SEARCHED)
    return close | _through(field, before, after, check, f) | _turned_over(before, after)


def passes(field: Field, before: Samples, after: Samples, check: Check) -> bool:
    """Whether samples (N,) of relief that is carried along have run through the surface.

    `crossings` finds many that have not: steep relief comes close to where its neighbours were, and
    keeps its distance from them. These have come past each other: one is closer to where another
    was than that is raised along its normal, and of the way between both hardly any is left. Those
    that have come out behind a wall or are turned over tell nothing where they slip along a steep
    one.
    """
    height = np.abs(_height(before, after))
    tree = search_tree(before.points)

    def has_passed(part: slice) -> NDArray[np.bool_]:
        start, goal = before.points[part], after.points[part]
        passed, nearest = _closer(goal, tree, height)
        other = nearest[passed]
        was, now = start[passed] - before.points[other], goal[passed] - after.points[other]
        passed[passed] = (was * now).sum(axis=1) < (1 - CLOSE) * (was * was).sum(axis=1)
        return passed

    if in_pieces(has_passed, len(height), check, size=SEARCHED).any():
        return True
    facing = height > FACING * np.linalg.norm(after.points - before.points, axis=1)
    start, goal = before.where(facing), after.where(facing)
    behind = _through(field, start, goal, check).any()
    return bool(behind or _turned_over(start, goal).any())


class SweptVolume:
    """The volume between a surface and where it is displaced to: +1 where it is added, -1 where it
    is carved.

    It is the sum of the winding numbers of either half of its surface: a tree of all of it takes
    50 ms to make, in which no cancel is heard.
    """

    def __init__(
        self,
        field: Field,
        before: Samples,
        after: Samples,
        triangles: NDArray[np.int64],
        radius: float,
        check: Check,
    ) -> None:
        """Close the gap between both by walls along their rim.

        before, after: (N,) vertices of the surface, of which `triangles` (T, 3) are
        radius:        of the stroke
        """
        self._check, self._reach = check, NEAR_CROSSING * radius
        self.beside = BESIDE * radius
        crossed = crossings(field, before, after, check)
        crossed[triangles[steep(before, after, triangles).any(axis=1)]] = True
        start, way = before.points[crossed], (after.points - before.points)[crossed]
        longest = np.linalg.norm(way, axis=1).max(initial=0)
        shares = np.linspace(0, 1, int(longest / self._reach) + 2, dtype=np.float32)
        ways = np.concatenate([start + share * way for share in shares])
        self._low = ways.min(axis=0, initial=np.inf) - self._reach
        self._high = ways.max(axis=0, initial=-np.inf) + self._reach
        self._ways = search_tree(ways)
        size = len(before.points)
        first, last = _rim(triangles).T
        walls = (last, first, first + size), (last, first + size, last + size)
        bottom = triangles[:, ::-1] + size
        faces = np.concatenate([triangles, bottom, *(np.stack(wall, 1) for wall in walls)])
        vertices, self._trees = np.concatenate([after.points, before.points]).astype(float), []
        for half in filter(len, np.array_split(faces, 2)):
            check()
            self._trees.append(igl.FastWindingNumberBVH())
            self._trees[-1].init(vertices, half, ORDER)

    def near(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """At which of points (N, 3) the surface may run through itself: elsewhere its normals tell
        the sides."""

        near = self.in_box(points)
        some = points[near]

        def is_near(part: slice) -> NDArray[np.bool_]:
            return np.isfinite(self._ways.query(some[part], distance_upper_bound=self._reach)[0])

        near[near] = in_pieces(is_near, len(some), self._check, size=SEARCHED)
        return near

    def in_box(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which of points (N, 3) lie in the box around all that is near."""
        return ((points > self._low) & (points < self._high)).all(axis=1)

    def winding(self, points: NDArray[np.float32]) -> NDArray[np.float64]:
        """Winding numbers (N,) at points (N, 3)."""

        def wind(part: slice) -> NDArray[np.float64]:
            place = points[part].astype(float)
            total = np.zeros(len(place))
            for half in self._trees:
                total += half.winding_number(place, ACCURACY_SCALE)
            return total

        return in_pieces(wind, len(points), self._check, light=True, size=WOUND)

    def swallows(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which of points (N, 3) of the surface lie in it, where it may run through itself: a part
        that was covered or carved away, and bounds nothing any more."""
        swallowed = self.near(points)
        swallowed[swallowed] = np.abs(self.winding(points[swallowed])) > BOUND
        return swallowed


def bounding(
    field: Field, swept: SweptVolume, before: Samples, after: Samples, check: Check
) -> NDArray[np.bool_]:
    """Which samples (N,) of a displaced surface bound the shape: just outside of them is no part of
    it, and just inside is one."""
    bounds = ~swept.near(after.points)
    some = np.flatnonzero(~bounds)
    for side, wanted in (1, 0), (-1, 1):
        beside = after.points[some] + np.float32(side * swept.beside) * after.normals[some]
        some = some[np.abs(_inside(field, beside, check) + swept.winding(beside) - wanted) < BOUND]
    bounds[some] = True
    return bounds


def _inside(field: Field, points: NDArray[np.float32], check: Check) -> NDArray[np.bool_]:
    """Which points (N, 3) lie inside the shape of a field."""
    return in_pieces(lambda part: values(field, points[part]) < 0, len(points), check)


def _closer(
    points: NDArray[np.float32], tree: KDTree, far: NDArray[np.floating]
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Which points (N, 3) are closer to the nearest one of a tree than that is displaced, by `far`
    (M,), and the number (N,) of it; M where none is near."""
    reach = CLOSE * np.append(far, 0)
    found = tree.query(points, distance_upper_bound=CLOSE * far.max(initial=0))
    distance, nearest = np.asarray(found[0]), np.asarray(found[1])
    return distance < reach[nearest], nearest


def _through(
    field: Field,
    before: Samples,
    after: Samples,
    check: Check,
    f: NDArray[np.float32] | None = None,
) -> NDArray[np.bool_]:
    """Which samples (N,) have come out behind a wall, or run into another part."""
    if f is None:
        f = in_pieces(lambda part: values(field, after.points[part]), len(before.points), check)
    return _outward(before, after) * f < -WRONG_SIDE


def _turned_over(before: Samples, after: Samples) -> NDArray[np.bool_]:
    """Which samples (N,) of a displaced surface face against the way that they went outward."""
    way = after.points - before.points
    return _outward(before, after) * (way * after.normals).sum(axis=1) < -PRECISION


def _outward(before: Samples, after: Samples) -> NDArray[np.floating]:
    """1 of samples (N,) that were raised, -1 of those that were carved, 0 of those left there."""
    return np.sign(_height(before, after))


def _height(before: Samples, after: Samples) -> NDArray[np.floating]:
    """How far samples (N,) were raised along their own normals; below 0 where they were carved."""
    return ((after.points - before.points) * before.normals).sum(axis=1)


def steep(before: Samples, after: Samples, triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which edges (T, 3) of triangles, from each corner to the next, become walls: the displacement
    jumps between their ends."""
    following = np.roll(triangles, -1, axis=1)
    was, now = (
        np.linalg.norm(some.points[triangles] - some.points[following], axis=2)
        for some in (before, after)
    )
    return now > CLIFF * was


def _rim(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Edges (E, 2) that have a triangle on one side only, in its direction."""
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])  # (3 T, 2)
    size = edges.max(initial=0) + 1
    there, back = size * edges[:, 0] + edges[:, 1], size * edges[:, 1] + edges[:, 0]
    return edges[~np.isin(there, back)]
