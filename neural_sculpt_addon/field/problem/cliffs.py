# SPDX-License-Identifier: GPL-3.0-or-later
"""Cliffs: where the displacement jumps from one point of the surface to the next.

A flat end is one. So is the line between two arms of a path that comes back beside itself: the
nearest place on the path jumps there, and so does the displacement if the modulation differs
between both arms. The wall that opens has no samples of the surface, and no sample beside it tells
of it. Edges of the proxy do: halved time and again, what rises steadily along one halves with it,
and a jump stays. Model space. See docs/method.md, section 2.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Check
from ...stroke.curve import Array
from ...stroke.displacement import displace
from ..geometry import any_true
from ..mesh.surface import SurfaceMesh
from .copies import close
from .fold import CLIFF
from .folded import FINE_EDGE, SHORTEST
from .placement import PlacedStroke


def has_cliffs(one: PlacedStroke, mesh: SurfaceMesh, check: Check) -> bool:
    """Whether the displacement by one copy of a stroke rises somewhere by more than CLIFF times the
    way on the mesh: as of `fold.steep`, on edges as short as those of `Folded`."""
    points, normals = mesh.vertices
    near = np.flatnonzero(close(one, points, radii=1))
    shifts = np.zeros((len(points), 3))
    shifts[near] = _shift(one, points[near], normals[near])
    moves = shifts.any(axis=1)
    triangles = mesh.triangles[any_true(moves.take(mesh.triangles))]
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = edges[edges[:, 0] < edges[:, 1]]  # each once
    ends, upright, shift = points[edges].astype(float), normals[edges], shifts[edges]  # (E, 2, 3)
    shortest = FINE_EDGE * SHORTEST * one.stroke.brush.radius * one.stroke.largest_factor
    longest = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max(initial=0)
    for _ in range(int(math.log2(max(longest / shortest, 1)))):
        check()
        high = _rise(shift) > CLIFF * shortest
        ends, upright, shift = ends[high], upright[high], shift[high]
        place, normal = ends.mean(axis=1), upright.mean(axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        middle = _shift(one, place, normal)
        first, second = (np.linalg.norm(middle - shift[:, end], axis=1) for end in (0, 1))
        row, gone = np.arange(len(place)), (first > second).astype(int)  # the half that rises less
        ends[row, gone], upright[row, gone], shift[row, gone] = place, normal, middle
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return bool((_rise(shift) > CLIFF * np.maximum(length, shortest)).any())


def _shift(one: PlacedStroke, points: NDArray[np.floating], normals: NDArray[np.floating]) -> Array:
    """By what one copy of a stroke displaces surface points (N, 3) with unit `normals`."""
    found = displace(*one, points, normals)
    return found.amount[:, None] * found.direction


def _rise(shift: Array) -> Array:
    """How much displacements (E, 2, 3) differ between two ends."""
    return np.linalg.norm(shift[:, 1] - shift[:, 0], axis=1)
