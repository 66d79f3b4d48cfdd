# SPDX-License-Identifier: GPL-3.0-or-later
"""Connected components of a triangle mesh, and what they enclose."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


class Components(NamedTuple):
    """The connected components of a mesh."""

    total: int
    labels: NDArray[np.int32]  # (V,), the component of each vertex


def find_components(triangles: NDArray[np.int32], vertices: int) -> Components:
    """The components of `triangles` (F, 3) among so many vertices."""
    a, b, c = triangles.T
    edges = np.concatenate([a, b]), np.concatenate([b, c])
    graph = coo_array((np.ones(len(edges[0]), bool), edges), shape=(vertices, vertices))
    return Components(*connected_components(graph, directed=False))


def signed_volumes(
    vertices: NDArray[np.float32],
    triangles: NDArray[np.int32],
    labels: NDArray[np.int32],
    count: int,
) -> NDArray[np.float64]:
    """Signed volume of each of `count` components (count,): negative where normals point inward."""
    a, b, c = vertices[triangles].astype(float).swapaxes(0, 1)  # (F, 3) each
    tetrahedra = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    volumes = np.zeros(count)
    np.add.at(volumes, labels[triangles[:, 0]], tetrahedra)
    return volumes
