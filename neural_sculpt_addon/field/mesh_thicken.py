# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets made solid: the open pieces of a mesh get a thickness, closed pieces stay as they are.

Each open piece becomes a closed shell, half the thickness to either side along its vertex normals,
with a band along its border. The shells may cut each other and themselves; the winding number tells
what is inside of their union. Model space.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .mesh_cleanup import LONGEST_SIDE, CleanMesh, normals

Faces = NDArray[np.int64]


def thicken(mesh: CleanMesh, thickness: float) -> CleanMesh:
    """`mesh` with open pieces that are `thickness` thick, in its model units, scaled anew."""
    _, faces = _border(mesh.triangles)
    is_open = np.isin(mesh.pieces, mesh.pieces[faces])  # (F,)
    if not is_open.any():
        return mesh
    pieces = mesh.pieces[is_open]  # (S,)
    # Each piece gets vertices of its own, for it moves those that it shares in its own way.
    owned = np.stack([np.repeat(pieces, 3), mesh.triangles[is_open].ravel()], axis=1)  # (3S, 2)
    owned, names = np.unique(owned, axis=0, return_inverse=True)
    points, upper = mesh.vertices[owned[:, 1]], names.reshape(-1, 3)  # (C, 3), (S, 3)
    step = thickness / 2 * _vertex_normals(points, upper)  # (C, 3)
    edges, faces = _border(upper)
    (a, b), (low_a, low_b) = edges.T, edges.T + len(points)
    band = [np.stack([b, a, low_a], axis=1), np.stack([b, low_a, low_b], axis=1)]
    shells = np.concatenate([upper, upper[:, ::-1] + len(points), *band])
    vertices = np.concatenate([points + step, points - step, mesh.vertices])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle, growth = (low + high) / 2, float((high - low).max()) / LONGEST_SIDE
    return replace(
        mesh,
        vertices=(vertices - middle) / growth,
        triangles=np.concatenate([shells, mesh.triangles[~is_open] + 2 * len(points)]),
        pieces=np.concatenate([pieces, pieces, *[pieces[faces]] * 2, mesh.pieces[~is_open]]),
        scale=growth * mesh.scale,
        center=mesh.center + mesh.scale * middle,
        repairs={**mesh.repairs, "thickened": int(is_open.sum())},
    )


def _border(triangles: Faces) -> tuple[Faces, Faces]:
    """The edges (B, 2) that belong to one triangle alone, as it walks them; and which it is."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)  # (3F, 2)
    _, name, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    alone = np.flatnonzero(count[name.reshape(-1)] == 1)
    return edges[alone], alone // 3


def _vertex_normals(points: NDArray[np.float64], triangles: Faces) -> NDArray[np.float64]:
    """Unit normals (V, 3), the mean of the triangles' around, weighted by area."""
    weights, corners = np.repeat(normals(points[triangles]), 3, axis=0), triangles.ravel()
    summed = [np.bincount(corners, weights[:, axis], len(points)) for axis in range(3)]
    total = np.stack(summed, axis=1)  # (V, 3)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
