# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets made solid: the open pieces of a mesh get a thickness, closed pieces stay as they are.

Each open piece becomes a closed shell, half the thickness to either side of its faces, with a band
along its border. The shells may cut each other and themselves; the winding number tells what is
inside of their union. Model space.
"""

from dataclasses import replace

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from ..geometry import face_normals
from .mesh_cleanup import CleanMesh, placed

SMOOTHED_SHARE = 0.01  # of the trace: with less, vertices slide along nearly flat faces
LONGEST_OFFSET = 2.0  # of an offset, where faces meet at a sharp edge


def open_faces(mesh: CleanMesh) -> NDArray[np.bool_]:
    """Which faces (F,) belong to pieces with a border."""
    faces = np.asarray(igl.boundary_facets(mesh.triangles)[1])
    return np.isin(mesh.pieces, mesh.pieces[faces])


def thicken(mesh: CleanMesh, thickness: float, faces: NDArray[np.bool_] | None = None) -> CleanMesh:
    """`mesh` with open pieces that are `thickness` thick, in its model units, scaled anew.

    faces: those of the pieces that are meant (F,); without them all that have a border
    """
    is_open = open_faces(mesh) if faces is None else faces  # (F,)
    if not is_open.any():
        return mesh
    pieces = mesh.pieces[is_open]  # (S,)
    # Each piece gets vertices of its own, for it moves those that it shares in its own way.
    owned = np.stack([np.repeat(pieces, 3), mesh.triangles[is_open].ravel()], axis=1)  # (3S, 2)
    owned, names = np.unique(owned, axis=0, return_inverse=True)
    points, upper = mesh.vertices[owned[:, 1]], names.reshape(-1, 3)  # (C, 3), (S, 3)
    step = thickness / 2 * _offsets(points, upper)  # (C, 3)
    edges, rim = map(np.asarray, igl.boundary_facets(upper)[:2])
    (a, b), (low_a, low_b) = edges.T, edges.T + len(points)
    band = [np.stack([b, a, low_a], axis=1), np.stack([b, low_a, low_b], axis=1)]
    shells = np.concatenate([upper, upper[:, ::-1] + len(points), *band])
    vertices = np.concatenate([points + step, points - step, mesh.vertices])
    origin = -mesh.center / mesh.scale if mesh.keeps_origin else None
    growth, middle = placed(vertices.min(axis=0), vertices.max(axis=0), origin)
    return replace(
        mesh,
        vertices=(vertices - middle) / growth,
        triangles=np.concatenate([shells, mesh.triangles[~is_open] + 2 * len(points)]),
        pieces=np.concatenate([pieces, pieces, *[pieces[rim]] * 2, mesh.pieces[~is_open]]),
        scale=growth * mesh.scale,
        center=mesh.center + mesh.scale * middle,
        repairs={**mesh.repairs, "thickened": int(is_open.sum())},
    )


def _offsets(points: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Where each vertex goes (V, 3) so that the planes of its faces move by 1, by least squares."""
    vector = face_normals(points[faces])  # (F, 3), as long as twice the area
    size = np.linalg.norm(vector, axis=1)
    outer = vector[:, :, None] * vector[:, None] / size[:, None, None]  # (F, 3, 3)
    at = csr_matrix((np.ones(faces.size), (faces.ravel(), np.repeat(np.arange(len(faces)), 3))))
    matrix = (at @ outer.reshape(-1, 9)).reshape(-1, 3, 3)  # (V, 3, 3)
    trace, side = at @ size, at @ vector  # (V,), (V, 3)
    matrix += SMOOTHED_SHARE * trace[:, None, None] * np.eye(3)
    offset = np.linalg.solve(matrix, side[:, :, None])[:, :, 0]
    moved = np.sum(side * offset, axis=1) / trace  # of its planes, on average
    offset /= np.maximum(moved, 1e-6)[:, None]
    length = np.linalg.norm(offset, axis=1, keepdims=True)
    return offset * np.minimum(1, LONGEST_OFFSET / np.maximum(length, 1e-30))
