# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a stroke that grows displaces the vertices of a mesh, without beginning anew each time.

Each vertex's place in the stroke is kept. When the stroke changes, its path is compared with the
one before: it is laid on the mesh anew only from the first point that has moved, and only vertices
near that part, or whose place was in it, get another place. Where the strength depends on the whole
length, all amounts follow from the places that are known.

The path is laid on the mesh by its nearest vertices and their tangent planes, an error of second
order in the size of a triangle. NumPy alone; model space.
"""

from collections.abc import Generator, Iterator

import numpy as np
from numpy.typing import NDArray

from ..stroke.curve import Array, Curve, arc_length, fit_curve
from ..stroke.displacement import displace_at
from ..stroke.modulation import Modulation
from ..stroke.path import Path, Place, locate, make_path
from ..stroke.stroke import Stroke
from .base_surface import PIECE, BaseSurface, Indices, Vectors

Mask = NDArray[np.bool_]

STEPS_PER_RADIUS = 4  # of a path, in a radius
MOST_STEPS = 512  # steps of a path; a longer one gets twice as long ones
STILL = 1e-7  # a point of the path that has moved less is where it was
WIDER = 4  # the pressure's largest factor is rounded up to parts of one

RUN = 64  # points of a path that are laid together
AT_LEAST = 512  # vertices whose work that is, however few there are
FEW_POINTS = 8  # points that are compared with all vertices between two rests
COMPARED = 2**18  # between two rests, vertices times points of the path


class Growth:
    """One copy of a stroke on a surface, and what it does to each vertex.

    shifts:  (V, 3), what is to be added to the vertices
    amounts: (V,), their lengths, signed
    relative_distance: (V,), from the path in radii, see `Displacement`; infinite beyond
    fresh:   (V,), whose shifts may be others than before the last change
    """

    def __init__(self, surface: BaseSurface) -> None:
        """There is no stroke yet."""
        count = len(surface.positions)
        self.shifts, self.amounts = np.zeros((count, 3)), np.zeros(count)
        self.relative_distance = np.full(count, np.inf)
        self.fresh = np.zeros(count, bool)
        self._surface = surface
        self._drawn = np.empty((0, 3))  # points of the spline
        self._path: Path | None = None
        # Of each vertex its place; how far along the path it is, -inf for one that is out of reach
        self._along = np.full(count, -np.inf)
        self._distance, self._sine, self._cosine = np.zeros((3, count))
        self._beyond, self._normals = np.zeros(count, bool), np.zeros((count, 3))
        self._nearest = np.zeros(count, np.intp)

    def follow(self, stroke: Stroke) -> Iterator[int]:
        """Let the stroke be this one; gives how many vertices were looked at since."""
        self.fresh[:] = False
        before = self._path
        near = yield from self._lay(stroke)
        path = self._path
        if path is None:
            return
        first = 0 if before is None else _first_change(before, path)
        since = arc_length(path.points)[first - 1] if first else 0.0
        near |= self._along >= since
        affected = np.flatnonzero(near)
        step = max(min(PIECE, COMPARED // len(path.points)), 1)
        for start in range(0, len(affected), step):
            part = affected[start : start + step]
            yield from self._surface.learn(part)
            self._locate(path, part)
            yield len(part)
        of_length = stroke.radius_factors is not None or stroke.intensity_factors is not None
        of_length |= stroke.brush.alpha is not None
        if of_length or stroke.brush.modulation != Modulation("identity"):
            affected = np.flatnonzero(np.isfinite(self._along) | near)
        for start in range(0, len(affected), step):
            part = affected[start : start + step]
            self._displace(stroke, path, part)
            yield len(part) // 2

    def _lay(self, stroke: Stroke) -> Generator[int, None, Mask]:
        """Lay the path. Yields as `follow` does, and returns which vertices (V,) are near to the
        part of it that is new."""
        curve = fit_curve(stroke.points, stroke.closed)
        drawn = _drawn(curve, stroke.brush.radius)
        surface, near = self._surface, np.zeros(len(self._along), bool)
        if self._path is None:
            runs = np.array_split(stroke.points, -(-len(stroke.points) // RUN))
            if not any(len(surface.near(run)) for run in runs):
                return near  # it is beside the surface
            first, points, normals = 0, np.empty((0, 3)), np.empty((0, 3))
        else:
            first = max(_first_other(self._drawn, drawn) - 1, 0)
            points, normals = self._path.points[:first], self._path.normals[:first]
        self._drawn = np.vstack([self._drawn[:first], drawn[first:]])
        for start in range(first, len(drawn), RUN):
            run = drawn[start : start + RUN]
            below, away = _nearest(run, surface.positions, surface.near(run))
            far = np.flatnonzero(away > surface.reach)  # between control points that are far apart
            every = np.arange(len(near) if len(far) else 0)
            for few in np.array_split(far, -(-len(far) // FEW_POINTS)) if len(far) else ():
                below[few] = _nearest(run[few], surface.positions, every)[0]
                yield PIECE
            yield from surface.learn(np.unique(below))
            upright = surface.normals[below]
            offset = np.einsum("ij,ij->i", run - surface.positions[below], upright)
            laid = run - offset[:, None] * upright
            around = surface.near(laid)
            near[around] = True
            points, normals = np.vstack([points, laid]), np.vstack([normals, upright])
            yield len(around) // 8 + AT_LEAST
        self._path = make_path(points, normals, curve.closed, stroke.image)
        return near

    def _locate(self, path: Path, vertices: Indices) -> None:
        place = locate(path, self._surface.positions[vertices])
        in_reach = place.distance <= self._surface.reach
        self._along[vertices] = np.where(in_reach, place.u * path.length, -np.inf)
        self._distance[vertices] = place.distance
        self._sine[vertices], self._cosine[vertices] = place.sine, place.cosine
        self._beyond[vertices], self._normals[vertices] = place.beyond, place.normals
        self._nearest[vertices] = place.vertex
        self.fresh[vertices] = True

    def _displace(self, stroke: Stroke, path: Path, vertices: Indices) -> None:
        along = self._along[vertices]
        place = Place(
            np.maximum(along, 0) / max(path.length, 1e-30),
            self._distance[vertices],
            self._sine[vertices],
            self._cosine[vertices],
            self._beyond[vertices],
            self._normals[vertices],
            self._nearest[vertices],
        )
        upright = self._surface.normals[vertices]
        positions = self._surface.positions[vertices]
        moved = displace_at(stroke, path, place, positions, upright)
        amounts = np.where(np.isfinite(along), moved.amount, 0.0)
        self.relative_distance[vertices] = np.where(
            np.isfinite(along), moved.relative_distance, np.inf
        )
        self.amounts[vertices] = amounts
        self.shifts[vertices] = amounts[:, None] * moved.direction
        self.fresh[vertices] = True


def _drawn(curve: Curve, radius: float) -> Array:
    """Points (N, 3) along the spline of a stroke, close together for its radius."""
    if len(curve.points) == 1:
        return curve.points
    step, length = radius / STEPS_PER_RADIUS, arc_length(curve.points)[-1]
    return curve.every(step * 2 ** max(np.ceil(np.log2(length / step / MOST_STEPS)), 0))


def reach_of(stroke: Stroke) -> float:
    """How far from the points of its path a stroke moves vertices, at most. The pressure's largest
    factor is rounded up, so that the reach of a stroke that grows changes rarely."""
    factor = max(np.ceil(WIDER * stroke.largest_factor) / WIDER, 1.0)
    return stroke.brush.radius * (factor + 1 / STEPS_PER_RADIUS)


def _first_other(before: Array, now: Array) -> int:
    """From which point on two lines (N, 3) differ."""
    count = min(len(before), len(now))
    moved = np.flatnonzero(np.abs(before[:count] - now[:count]).max(axis=1, initial=0) > STILL)
    return int(moved[0]) if len(moved) else count


def _first_change(before: Path, now: Path) -> int:
    """From which point on two paths differ."""
    words = ("points", "laterals", "normals")
    return min(_first_other(getattr(before, word), getattr(now, word)) for word in words)


def _nearest(points: Array, positions: Vectors, some: Indices) -> tuple[Indices, Array]:
    """Which of some positions (V, 3) is nearest to each point (N, 3), and how far away it is;
    infinitely far when there is none."""
    if not len(some):
        return np.zeros(len(points), np.intp), np.full(len(points), np.inf)
    there = positions[some].astype(float)
    squares = np.einsum("ij,ij->i", there, there) - 2 * points @ there.T
    nearest = some[squares.argmin(axis=1)]
    return nearest, np.linalg.norm(points - positions[nearest], axis=1)
