# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement of surface points by a stroke: d = m(u) s b(v / r) (paper, section 3), times the
grey of its alpha, if it has one.

v is the signed distance from the path. Around a round end the profiles of both sides are blended by
the sine of the angle to the tangent, so the cap continues the sides; beyond a flat end d = 0.

Where the surface's normal turns away from n(u), by more than 90 degrees, it is the other sheet of a
thin part and is not displaced. From 60 degrees on the stroke reaches less far, so the displacement
fades and there is no cliff at an edge: a share of 1 - |v| / r is left. Where a path leads around an
edge, its nearest point may lie on the other sheet. A surface point that faces away from it belongs
to the vertex of the path with the largest reach there. A mask m weakens d by the factor 1 - m.

Model space. See docs/method.md, section 2.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .alpha import Alpha
from .curve import Array, arc_length, through
from .path import POINTS_AT_ONCE, Path, Place, locate, place_at, square_distances
from .stroke import Direction, Ends, Stroke

FACING = 0.5
"""Cosine between a normal and that of the path, from which on a stroke has its full reach."""

MASKED = 1.2
"""Radii: the least relative distance of what is masked in full. It stays, as what lies beside a
stroke."""


class Displacement(NamedTuple):
    """What a stroke does to surface points (M, 3).

    relative_distance: from the path in radii, 1 less what is left of the reach; infinite on the
        other sheet of a thin part, and at least MASKED where a mask keeps the surface
    """

    amount: Array  # (M,), signed length
    direction: Array  # (M, 3), unit
    relative_distance: Array  # (M,)
    beyond: NDArray[np.bool_]  # (M,), past an open end or around a dab
    normals: Array  # (M, 3), by which it was found
    vertex: NDArray[np.intp]  # (M,), of the path, by which it was found: the nearest one or,
    facing: NDArray[np.bool_]  # (M,), where this is true, the one with the largest reach there
    share: Array  # (M,), of the reach that the angle between the normals leaves

    @property
    def core(self) -> NDArray[np.bool_]:
        """Which points (M,) lie beside the path and not beyond its ends; of a dab all points."""
        return ~self.beyond | self.beyond.all()

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "Displacement":
        """The chosen points' part."""
        return self._make(array[chosen] for array in self)


def displace(
    stroke: Stroke,
    path: Path,
    points: ArrayLike,
    normals: ArrayLike,
    beside: Displacement | None = None,
) -> Displacement:
    """The displacement of surface `points` (M, 3) with unit outward `normals` (M, 3).

    path:   of the stroke, on the same surface; its mirror images have paths of their own
    beside: that of points beside these, closer to them than vertices of the path to each other
    """
    if beside is None:
        return displace_at(stroke, path, locate(path, points), points, normals)
    place, facing = locate(path, points, beside.vertex), np.flatnonzero(beside.facing)
    if len(facing):
        there = np.asarray(points, float)[facing]
        place = place.put(facing, place_at(path, there, beside.vertex[facing]))
    return _displace(stroke, path, place, beside.facing, points, normals)


def displace_at(
    stroke: Stroke, path: Path, place: Place, points: ArrayLike, normals: ArrayLike
) -> Displacement:
    """`displace` for surface points whose nearest place (M,) in the stroke is known already."""
    points, normals = np.asarray(points, float), np.asarray(normals, float)
    radius = np.maximum(local_radius(stroke, place.u), 1e-9)
    cosine = np.einsum("ij,ij->i", normals, place.normals)
    away = np.flatnonzero((cosine < FACING) & (place.distance < radius))
    facing = np.zeros(len(points), bool)
    if len(away) and len(path.points) > 1:
        vertex, reach = _facing(stroke, path, points[away], normals[away])
        wins = reach > (1 - place.distance[away] / radius[away]) * _share(cosine[away])
        away, vertex = away[wins], vertex[wins]
        facing[away] = True
        place = place.put(away, place_at(path, points[away], vertex))
    return _displace(stroke, path, place, facing, points, normals)


def _facing(
    stroke: Stroke, path: Path, points: Array, normals: Array
) -> tuple[NDArray[np.intp], Array]:
    """The vertices (M,) of the path with the largest reach at surface points (M, 3); that reach."""
    radius = np.maximum(local_radius(stroke, path.u), 1e-9)
    vertex, reach = np.empty(len(points), np.intp), np.empty(len(points))
    for start in range(0, len(points), POINTS_AT_ONCE):
        part = slice(start, start + POINTS_AT_ONCE)
        every = np.sqrt(square_distances(points[part], path.points))
        every /= radius
        np.subtract(1, every, out=every)
        every *= _share(normals[part] @ path.normals.T)
        vertex[part] = every.argmax(axis=1)
        reach[part] = every[np.arange(len(every)), vertex[part]]
    return vertex, reach


def _share(cosine: Array) -> Array:
    """What is left of a stroke's reach, by the cosine between a normal and that of the path."""
    share = np.clip(cosine / FACING, 0, 1)
    return share * share * (3 - 2 * share)


def _displace(
    stroke: Stroke,
    path: Path,
    place: Place,
    facing: NDArray[np.bool_],
    points: ArrayLike,
    normals: ArrayLike,
) -> Displacement:
    normals = np.asarray(normals, float)
    brush = stroke.brush
    cosine = np.einsum("ij,ij->i", normals, place.normals)
    radius = local_radius(stroke, place.u)
    intensity = brush.intensity * _factors(stroke, stroke.intensity_factors, place.u)
    away = place.distance / np.maximum(radius, 1e-9)
    share = _share(cosine)
    relative_distance = np.where(away < 1, 1 - (1 - away) * share, away)
    relative_distance[cosine <= 0] = np.inf
    inside = np.minimum(relative_distance, 2.0)  # the profile is zero from 1 on
    left, right = (1 + place.sine) / 2, (1 - place.sine) / 2
    height = left * brush.profile(inside) + right * brush.profile(-inside)
    amount = intensity * brush.modulation(place.u) * height
    if stroke.ends is Ends.FLAT and len(path.points) > 1:
        amount = np.where(place.beyond, 0.0, amount)
    if brush.alpha is not None:
        amount = amount * _grey(brush.alpha, stroke, path, place, amount != 0)
    if stroke.mask is not None:
        near = np.flatnonzero(relative_distance < MASKED)
        mask = stroke.mask(np.asarray(points, float)[near])
        amount[near] *= 1 - mask
        relative_distance[near[mask == 1]] = MASKED
    direction = place.normals if stroke.direction is Direction.STROKE else normals
    return Displacement(
        *(amount, direction, relative_distance, place.beyond, normals, place.vertex, facing, share)
    )


def local_radius(stroke: Stroke, u: Array) -> Array:
    """The radius (M,) at u (M,), with the factors of the control points."""
    return stroke.brush.radius * _factors(stroke, stroke.radius_factors, u)


def _grey(
    alpha: Alpha, stroke: Stroke, path: Path, place: Place, needed: NDArray[np.bool_]
) -> Array:
    """Grey values (M,) of the alpha at places in the stroke, 0 where they are not `needed` (M,).

    Along the stroke lengths are in its largest radius, so images are as far apart everywhere.
    """
    largest = max(stroke.largest_radius, 1e-9)
    along = (place.u * path.length + place.cosine * place.distance) / largest
    left = place.sine * place.distance / np.maximum(local_radius(stroke, place.u), 1e-9)
    inset = float(stroke.ends is Ends.FLAT and len(path.points) > 1)
    grey = np.zeros(len(along))
    grey[needed] = alpha.along(
        along[needed], left[needed], path.length / largest, path.closed, inset
    )
    return grey


def _factors(stroke: Stroke, factors: Array | None, u: Array) -> Array:
    """Factors of the control points at u, linear by chord length between them."""
    if factors is None:
        return np.ones_like(u)
    points = stroke.points
    if stroke.closed:
        counted, closed = through(points, closed=True)
        order = np.append(np.arange(len(points)), 0) if closed else counted
        points, factors = points[order], factors[order]
    along = arc_length(points)
    return np.interp(u * along[-1], along, factors)
