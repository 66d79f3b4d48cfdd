# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces of a proxy, and those that no stroke asked for.

An edit of all weights can let the field dip through zero where nobody looked: islands outside of
the shape, bubbles inside. They are pieces of the proxy that the surface asked for passes by.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from .proxy import Proxy

MATCHED = 0.25  # of the samples that a piece of its size would attract, if it were asked for


class Pieces(NamedTuple):
    """The connected pieces of a proxy."""

    total: int
    labels: NDArray[np.int32]  # (V,), the piece of each vertex


def find_pieces(proxy: Proxy) -> Pieces:
    """The connected pieces of `proxy`."""
    a, b, c = proxy.triangles.T
    edges = np.concatenate([a, b]), np.concatenate([b, c])
    size = len(proxy.vertices)
    graph = coo_array((np.ones(len(edges[0]), bool), edges), shape=(size, size))
    return Pieces(*connected_components(graph, directed=False))


def components(proxy: Proxy) -> int:
    """How many pieces a proxy has."""
    return find_pieces(proxy).total


class Islands(NamedTuple):
    """Vertices of pieces that nobody asked for, and what the field shall be there."""

    points: NDArray[np.float32]  # (N, 3)
    distance: NDArray[np.float64]  # (N,), signed, from the surface asked for


def find_islands(proxy: Proxy, asked: NDArray[np.float32]) -> Islands:
    """The islands and bubbles of `proxy`, given samples (M, 3) of the surface asked for.

    `asked` covers the surface evenly, so a piece that was asked for is the nearest to its share.
    """
    count, labels = find_pieces(proxy)
    nearest = labels[KDTree(proxy.vertices).query(asked)[1]]  # (M,)
    attracted = np.bincount(nearest, minlength=count) / len(asked)
    size = np.bincount(labels, minlength=count) / len(labels)
    spurious = attracted < MATCHED * size
    chosen = spurious[labels]
    points = proxy.vertices[chosen]
    distance = (
        KDTree(asked).query(points)[0]
        * np.where(_volumes(proxy, labels, count) > 0, 1, -1)[labels[chosen]]
    )
    return Islands(points, distance)


def _volumes(proxy: Proxy, labels: NDArray[np.int32], count: int) -> NDArray[np.float64]:
    """Signed volume of each piece (count,): negative for a bubble, whose normals point inward."""
    a, b, c = proxy.vertices[proxy.triangles].astype(float).swapaxes(0, 1)  # (F, 3) each
    tetrahedra = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    volumes = np.zeros(count)
    np.add.at(volumes, labels[proxy.triangles[:, 0]], tetrahedra)
    return volumes
