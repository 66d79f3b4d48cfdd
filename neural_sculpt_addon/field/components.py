# SPDX-License-Identifier: GPL-3.0-or-later
"""Connected components of a triangle mesh."""

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
