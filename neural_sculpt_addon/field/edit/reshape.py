# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that reshape what is there become layers (docs/method.md, section 6).

    patch of triangles under the stroke -> goals -> a share of the way -> as a brush of Blender's

The patch is the proxy's, divided until it shows the detail that is there. From then on a stroke is
what brushes of Sculpt Mode do: triangles before and after (see `brushed`). Model space.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.errors import SculptError
from ...common.progress import Progress
from ...stroke.displacement import displace
from ..evaluate import normals
from ..geometry import unit
from ..mesh.refinement.subdivide import divide
from ..mesh.surface import Samples
from ..problem.metrics import Goal
from ..problem.placement import PlacedStroke
from ..problem.problem import Problem, coarse
from ..projection import ARRIVED, project
from ..threads import in_pieces
from .brushed import AbsorbedStroke, absorb_brushed
from .brushed_surface import MOST_VERTICES, Brushed
from .fairing import goals

SURROUNDINGS = 1.5
"""Radii from the path up to which the patch tells what the surface is like around the stroke."""

FINE_EDGE, PER_CELL = 1 / 10, 0.4
"""Of the radius, and of a cell of the finest detail there: edges of the patch. The less counts."""

STILL = 1e-6  # model units; what moves less is as it shall be
RINGS = 2  # of triangles around those that move


class Reshaped(NamedTuple):
    """The field after the stroke, and what was asked for."""

    stroke: AbsorbedStroke
    goal: Goal


def reshape(problem: Problem, progress: Progress) -> Reshaped:
    """The edit that the stroke of `problem` asks for.

    SculptError when nothing would move.
    """
    surface, triangles = _patch(problem)
    points = surface.points.astype(float)
    smooth = coarse(problem.field, problem.stroke)  # or the sides of bumps would stay
    upright = normals(smooth, surface.points)
    way, largest = np.zeros_like(points), np.zeros(len(points))
    for one in problem.placed:
        problem.check()
        share = displace(*one, surface.points, upright).amount
        radius = one.stroke.largest_radius
        there = goals(one.stroke.kind, one.path, radius, surface, triangles) - points
        wins = np.abs(share) > largest
        way[wins], largest[wins] = share[wins, None] * there[wins], np.abs(share[wins])
    moves = np.linalg.norm(way, axis=1) > STILL
    if not moves.any():
        raise SculptError(
            "The stroke changes nothing: the surface is as it would make it, a mask keeps it, or"
            " its strength is 0."
        )
    after = np.where(moves[:, None], points + way, points).astype(np.float32)
    chosen = moves[triangles].any(axis=1)
    for _ in range(RINGS):
        near = np.zeros(len(points), bool)
        near[triangles[chosen]] = True
        chosen = near[triangles].any(axis=1)
    used, corners = np.unique(triangles[chosen], return_inverse=True)
    brushed = Brushed(surface.points[used], after[used], corners.reshape(-1, 3).astype(np.int32))
    done = absorb_brushed(problem.preparation, brushed, seed=problem.seed, progress=progress)
    asked = Samples(after, _normals(after, triangles))
    return Reshaped(done, Goal(surface.where(moves), asked.where(moves)))


def _patch(problem: Problem) -> tuple[Samples, NDArray[np.int64]]:
    """The surface around the stroke: vertices, and triangles (T, 3) as fine as its detail."""
    proxy, field = problem.preparation.proxy, problem.field
    near = np.logical_or.reduce([_near(problem, one) for one in problem.placed])
    used, corners = np.unique(
        proxy.triangles[near[proxy.triangles].any(axis=1)], return_inverse=True
    )
    if not len(used):
        raise SculptError("There is no surface under the stroke. Draw it on the field.")
    usual = min(FINE_EDGE * one.stroke.largest_radius for one in problem.placed)

    def excess(one: _Places, other: _Places) -> NDArray[np.floating]:
        finest = field.detail.finest_at((one.points + other.points) / 2)
        edge = np.linalg.norm(one.points - other.points, axis=1)
        return np.where(edge > np.minimum(usual, PER_CELL * 2.0**-finest), edge, 0)

    def middles(one: _Places, other: _Places) -> _Places:
        start = (one.points + other.points) / 2

        def bring(part: slice) -> NDArray[np.float32]:
            return project(field, start[part], tolerance=ARRIVED).points

        return _Places(in_pieces(bring, len(start), problem.check))

    triangles = corners.reshape(-1, 3).astype(np.int32)
    triangles, (points,) = divide(
        triangles, _Places(proxy.vertices[used]), excess, middles, MOST_VERTICES
    )
    return Samples(points, normals(field, points)), triangles.astype(np.int64)


class _Places(NamedTuple):
    points: NDArray[np.float32]  # (N, 3)


def _near(problem: Problem, one: PlacedStroke) -> NDArray[np.bool_]:
    """Which vertices (V,) of the proxy are around a path, on its side of thin parts."""
    proxy, cell = problem.preparation.proxy, problem.preparation.spacing
    radius = one.stroke.largest_radius
    reach = max(SURROUNDINGS * radius, radius + RINGS * cell)
    distance, nearest = KDTree(one.path.points).query(proxy.vertices, distance_upper_bound=reach)
    near = np.isfinite(distance)
    upright = one.path.normals[np.where(near, nearest, 0)]
    return near & ((proxy.normals * upright).sum(axis=1) > 0)


def _normals(points: NDArray[np.float32], triangles: NDArray[np.int64]) -> NDArray[np.float32]:
    """Unit normals (N, 3) of the vertices of a mesh."""
    corners = points[triangles].astype(float)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros(points.shape)
    for corner in triangles.T:
        np.add.at(total, corner, across)
    return unit(total).astype(np.float32)
