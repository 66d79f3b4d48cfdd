# SPDX-License-Identifier: GPL-3.0-or-later
"""Reverse distance: of the edited proxy from the displaced surface (docs/method.md, section 9).

The displaced surface lies between samples of it, in triangles that are bent as the normals at their
corners say. Distances that go the other way, from the samples, are in `metrics`. Model space.
"""

from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.progress import Check
from ..field import Field
from ..geometry import search_tree
from ..mesh.local_extraction import extract_near
from ..mesh.proxy import Proxy
from ..mesh.surface import Samples
from ..threads import SEARCHED, in_pieces, join
from .fold import SweptVolume
from .placement import PlacedStroke
from .problem import TIMES_AS_FINE, Problem
from .tube import Tube

MEASURED = 0.95
"""Radii, within which the displaced surface is near enough to measure the way back."""

GAP, GAP_REACH = 1.5, 2.0
"""Cells of the proxy: how far from a tube's samples a gap begins (see `Problem.gaps`), and how far
the samples in a gap count."""

ACROSS = 0.5
"""Radii: cells of the mesh whose vertices are measured, if larger ones than those of the proxy."""

AROUND = 2.0
"""Cells of the proxy around the displaced surface in which a finer mesh is made."""

Array = NDArray[np.floating[Any]]


def reverse_distance(
    problem: Problem, tubes: list[Tube], swept: SweptVolume | None, edited: Field, proxy: Proxy
) -> Array:
    """Distance (N,) of the edited surface near the stroke from the displaced one, at vertices of
    its proxy.

    tubes, swept: as of `Problem.displaced_tubes`
    """
    points = np.concatenate([proxy.vertices, _between(problem, tubes, edited, proxy)])
    if swept is None and not problem.is_over_relief:
        return _from_tubes(problem, tubes, points)
    return _at_folds(problem, tubes, points)


def _between(
    problem: Problem, tubes: list[Tube], edited: Field, proxy: Proxy
) -> NDArray[np.float32]:
    """Vertices (N, 3) of a finer mesh of the edited surface, around a stroke so thin that the proxy
    has few there, or none."""
    cell, radius = problem.preparation.spacing, problem.stroke.largest_radius
    times = next(
        (times for times in TIMES_AS_FINE if cell / times < ACROSS * radius), max(TIMES_AS_FINE)
    )
    if times == 1:
        return np.empty((0, 3), np.float32)
    asked = np.concatenate([tube.target.points for tube in tubes])
    tree = search_tree(asked)

    def is_near(points: NDArray[np.float32]) -> NDArray[np.bool_]:
        return np.isfinite(tree.query(points, distance_upper_bound=AROUND * cell)[0])

    start = np.concatenate([asked, proxy.vertices[is_near(proxy.vertices)]])
    return extract_near(
        edited, start, is_near, proxy.active.cells, times, problem.check
    ).vertices.points


def _from_tubes(problem: Problem, tubes: list[Tube], points: NDArray[np.float32]) -> Array:
    """Distance (N,) of the edited surface from the displaced one, at its `points` (P, 3) near the
    stroke.

    A vertex belongs to the tube that has the nearest sample of the whole target surface, if one
    has, unless the triangle nearest to it lies at the tube's border, beyond which there is none. In
    a gap of the tube the plane of the nearest sample in it stands for the triangles.
    """
    distances = []
    surface = join([tube.surface for tube in tubes])
    gaps = problem.gaps(search_tree(surface.points), GAP * problem.preparation.spacing)[1]
    gap = KDTree(gaps.points) if len(gaps.points) else None
    surface = problem.preparation.surface
    rest = surface.points[problem.copies.untouched(surface)]
    problem.check()
    tree = KDTree(np.concatenate([*(tube.target.points for tube in tubes), rest]))
    ends = np.cumsum([len(tube.target.points) for tube in tubes])
    for number, (one, tube) in enumerate(zip(problem.placed, tubes, strict=True)):
        triangles = tube.triangles()
        problem.check()
        vertices = points[_close(one, points)].astype(float)
        problem.check()
        nearest = tree.query(vertices)[1]
        vertices = vertices[np.searchsorted(ends, nearest, side="right") == number]
        if len(vertices) and len(triangles):
            distance, face = _to_surface(vertices, tube.target, triangles, problem.check)
            inner = (tube.displacement.relative_distance < MEASURED) & tube.inner()
            inner = inner[triangles].all(axis=1)
            if gap is not None:
                nearest = gap.query(vertices)[1]
                away = vertices - gaps.points[nearest]
                plane = np.abs((away * gaps.normals[nearest]).sum(axis=1))
                distance = np.where(
                    np.linalg.norm(away, axis=1) < GAP_REACH * problem.preparation.spacing,
                    np.minimum(distance, plane),
                    distance,
                )
            distances.append(distance[inner[face]])
    return np.concatenate([*distances, np.empty(0)])


def _at_folds(problem: Problem, tubes: list[Tube], points: NDArray[np.float32]) -> Array:
    """Distance as of `_from_tubes`, where the displaced surface runs through itself or has cliffs,
    and over relief.

    It is measured from all of the surface asked for. The vertices that count are those to which the
    displaced part of that is nearest, and those in the swept volume: a film that is left where a
    sheet was carved away counts, however near it is to untouched surface.
    """
    vertices = points[_near(problem, points)]
    surface, triangles, displaced = _asked_at_folds(problem, tubes)
    if not len(vertices) or not len(triangles):
        return np.empty(0)
    distance, face = _to_surface(vertices.astype(float), surface, triangles, problem.check)
    return distance[displaced[face] | problem.folded.swept.swallows(vertices)]


def displaced_distance(problem: Problem, tubes: list[Tube], points: NDArray[np.float32]) -> Array:
    """Distance (N,) of points (N, 3) from the displaced part of the surface asked for, where that
    runs through itself. Infinite far from the stroke, and where nothing is displaced.

    tubes: as of `Problem.displaced_tubes`
    """
    found = np.full(len(points), np.inf)
    near = _near(problem, points)
    surface, triangles, displaced = _asked_at_folds(problem, tubes)
    if near.any() and displaced.any():
        some = points[near].astype(float)
        found[near] = _to_surface(some, surface, triangles[displaced], problem.check)[0]
    return found


def _asked_at_folds(
    problem: Problem, tubes: list[Tube]
) -> tuple[Samples, NDArray[np.int64], NDArray[np.bool_]]:
    """The surface asked for where it runs through itself: samples, triangles (T, 3) between them,
    and which of these are displaced (T,)."""
    surface, triangles, displaced = problem.folded.triangles
    for tube in tubes:  # which are finer where a profile bends
        triangles = np.concatenate([triangles, tube.triangles() + len(surface.points)])
        surface = join([surface, tube.target])
    of_tubes = np.ones(len(triangles) - len(displaced), bool)
    return surface, triangles, np.append(displaced, of_tubes)


def _near(problem: Problem, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which of points (N, 3) are close to a copy of the stroke."""
    return np.logical_or.reduce([_close(one, points) for one in problem.placed])


def _close(one: PlacedStroke, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which of points (N, 3) may be of what a copy of the stroke displaced, or beside it."""
    reach = 2 * (one.stroke.largest_radius + one.stroke.largest_intensity)
    away = KDTree(one.path.points).query(points, distance_upper_bound=reach)[0]
    return np.isfinite(away)


def _to_surface(
    points: Array, samples: Samples, triangles: NDArray[np.int64], check: Check
) -> tuple[Array, NDArray[np.int64]]:
    """Distance (N,) of points (N, 3) from the surface through samples, and the nearest triangles
    (N,) between those.

    A triangle is bent as the normals at its corners say: at each place the surface lies half as far
    from it as the corners' tangent planes do on average, as a paraboloid would.
    """
    vertices = samples.points.astype(float)
    check()
    tree = igl.AABB()
    tree.init(vertices, triangles)

    def measure(part: slice) -> tuple[Array, NDArray[np.int64]]:
        _, face, nearest = map(np.asarray, tree.squared_distance(vertices, triangles, points[part]))
        corners = vertices[triangles[face]]  # (n, 3, 3)
        normals = samples.normals[triangles[face]]
        a, b, c = np.ascontiguousarray(corners.swapaxes(0, 1))
        share = np.nan_to_num(igl.barycentric_coordinates(nearest, a, b, c))  # nan without area
        planes = np.einsum("nca,nca->nc", corners - nearest[:, None], normals)
        bent = nearest + np.einsum("nc,nc,nca->na", share, planes, normals) / 2
        return np.linalg.norm(points[part] - bent, axis=1), face

    return in_pieces(measure, len(points), check, light=True, size=SEARCHED)
