# SPDX-License-Identifier: GPL-3.0-or-later
"""Connected components of a triangle mesh, and the signed volume of each."""

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
    """The components of a mesh of `triangles` (F, 3) and so many `vertices`.

    A vertex of no triangle is a component of its own.
    """
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
    """Signed volume (count,) that each component encloses, in cubed units of the vertices (V, 3):
    negative where its normals point inward. Of an open one it depends on the origin.

    labels, count: (V,) and their number, as of `Components`
    """
    a, b, c = vertices[triangles].astype(float).swapaxes(0, 1)  # (F, 3) each
    tetrahedra = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    volumes = np.zeros(count)
    np.add.at(volumes, labels[triangles[:, 0]], tetrahedra)
    return volumes
