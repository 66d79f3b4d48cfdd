# SPDX-License-Identifier: GPL-3.0-or-later
"""Cliffs: where the displacement jumps from one point of the surface to the next.

It does at a flat end; at the rim of a profile that is not zero there; at the seam of a closed
stroke; and between two arms of a path that comes back beside itself, for the nearest place on the
path jumps there, and the modulation or the pen's pressure may differ between both arms. The wall
that opens has no samples of the surface, and no sample beside it tells of it. Edges of the proxy
do: their halves are looked at, and halves of these. A slope rises half as much along a half, and a
jump is as high as before. Model space. See docs/method.md, section 2.
"""

import math
from collections.abc import Sequence

import numpy as np

from ...common.progress import Check
from ...stroke.curve import Array
from ...stroke.displacement import displace
from ...stroke.stroke import Direction
from ..geometry import any_true, unit
from ..mesh.surface import Samples, SurfaceMesh
from ..threads import in_pieces
from .fold import CLIFF
from .folded import FINE_EDGE, SHORTEST
from .placement import PlacedStroke


def has_cliffs(placed: Sequence[PlacedStroke], mesh: SurfaceMesh, check: Check) -> bool:
    """Whether the displacement rises somewhere by more than CLIFF times the way on the mesh, along
    edges hardly longer than the shortest of `Folded`. Where the stroke is thinner than an edge is
    long, it may pass between two ends and not be seen."""
    shifts = displacements(placed, mesh.vertices, check)
    triangles = mesh.triangles[any_true(shifts.any(axis=1).take(mesh.triangles))]
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = edges[edges[:, 0] < edges[:, 1]]  # each once
    points, normals = (array[edges] for array in mesh.vertices)  # (E, 2, 3)
    shift = shifts[edges]
    stroke = placed[0].stroke
    shortest = FINE_EDGE * SHORTEST * stroke.brush.radius * stroke.largest_factor
    longest = np.linalg.norm(points[:, 1] - points[:, 0], axis=1).max(initial=0)
    for _ in range(int(math.log2(max(longest / shortest, 1)))):
        high = np.linalg.norm(shift[:, 1] - shift[:, 0], axis=1) > CLIFF * shortest
        points, normals, shift = points[high], normals[high], shift[high]
        middle = Samples(points.mean(axis=1), unit(normals.mean(axis=1)))
        between = displacements(placed, middle, check)
        first, second = (np.linalg.norm(between - shift[:, end], axis=1) for end in (0, 1))
        row, gone = np.arange(len(shift)), (first > second).astype(int)  # of the half that is left
        points[row, gone], normals[row, gone], shift[row, gone] = *middle, between
    length = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    rise = np.linalg.norm(shift[:, 1] - shift[:, 0], axis=1)
    return bool((rise > CLIFF * np.maximum(length, shortest)).any())


def displacements(placed: Sequence[PlacedStroke], surface: Samples, check: Check) -> Array:
    """By how much surface samples (N,) are displaced by that copy of a stroke which moves them
    farthest: (N, 1) along their own normals, whichever way these look, and (N, 3) where a
    cross-section moves as one."""
    width = 3 if placed[0].stroke.direction is Direction.STROKE else 1
    farthest, shifts = np.zeros(len(surface.points)), np.zeros((len(surface.points), width))
    for one in placed:
        reach = one.stroke.brush.radius * one.stroke.largest_factor
        low, high = one.path.points.min(axis=0) - reach, one.path.points.max(axis=0) + reach
        some = np.flatnonzero(((surface.points > low) & (surface.points < high)).all(axis=1))
        there = surface.where(some)

        def shift(part: slice, one: PlacedStroke = one, there: Samples = there) -> Array:
            found = displace(*one, *there.where(part))
            return found.amount[:, None] * (found.direction if width == 3 else 1)

        found = in_pieces(shift, len(some), check, light=True)
        far = np.linalg.norm(found, axis=1)
        wins = far > farthest[some]
        shifts[some[wins]], farthest[some[wins]] = found[wins], far[wins]
    return shifts
