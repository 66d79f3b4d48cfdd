# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of the surface, uniform by area: drawn on a proxy, then projected onto f = 0.

Model space.
"""

from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...common.progress import Check, go_on
from ..field import Field
from ..projection import project
from ..threads import in_pieces
from .proxy import Proxy


class Samples(NamedTuple):
    """Points of a surface and its unit outward normals there."""

    points: NDArray[np.float32]  # (N, 3)
    normals: NDArray[np.float32]  # (N, 3)

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Samples":
        """The chosen samples."""
        return Samples(self.points[chosen], self.normals[chosen])


class SurfaceMesh(NamedTuple):
    """Triangles (T, 3) whose corners are samples of a surface; some samples are corners of none."""

    vertices: Samples
    triangles: NDArray[np.int32]

    def where(self, chosen: NDArray[np.bool_]) -> "SurfaceMesh":
        """The chosen triangles (T,), and all vertices."""
        return SurfaceMesh(self.vertices, self.triangles[chosen])

    def points(self) -> NDArray[np.float32]:
        """The points (N, 3) that are a corner of a triangle."""
        return self.vertices.points[np.unique(self.triangles)]


def sample_surface(
    field: Field, proxy: Proxy, count: int, seed: int, check: Check = go_on
) -> Samples:
    """`count` samples of the surface f = 0 of a field whose proxy is `proxy`, uniform by area.

    check: called between pieces of the work; Cancelled when it raises that
    """
    mesh = trimesh.Trimesh(proxy.vertices, proxy.triangles, process=False)
    drawn = trimesh.sample.sample_surface(mesh, count, seed=seed)[0]

    def projected(part: slice) -> Samples:
        found = project(field, drawn[part])
        return Samples(found.points, found.normals)

    return in_pieces(projected, count, check)


def spatial_order(points: NDArray[np.floating]) -> NDArray[np.intp]:
    """The order (N,) of `points` (N, 3) in [-1, 1]^3 along Morton's curve, on which neighbours are
    near each other in space. So every k-th point in this order is a sample of the whole."""
    cells = np.clip((points + 1) * 512, 0, 1023).astype(np.int64)  # (N, 3)
    code = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= (cells[:, axis] >> bit & 1) << 3 * bit + axis
    return np.argsort(code, kind="stable")
