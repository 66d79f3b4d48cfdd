# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh edits: the vertices of a triangle mesh displaced by the stroke.

    dense   the ground truth itself: what it costs, and how large it is
    coarse  a mesh decimated to the size of the network's parameters, as 3DNS and the paper have it:
            places and normals of vertices and three indices for each triangle, four bytes each

Decimation is by quadric errors (Garland and Heckbert 1997), as there; libigl's. A coarse vertex is
displaced along the mesh's own normal there. Model space.
"""

import time
from dataclasses import dataclass, field

import igl
import numpy as np

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import Proxy
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.stroke.displacement import displace
from neural_sculpt_addon.stroke.stroke import Stroke

from ..measures.ground import displaced_mesh
from ..measures.surface import MeshSurface
from .methods import Result, Scene

BYTES_OF_TRIANGLE = 24  # 24 of a vertex for every two triangles, and 12 of its own


@dataclass(frozen=True)
class Dense:
    """The ground truth."""

    name: str = "dense mesh"

    def prepare(self, scene: Scene) -> None:
        """Nothing: its mesh is the scene's."""

    def edit(self, scene: Scene, stroke: Stroke) -> Result:
        """The edit of one stroke."""
        started = time.perf_counter()
        surface = displaced_mesh(pose(scene.preparation, stroke), scene.dense)
        return Result(surface, time.perf_counter() - started)


@dataclass
class Coarse:
    """The mesh of the network's size."""

    name: str = "coarse mesh"
    _mesh: tuple[Field, MeshSurface] | None = field(default=None, repr=False)

    def prepare(self, scene: Scene) -> None:
        """Decimate the unedited surface."""
        if self._mesh is None or self._mesh[0] is not scene.field:
            size = 4 * sum(p.numel() for p in scene.field.network.parameters)
            self._mesh = scene.field, decimated(scene.dense, size)

    def edit(self, scene: Scene, stroke: Stroke) -> Result:
        """The edit of one stroke."""
        self.prepare(scene)
        assert self._mesh is not None
        before = self._mesh[1]
        normals = before.normals
        started = time.perf_counter()
        largest, moved = np.zeros(len(before.vertices)), before.vertices.copy()
        for one in pose(scene.preparation, stroke).placed:
            there = displace(*one, before.vertices, normals)
            wins = np.abs(there.amount) > largest
            way = there.amount[:, None] * there.direction
            moved[wins] = (before.vertices + way)[wins]
            largest[wins] = np.abs(there.amount)[wins]
        seconds = time.perf_counter() - started
        return Result(MeshSurface(moved, before.triangles), seconds)


def decimated(mesh: Proxy, size: int) -> MeshSurface:
    """The mesh with as many triangles as `size` bytes hold."""
    vertices = np.asfortranarray(mesh.vertices, np.float64)
    triangles = np.asfortranarray(mesh.triangles, np.int32)
    found = igl.qslim(vertices, triangles, size // BYTES_OF_TRIANGLE)
    return MeshSurface(np.ascontiguousarray(found[0]), np.ascontiguousarray(found[1], np.int64))
