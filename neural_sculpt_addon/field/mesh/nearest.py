# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest points of a surface from a line beside it.

Newton steps along the gradient lead there where the surface is smooth. Between ridges and grooves,
where gradients turn within a step, neighbours are led to different places and the line becomes a
zigzag: there the mesh tells what is nearest, and Newton steps only take away what the mesh is off.
Model space.
"""

from functools import cached_property
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ...stroke.curve import Array
from ..evaluate import normals
from ..field import Field
from ..projection import ARRIVED, Projection, project
from .surface import SurfaceMesh

LENGTHENED = 1.5
"""How much longer a step between neighbours may become before the mesh is asked. On slopes steps do
become longer, and to ask in vain takes 5 ms."""

LONGER, ASIDE = 1.1, 0.1
"""How far Newton steps may lead in all: as a multiple of the distance to the mesh, and by how many
of its edges farther. A mesh of a bent surface is off by less than the latter."""

OFF = 0.25
"""How far Newton steps may lead from a point of the mesh, in edges. Where they lead farther, as in
a fold that is finer than the mesh, the point of the mesh is taken as it is."""


class _Tree(NamedTuple):
    tree: igl.AABB
    vertices: Array  # (V, 3)
    triangles: NDArray[np.int64]  # (T, 3)
    edge: float  # their mean edge


class Nearest:
    """A surface, to be found from lines in one place."""

    def __init__(
        self, field: Field, mesh: SurfaceMesh | None, points: NDArray[np.floating], reach: float
    ) -> None:
        """Of the `mesh` only what lies in the box around `points` (N, 3), widened by `reach`, is
        taken. Without a mesh Newton steps alone find the surface."""
        self._field, self._mesh = field, mesh
        self._box = points.min(axis=0) - reach, points.max(axis=0) + reach

    def find(self, line: NDArray[np.floating]) -> Projection:
        """The nearest point of the surface from each of the line's points (N, 3)."""
        found = project(self._field, line)
        steps, led = (
            np.linalg.norm(np.diff(some, axis=0), axis=1) for some in (line, found.points)
        )
        wander = (led > LENGTHENED * steps).any() or found.distance.max() > ARRIVED
        if not wander or self._tree is None:
            return found
        tree, vertices, triangles, edge = self._tree
        at = np.asarray(line, float)
        square, _, nearest = map(np.asarray, tree.squared_distance(vertices, triangles, at))
        way = np.linalg.norm(found.points - line, axis=1)
        astray = (way > LONGER * np.sqrt(square) + ASIDE * edge) | (found.distance > ARRIVED)
        near = self._onto_surface(nearest[astray].astype(np.float32), edge)
        for some, mine in zip(found, near, strict=True):
            some[astray] = mine
        return found

    def _onto_surface(self, points: NDArray[np.float32], edge: float) -> Projection:
        """Points (N, 3) of a mesh with such edges, brought to the surface if that is close."""
        near = project(self._field, points, reach=edge / 2)
        off = np.linalg.norm(near.points - points, axis=1)
        lost = (off > OFF * edge) | (near.distance > ARRIVED)
        near.points[lost], near.distance[lost] = points[lost], 0
        near.normals[lost] = normals(self._field, points[lost])
        return near

    @cached_property
    def _tree(self) -> _Tree | None:
        """None without triangles."""
        if self._mesh is None:
            return None
        (points, _), triangles = self._mesh
        low, high = self._box
        within = ((points > low) & (points < high)).all(axis=1)
        some, corners = np.unique(triangles[within[triangles].any(axis=1)], return_inverse=True)
        if not len(some):
            return None
        vertices, triangles = points[some].astype(float), corners.reshape(-1, 3).astype(np.int64)
        edges = vertices[triangles[:, 0]] - vertices[triangles[:, 1]]
        tree = igl.AABB()
        tree.init(vertices, triangles)
        return _Tree(tree, vertices, triangles, float(np.linalg.norm(edges, axis=1).mean()))
