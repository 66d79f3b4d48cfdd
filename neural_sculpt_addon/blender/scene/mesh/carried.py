# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks, face sets and what is hidden, carried from a proxy to the one that takes its place.

Each vertex gets the mask of the nearest one before, each face what the nearest face had. What a
stroke has left alone is the same in both, and keeps its values exactly, however often it happens.
Model space.
"""

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field

import numpy as np
from bpy.types import Mesh
from numpy.typing import NDArray

from ....interaction.nearest_points import PART, Indices, search
from . import brush_attributes
from .brush_attributes import FACE_SET, HIDDEN_EDGE, HIDDEN_FACE, HIDDEN_VERTEX, MASK
from .proxy_mesh import Geometry, corners_of

Vectors = NDArray[np.float32]

BUDGET = 0.005  # seconds that `foresee` works in


@dataclass(eq=False)
class _Sources:
    """The vertex and the face of a mesh that each of the next one is nearest to, found in steps.

    before, faces:    vertices (V, 3) of the mesh, and its `_faces` when these are asked for
    after, triangles: vertices (N, 3) of the next one, and its corners (T, 3)
    """

    before: Vectors
    faces: NDArray[np.generic]
    after: Vectors
    triangles: NDArray[np.int32]
    of_vertices: bool
    of_faces: bool
    vertices: Indices = field(default_factory=lambda: np.empty(0, np.intp))  # (N,)
    middles: Indices = field(default_factory=lambda: np.empty(0, np.intp))  # (T,)

    def steps(self) -> Generator[None, None, None]:
        """Find them; rests after some milliseconds each."""
        if self.of_vertices:
            self.vertices = yield from search(self.after, self.before)
        if self.of_faces:
            old = yield from _middles(self.before, self.faces)
            new = yield from _middles(self.after, self.triangles)
            self.middles = yield from search(new, old)

    def is_as(self, other: "_Sources") -> bool:
        """Whether the same is asked for, of the same meshes."""
        return (self.of_vertices, self.of_faces) == (other.of_vertices, other.of_faces) and all(
            np.array_equal(getattr(self, name), getattr(other, name))
            for name in ("before", "faces", "after", "triangles")
        )


@dataclass(eq=False)
class _Foreseen:
    """What is found ahead of time, for the mesh `key` that will come."""

    key: Vectors
    sources: _Sources
    steps: Generator[None, None, None]
    is_whole: bool = False


_foreseen: list[_Foreseen] = []
"""One at most."""


def foresee(
    mesh: Mesh, positions: Callable[[], Vectors], vertices: Vectors, triangles: NDArray[np.int32]
) -> bool:
    """Work for a few milliseconds at what `carried` will need for a mesh that comes; whether there
    is more to do. It is told by the same array of vertices each time.

    positions:           tells the vertices (V, 3) of the mesh as it is
    vertices, triangles: (N, 3), (T, 3) of the one that comes, already looked through
    """
    ready = next((each for each in _foreseen if each.key is vertices), None)
    if ready is None or ready.is_whole:
        sources = _asked(mesh, _painted(mesh), positions, vertices, triangles)
        if sources is None or (ready is not None and ready.sources.is_as(sources)):
            return False
        _foreseen[:] = [_Foreseen(vertices, sources, sources.steps())]
        return True
    end = time.perf_counter() + BUDGET
    while not ready.is_whole and time.perf_counter() < end:
        ready.is_whole = next(ready.steps, True) is True
    return True


def forget() -> None:
    """Nothing comes any more."""
    _foreseen.clear()


def carried(
    mesh: Mesh, positions: Callable[[], Vectors], new: Geometry
) -> dict[str, NDArray[np.generic]]:
    """The attributes of the mesh as `new` will have them, without those that say nothing.

    positions: tells the vertices (V, 3) of the mesh, if they are needed

    Of a whole new mesh of 250,000 triangles it takes up to a second, unless it was foreseen.
    """
    painted, found = _painted(mesh), {}
    after, triangles = new.vertices.reshape(-1, 3), new.corners.reshape(-1, 3)
    sources = _asked(mesh, painted, positions, after, triangles)
    if sources is None:
        return {}
    ready = next((f.sources for f in _foreseen if f.is_whole and f.sources.is_as(sources)), None)
    if ready is None:
        ready = sources
        for _ in ready.steps():
            pass
    forget()
    if MASK in painted:
        found[MASK] = painted[MASK][ready.vertices]
    if FACE_SET in painted:
        found[FACE_SET] = painted[FACE_SET][ready.middles]
    if (hidden := _hidden_faces(mesh, painted)).any():
        found |= _hidden(new, hidden[ready.middles])
    return found


def _asked(
    mesh: Mesh,
    painted: dict[str, np.ndarray],
    positions: Callable[[], Vectors],
    vertices: NDArray[np.generic],
    triangles: NDArray[np.generic],
) -> _Sources | None:
    """What `carried` has to find; None when that is nothing."""
    if not painted or not len(triangles) or not len(mesh.polygons):
        return None
    of_faces = FACE_SET in painted or bool(_hidden_faces(mesh, painted).any())
    if MASK not in painted and not of_faces:
        return None
    return _Sources(
        positions(),
        _faces(mesh) if of_faces else np.empty((0, 3), np.float32),
        np.ascontiguousarray(vertices, np.float32),
        np.ascontiguousarray(triangles, np.int32),
        MASK in painted,
        of_faces,
    )


def _hidden_faces(mesh: Mesh, painted: dict[str, np.ndarray]) -> NDArray[np.bool_]:
    """Which faces (F,) are hidden, or have a hidden vertex."""
    hidden = painted.get(HIDDEN_FACE, np.zeros(len(mesh.polygons), bool))
    if HIDDEN_VERTEX in painted and _is_triangles(mesh):
        hidden = hidden | painted[HIDDEN_VERTEX][corners_of(mesh)].any(axis=1)
    return hidden


def _hidden(new: Geometry, faces: NDArray[np.bool_]) -> dict[str, NDArray[np.bool_]]:
    """The attributes that hide `faces` (F,), and the vertices and edges of no other face."""
    vertices = np.ones(len(new.vertices) // 3, bool)
    edges = np.ones(len(new.edges) // 2, bool)
    vertices[new.corners.reshape(-1, 3)[~faces]] = False
    edges[new.corner_edges.reshape(-1, 3)[~faces]] = False
    return {HIDDEN_VERTEX: vertices, HIDDEN_EDGE: edges, HIDDEN_FACE: faces}


def _painted(mesh: Mesh) -> dict[str, np.ndarray]:
    """The attributes that say something."""
    return {name: values for name, values in brush_attributes.read(mesh).items() if values.any()}


def _faces(mesh: Mesh) -> NDArray[np.generic]:
    """The corners (F, 3) of triangles, or the middles (F, 3) of faces of any kind."""
    if _is_triangles(mesh):
        return corners_of(mesh)
    flat = np.empty(3 * len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("center", flat)
    return flat.reshape(-1, 3)


def _is_triangles(mesh: Mesh) -> bool:
    return len(mesh.loops) == 3 * len(mesh.polygons)


def _middles(positions: Vectors, faces: NDArray[np.generic]) -> Generator[None, None, Vectors]:
    """The middles (F, 3) of `_faces`, in steps."""
    if faces.dtype == np.float32:
        return faces.astype(np.float32)
    found = np.empty((len(faces), 3), np.float32)
    for start in range(0, len(faces), PART):
        part = slice(start, start + PART)
        a, b, c = (positions.take(corner, axis=0) for corner in faces[part].T)
        found[part] = (a + b + c) / np.float32(3)
        yield
    return found
