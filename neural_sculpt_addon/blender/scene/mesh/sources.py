# SPDX-License-Identifier: GPL-3.0-or-later
"""Where on one mesh the vertices, faces and corners of another take their values from.

Vertices and corners take them from the closest point of the surface, each face from the face that
is nearest to its middle. All corners of a face take theirs from the same side of a seam, where
values jump, as that nearest face, so no face spans a seam. What is the same in both meshes keeps
its values bit for bit. Model space.
"""

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from bpy.types import Mesh
from numpy.typing import NDArray

from ....interaction.nearest_points import PART, Indices, search
from ....interaction.surface_walk import Seams, beside_seams, dense_samples, twins, walk
from .attributes import CORNER, FACE, POINT, AttributeLayer, Attributes
from .proxy_mesh import corners_of

Vectors = NDArray[np.float32]
Values = NDArray[Any]

VERTEX = "VERTEX"
"""Domain of values that must not be interpolated: a vertex takes those of the nearest vertex."""


@dataclass(eq=False)
class MeshSurface:
    """A mesh's triangles.

    polygons, loops: the face (T,) and the corners (T, 3) of the mesh that they are; None where the
                     mesh has these triangles for faces
    """

    positions: Vectors  # (V, 3)
    triangles: NDArray[np.int32]  # (T, 3)
    polygons: NDArray[np.int32] | None = None
    loops: NDArray[np.int32] | None = None

    @classmethod
    def of(cls, mesh: Mesh, positions: Vectors) -> "MeshSurface":
        """The surface of a mesh, with these vertices (V, 3)."""
        if len(mesh.loops) == 3 * len(mesh.polygons):
            return cls(positions, corners_of(mesh))
        mesh.calc_loop_triangles()
        flat = [np.empty(size * len(mesh.loop_triangles), np.int32) for size in (3, 1, 3)]
        for name, values in zip(("vertices", "polygon_index", "loops"), flat, strict=True):
            mesh.loop_triangles.foreach_get(name, values)
        return cls(positions, flat[0].reshape(-1, 3), flat[1], flat[2].reshape(-1, 3))

    def own(self, values: Values, domain: str) -> Values:
        """Values of the mesh for each vertex, triangle or corner of a triangle, by the domain."""
        if domain == FACE and self.polygons is not None:
            return values[self.polygons]
        if domain == CORNER and self.loops is not None:
            return values[self.loops.ravel()]
        return values


@dataclass(frozen=True)
class Places:
    """Where N values come from: each is a row of an array, or a mean of three rows.

    index:          (N,) the row of each
    rows:           (M,) which of the N are means of three rows
    among, weights: (M, 3) these three rows, and their shares
    """

    index: Indices
    rows: Indices = field(default_factory=lambda: np.empty(0, np.intp))
    among: Indices = field(default_factory=lambda: np.empty((0, 3), np.intp))
    weights: Vectors = field(default_factory=lambda: np.empty((0, 3), np.float32))

    @classmethod
    def between(
        cls, index: Indices, rows: Indices, among: Indices, weights: Vectors
    ) -> Generator[None, None, "Places"]:
        """Places of which those at `rows` (M,) are means of the three rows `among` (M, 3); made in
        steps.

        index: (N,) the row of each other place

        A mean in which one row has all the weight is that row itself.
        """
        index = index.copy()
        found, corners, kept = [rows[:0]], [among[:0]], [weights[:0]]
        for start in range(0, len(rows), PART):
            part = slice(start, start + PART)
            some, three, shares = rows[part], among[part], weights[part]
            heaviest = shares.argmax(axis=1)[:, None]
            index[some] = np.take_along_axis(three, heaviest, axis=1)[:, 0]
            is_between = shares.max(axis=1) < 1
            found.append(some[is_between])
            corners.append(three[is_between])
            kept.append(shares[is_between])
            yield
        among = np.concatenate(corners)
        yield
        return cls(index, np.concatenate(found), among, np.concatenate(kept))

    def take(self, values: Values, blends: bool) -> Generator[None, None, Values]:
        """The values (N, W), of (R, W), in steps."""
        found = values.take(self.index, axis=0)
        yield
        for start in range(0, len(self.rows) if blends else 0, PART):
            part = slice(start, start + PART)
            found[self.rows[part]] = _blended(self.weights[part], values[self.among[part]])
            yield
        return found


@dataclass(eq=False)
class Sources:
    """Where the next mesh takes its values from, found in steps.

    after, triangles: vertices (N, 3) and corners (F, 3) of the next mesh
    wanted:           for what: VERTEX, POINT, FACE, CORNER
    corners:          the places of corners, by the layer
    """

    before: MeshSurface
    after: Vectors
    triangles: NDArray[np.int32]
    wanted: frozenset[str]
    vertices: Indices = field(default_factory=lambda: np.empty(0, np.intp))  # (N,)
    places: dict[str, Places] = field(default_factory=dict)
    corners: dict[str, Places] = field(default_factory=dict)

    def steps(self, layers: Mapping[str, AttributeLayer]) -> Generator[None, None, None]:
        """Find the sources of attributes of the mesh before, in steps of some milliseconds."""
        old, wanted = self.before, self.wanted
        if wanted & {VERTEX, POINT}:
            self.vertices = yield from search(self.after, old.positions)
        if not wanted & {POINT, FACE, CORNER}:
            return
        samples = yield from dense_samples(old.positions, old.triangles, self._spacing())
        middles, _ = yield from dense_samples(self.after, self.triangles, np.inf)
        faces = samples[1][(yield from search(middles, samples[0]))]
        self.places[FACE] = Places(faces)
        if not wanted & {POINT, CORNER}:
            return
        edges = yield from twins(old.triangles)
        closest = yield from self._closest(faces, edges)
        if POINT in wanted:
            self.places[POINT] = yield from self._points(closest)
        for name, layer in layers.items():
            if layer.domain == CORNER:
                seams = Seams(old.own(layer.values, CORNER).astype(np.float32))
                self.corners[name] = yield from self._corners(closest, faces, edges, seams)

    def transfer(self, given: Attributes) -> Generator[None, None, Attributes]:
        """The attributes of the mesh before as the next one has them, in steps."""
        found = Attributes({}, given.groups, None, given.active_group, given.roles)
        for name, layer in given.layers.items():
            own = self.before.own(layer.values, layer.domain)
            places = self.corners[name] if layer.domain == CORNER else self.places[layer.domain]
            values = yield from places.take(own, layer.blends)
            found.layers[name] = AttributeLayer(layer.kind, layer.domain, values)
            yield
        if given.weights is not None:  # -1 where a vertex is in no group
            inside = (given.weights >= 0).astype(np.float32)
            share = yield from self.places[POINT].take(inside, True)
            weights = yield from self.places[POINT].take(np.maximum(given.weights, 0), True)
            found.weights = np.where(share > 0, weights, np.float32(-1))
        return found

    def is_as(self, other: "Sources") -> bool:
        """Whether the same is asked for, of the same meshes."""
        return self.wanted == other.wanted and all(
            np.array_equal(one, two)
            for one, two in (
                (self.before.positions, other.before.positions),
                (self.before.triangles, other.before.triangles),
                (self.after, other.after),
                (self.triangles, other.triangles),
            )
        )

    def _spacing(self) -> float:
        """A usual length of the next mesh's edges."""
        some = self.after[self.triangles[:: 1 + len(self.triangles) // 4096]]
        return float(np.median(np.linalg.norm(some[:, 0] - some[:, 1], axis=1)))

    def _closest(self, faces: Indices, edges: Indices) -> Generator[None, None, "_Closest"]:
        """The closest points to the vertices of all faces that have changed: each differs from the
        face of the mesh before that `faces` (F,) names for it."""
        old, same = self.before, np.empty(len(faces), bool)
        for start in range(0, len(faces), PART // 2):
            part = slice(start, start + PART // 2)
            here, there = self.after[self.triangles[part]], old.triangles[faces[part]]
            same[part] = (here == old.positions[there]).all(axis=(1, 2))
            yield
        changed = np.flatnonzero(~same)
        begin = np.full(len(self.after), -1)
        begin[self.triangles[changed].ravel()] = np.repeat(faces[changed], 3)
        vertices = np.flatnonzero(begin >= 0)
        found = yield from walk(
            self.after[vertices], begin[vertices], old.positions, old.triangles, edges
        )
        return _Closest(changed, vertices, *found)

    def _points(self, closest: "_Closest") -> Generator[None, None, Places]:
        """Places of vertices: the closest point, unless an equal vertex was there before."""
        old, rows = self.before, closest.vertices
        other = (self.after[rows] != old.positions[self.vertices[rows]]).any(axis=1)
        among = old.triangles[closest.triangle[other]]
        weights = closest.weights[other]
        return (yield from Places.between(self.vertices, rows[other], among, weights))

    def _corners(
        self, closest: "_Closest", faces: Indices, edges: Indices, seams: Seams
    ) -> Generator[None, None, Places]:
        """Places of corners: the closest point to the vertex, beside seams on the face's side."""
        old, corner = self.before, self.triangles[closest.changed].ravel()
        number = np.zeros(len(self.after), np.intp)
        number[closest.vertices] = np.arange(len(closest.vertices))
        number = number[corner]
        yield
        triangle = closest.triangle[number]
        yield
        weights = closest.weights.take(number, axis=0)
        yield
        begin = np.repeat(faces[closest.changed], 3)
        near = yield from beside_seams(old.triangles, edges, seams)
        left = np.flatnonzero(near[begin] | near[triangle])
        triangle[left], weights[left] = yield from walk(
            self.after[corner[left]], begin[left], old.positions, old.triangles, edges, seams
        )
        index, rows = _corners_of(faces).ravel(), _corners_of(closest.changed).ravel()
        yield
        among = _corners_of(triangle)
        yield
        return (yield from Places.between(index, rows, among, weights))


@dataclass(frozen=True)
class _Closest:
    """The closest points to vertices of a mesh on the surface of another.

    changed:           (C,) the faces whose vertices these are
    vertices:          (P,)
    triangle, weights: (P,), (P, 3), see `walk`
    """

    changed: Indices
    vertices: Indices
    triangle: Indices
    weights: Vectors


def _corners_of(triangles: Indices) -> Indices:
    """The numbers (T, 3) of their corners among those of all triangles."""
    return 3 * triangles[:, None] + np.arange(3)


def _blended(weights: Vectors, three: Vectors) -> Vectors:
    """Means (M, W) of three values (M, 3, W) with weights (M, 3). Three equal values stay exactly
    as they are."""
    first = three[:, 0]
    _, second, third = weights.T[:, :, None]
    return first + second * (three[:, 1] - first) + third * (three[:, 2] - first)
