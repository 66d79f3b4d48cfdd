# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest points of a surface.

Newton steps along the gradient lead there where the surface is smooth. Between ridges and grooves,
where gradients turn within a step, they wander: there the mesh of the surface tells where it is
nearest, and Newton steps only take away what the mesh is off. Model space.
"""

import igl
import numpy as np
from numpy.typing import NDArray

from ..evaluate import normals
from ..field import Field
from ..projection import ARRIVED, Projection, project
from .surface import SurfaceMesh

LONGER = 1.5
"""Times the distance of the mesh, and as many edges of it, that a way to the surface may be long
before it counts as astray."""


class Nearest:
    """The part of a surface that is nearest to some points."""

    def __init__(
        self,
        field: Field,
        points: NDArray[np.floating],
        reach: float,
        mesh: SurfaceMesh | None,
    ) -> None:
        """Of the `mesh` take what lies in the box around `points` (N, 3), widened by `reach`."""
        self._field, self._tree = field, None
        if mesh is None:
            return
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        within = ((mesh.vertices.points > low) & (mesh.vertices.points < high)).all(axis=1)
        corners = mesh.triangles[within[mesh.triangles].any(axis=1)]
        if not len(corners):
            return
        some, corners = np.unique(corners, return_inverse=True)
        self._vertices = mesh.vertices.points[some].astype(float)
        self._triangles = corners.reshape(-1, 3).astype(np.int64)
        edges = self._vertices[self._triangles[:, 0]] - self._vertices[self._triangles[:, 1]]
        self._edge = float(np.linalg.norm(edges, axis=1).mean())
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._triangles)

    def find(self, points: NDArray[np.floating]) -> Projection:
        """The nearest points (N, 3) of the surface."""
        found = project(self._field, points)
        if self._tree is None:
            return found
        at = np.asarray(points, float)
        square, _, closest = self._tree.squared_distance(self._vertices, self._triangles, at)
        way = np.linalg.norm(found.points - points, axis=1)
        astray = way > 1.1 * np.sqrt(square) + 0.1 * self._edge
        astray |= found.distance > ARRIVED
        start = closest[astray].astype(np.float32)
        near = project(self._field, start, reach=self._edge / 2)
        off = np.linalg.norm(near.points - start, axis=1)
        lost = (off > self._edge / 4) | (near.distance > ARRIVED)
        near.points[lost], near.distance[lost] = start[lost], 0
        near.normals[lost] = normals(self._field, start[lost])
        for some, mine in zip(found, near, strict=True):
            some[astray] = mine
        return found
