# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks, face sets and what is hidden, carried from a proxy to the one that takes its place.

Each vertex gets the mask of the nearest one before, each face what the nearest face had. What a
stroke has left alone is the same in both, and keeps its values exactly, however often it happens.
Model space.
"""

from collections.abc import Callable

import numpy as np
from bpy.types import Mesh
from numpy.typing import NDArray

from . import brush_attributes
from .brush_attributes import FACE_SET, HIDDEN_EDGE, HIDDEN_FACE, HIDDEN_VERTEX, MASK
from .nearest import nearest
from .proxy_mesh import Geometry, corners_of

Vectors = NDArray[np.float32]


def carried(
    mesh: Mesh, positions: Callable[[], Vectors], new: Geometry
) -> dict[str, NDArray[np.generic]]:
    """The attributes of the mesh as `new` will have them, without those that say nothing.

    positions: tells the vertices (V, 3) of the mesh, if they are needed
    """
    painted = {name: values for name, values in brush_attributes.read(mesh).items() if values.any()}
    if not painted or not len(new.corners) or not len(mesh.polygons):
        return {}
    before, after, found = positions(), new.vertices.reshape(-1, 3), {}
    if MASK in painted:
        found[MASK] = painted[MASK][nearest(after, before)]
    hidden = _hidden_faces(mesh, painted)
    if FACE_SET in painted or hidden.any():
        source = nearest(_middles(after, new.corners.reshape(-1, 3)), _faces(mesh, before))
        if FACE_SET in painted:
            found[FACE_SET] = painted[FACE_SET][source]
        if hidden.any():
            found |= _hidden(new, hidden[source])
    return found


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


def _faces(mesh: Mesh, positions: Vectors) -> Vectors:
    """The middles (F, 3) of the faces of a mesh with vertices (V, 3)."""
    if _is_triangles(mesh):
        return _middles(positions, corners_of(mesh))
    flat = np.empty(3 * len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("center", flat)
    return flat.reshape(-1, 3)


def _middles(positions: Vectors, triangles: NDArray[np.int32]) -> Vectors:
    a, b, c = (positions.take(corner, axis=0) for corner in triangles.T)
    return (a + b + c) / np.float32(3)


def _is_triangles(mesh: Mesh) -> bool:
    return len(mesh.loops) == 3 * len(mesh.polygons)
