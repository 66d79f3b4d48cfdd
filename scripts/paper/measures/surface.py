# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces to be compared, whatever holds them: a field or a triangle mesh. Model space."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import igl
import numpy as np
import trimesh
from numpy.typing import NDArray

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import Proxy, extract
from neural_sculpt_addon.field.projection import find_surface, project
from neural_sculpt_addon.field.threads import in_pieces

Array = NDArray[np.floating[Any]]
Inside = Callable[[Array], NDArray[np.bool_]]
"""Which of points (N, 3) lie in a region of space."""

SPARE = 1.1  # times as many samples as a region seems to need are drawn
ROUNDS = 100  # of drawing at most
SAMPLED_CELLS = 256  # per axis, of the mesh on which a field's samples are drawn


class Seen(NamedTuple):
    """A surface as seen from points (N, 3)."""

    distance: Array  # (N,), to it
    normals: Array  # (N, 3), unit, where it is nearest


class Surface(Protocol):
    """What an edit leaves."""

    @property
    def bytes(self) -> int:
        """How much has to be kept of it."""
        ...

    def see(self, points: Array) -> Seen:
        """It, as seen from `points` (N, 3)."""
        ...

    def sample(self, count: int, seed: int, inside: Inside | None = None) -> Array:
        """`count` points (count, 3), uniform by area, of its part `inside` or of all of it."""
        ...


@dataclass(frozen=True)
class MeshSurface:
    """A triangle mesh.

    Its size is counted as 3DNS counts it: places and normals of vertices as float32, and triangles
    as int32.
    """

    vertices: NDArray[np.float64]  # (V, 3)
    triangles: NDArray[np.int64]  # (F, 3)

    @property
    def bytes(self) -> int:
        """How much has to be kept of it."""
        return 4 * (6 * len(self.vertices) + 3 * len(self.triangles))

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        """Of the vertices (V, 3), unit: means of their triangles' by angle."""
        mesh = trimesh.Trimesh(self.vertices, self.triangles, process=False)
        return np.array(mesh.vertex_normals)

    @cached_property
    def _tree(self) -> Any:
        tree = igl.AABB()
        tree.init(self.vertices, self.triangles)
        return tree

    def see(self, points: Array) -> Seen:
        """Exact distances from the triangles; normals as the mesh is shaded."""
        points, tree = np.ascontiguousarray(points, float), self._tree

        def find(part: slice) -> Seen:
            found = tree.squared_distance(self.vertices, self.triangles, points[part])
            squares, face, nearest = map(np.asarray, found)
            corners = self.triangles[face]  # (n, 3)
            a, b, c = (np.ascontiguousarray(self.vertices[corners[:, k]]) for k in range(3))
            shares = np.nan_to_num(igl.barycentric_coordinates(nearest, a, b, c))
            blend = np.einsum("nc,nca->na", shares, self.normals[corners])
            length = np.linalg.norm(blend, axis=1, keepdims=True)
            return Seen(np.sqrt(np.maximum(squares, 0)), blend / np.maximum(length, 1e-12))

        return in_pieces(find, len(points), light=True)

    def sample(self, count: int, seed: int, inside: Inside | None = None) -> Array:
        """`count` points of the triangles."""
        return _drawn(self.vertices, self.triangles, count, seed, inside, lambda points: points)


@dataclass(frozen=True)
class FieldSurface:
    """The zero set of a field, and its proxy as an artist gets it."""

    field: Field
    proxy: Proxy
    bytes: int

    @cached_property
    def _fine(self) -> Proxy:
        """A finer mesh, on which samples are drawn before they are projected: slits thinner than a
        cell of the proxy are missing there."""
        return extract(self.field, SAMPLED_CELLS)

    def see(self, points: Array) -> Seen:
        """It, as Newton steps find it."""
        found = in_pieces(lambda part: find_surface(self.field, points[part]), len(points))
        return Seen(found.distance, found.normals)

    def sample(self, count: int, seed: int, inside: Inside | None = None) -> Array:
        """`count` points of the zero set."""

        def bring(points: Array) -> Array:
            return in_pieces(lambda part: project(self.field, points[part]).points, len(points))

        mesh = self._fine
        return _drawn(mesh.vertices.astype(float), mesh.triangles, count, seed, inside, bring)


def _drawn(
    vertices: Array,
    triangles: NDArray[Any],
    count: int,
    seed: int,
    inside: Inside | None,
    bring: Callable[[Array], Array],
) -> Array:
    """`count` points drawn on triangles and brought to the surface; those that are then `inside`.

    Of triangles far from the region nothing is drawn: those whose corners are all as far outside
    as the mesh's longest edges are skipped by `near`.
    """
    chosen = triangles if inside is None else triangles[_near(vertices, triangles, inside)]
    if not len(chosen):
        raise ValueError("The surface does not reach into the region.")
    mesh = trimesh.Trimesh(vertices, chosen, process=False)
    points, share = np.empty((0, 3)), 1.0
    for turn in range(ROUNDS):
        missing = int(SPARE * (count - len(points)) / share) + 16 if inside else count
        drawn = bring(trimesh.sample.sample_surface(mesh, missing, seed=seed + 1000 * turn)[0])
        kept = drawn if inside is None else drawn[inside(drawn)]
        share = max(len(kept) / len(drawn), 0.01)
        points = np.concatenate([points, kept])
        if len(points) >= count:
            return points[:count]
    raise ValueError("Hardly any of the surface lies in the region.")


def _near(vertices: Array, triangles: NDArray[Any], inside: Inside) -> NDArray[np.bool_]:
    """Which triangles (F,) have a corner, a middle of a side or their centre in the region."""
    corners = vertices[triangles]  # (F, 3, 3)
    places = [*corners.swapaxes(0, 1), corners.mean(axis=1)]
    places += [(corners[:, k] + corners[:, k - 1]) / 2 for k in range(3)]
    return np.logical_or.reduce([inside(place) for place in places])
