# SPDX-License-Identifier: GPL-3.0-or-later
"""Cliffs: where the displacement jumps from one point of the surface to the next.

The displacement jumps at a flat end, at the rim of a profile that is not zero there, and at the
seam of a closed stroke. It also jumps between two arms of a path that comes back beside itself: the
nearest place on the path changes there, and modulation or pressure may differ between the arms.
A wall opens there. Samples of the surface never come to it, and samples beside it do not show it.

Edges of the proxy show it when they are halved time and again. Along a slope the change of the
displacement is halved, too; across a jump it stays. Model space. See docs/method.md, section 2.
"""

import math
from collections.abc import Sequence

import numpy as np

from ...common.progress import Check
from ...stroke.curve import Array
from ...stroke.displacement import displace
from ...stroke.stroke import Direction
from ..geometry import any_true, unit
from ..mesh.edges import find_edges
from ..mesh.surface import Samples, SurfaceMesh
from ..threads import in_pieces
from .fold import CLIFF
from .folded import FINE_EDGE, SHORTEST
from .placement import PlacedStroke


def has_cliffs(placed: Sequence[PlacedStroke], mesh: SurfaceMesh, check: Check) -> bool:
    """Whether the displacement changes by more than CLIFF times the length of an edge somewhere on
    the mesh, after edges were halved until they are about as short as those of `Folded`. A stroke
    thinner than an edge is long may pass between its ends and not be seen."""
    shifts = displacements(placed, mesh.vertices, check)
    triangles = mesh.triangles[any_true(shifts.any(axis=1).take(mesh.triangles))]
    edges, _ = find_edges(triangles)
    points, normals = (array[edges] for array in mesh.vertices)  # (E, 2, 3)
    shift = shifts[edges]
    stroke = placed[0].stroke
    shortest = FINE_EDGE * SHORTEST * stroke.largest_radius
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
    """Displacements of surface samples (N,), each by the copy that moves it farthest: signed
    lengths (N, 1) along their own normals, or vectors (N, 3) where a cross-section moves as one."""
    width = 3 if placed[0].stroke.direction is Direction.STROKE else 1
    farthest, shifts = np.zeros(len(surface.points)), np.zeros((len(surface.points), width))
    for one in placed:
        low, high = one.path.box(one.stroke.largest_radius)
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
