# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets made solid: the open pieces of a mesh get a thickness, closed pieces stay as they are.

Each open piece becomes a closed shell, half the thickness to either side along its vertex normals,
with a band along its border. The shells may cut each other and themselves; the winding number tells
what is inside of their union. Model space.
"""

from dataclasses import replace

import igl
import numpy as np

from .mesh_cleanup import LONGEST_SIDE, CleanMesh


def thicken(mesh: CleanMesh, thickness: float) -> CleanMesh:
    """`mesh` with open pieces that are `thickness` thick, in its model units, scaled anew."""
    faces = np.asarray(igl.boundary_facets(mesh.triangles)[1])
    is_open = np.isin(mesh.pieces, mesh.pieces[faces])  # (F,)
    if not is_open.any():
        return mesh
    pieces = mesh.pieces[is_open]  # (S,)
    # Each piece gets vertices of its own, for it moves those that it shares in its own way.
    owned = np.stack([np.repeat(pieces, 3), mesh.triangles[is_open].ravel()], axis=1)  # (3S, 2)
    owned, names = np.unique(owned, axis=0, return_inverse=True)
    points, upper = mesh.vertices[owned[:, 1]], names.reshape(-1, 3)  # (C, 3), (S, 3)
    step = thickness / 2 * np.nan_to_num(igl.per_vertex_normals(points, upper))  # (C, 3)
    edges, faces = map(np.asarray, igl.boundary_facets(upper)[:2])
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
