# SPDX-License-Identifier: GPL-3.0-or-later
"""Seams of a mesh sewn up: where borders lie upon each other, but for rounding, they become one.

Vertices of borders that are nearly equal become one, and edges of borders on which vertices of
others lie (T-junctions) are split there. Model space.
"""

from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ...common.progress import look
from ..geometry import search_tree

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

SEAM = 2e-6  # widest seam: rounding of coordinates with six digits, or in float32
MOST_NEAR = 1 << 24  # such pairs at most: long edges amid many vertices are left as they are
AT_ONCE = 1 << 20  # pairs of an edge and a vertex near it that are looked at together


class _Border(NamedTuple):
    """Edges that one face has (E, 2), as that is wound; the faces (E,), and their third vertices
    (E,)."""

    edges: Faces
    faces: NDArray[np.int64]
    third: NDArray[np.int64]


def sew(points: Array, faces: Faces) -> tuple[Array, Faces, int]:
    """Vertices (V, 3), faces (F, 3), and at how many vertices seams were closed."""
    border = _border(faces)
    if not len(border.edges):
        return points, faces, 0
    points, faces, sewn = _merge(points, faces, border)
    for _ in range(3):  # the edges of a face, one after another
        border = _border(faces)
        faces, split = _split(points, faces, border) if len(border.edges) else (faces, 0)
        sewn += split
        if not split:
            break
    return points, faces, sewn


def _border(faces: Faces) -> _Border:
    edges, owner, opposite = (np.asarray(array) for array in igl.boundary_facets(faces))
    owner = owner.ravel()
    return _Border(edges.reshape(-1, 2), owner, faces[owner, opposite.ravel()])


def _merge(points: Array, faces: Faces, border: _Border) -> tuple[Array, Faces, int]:
    """One vertex, their mean, for those of the border within `SEAM` of each other."""
    rim = np.unique(border.edges)
    pairs = search_tree(points[rim]).query_pairs(SEAM, output_type="ndarray")
    if not len(pairs):
        return points, faces, 0
    links = csr_matrix((np.ones(len(pairs)), rim[pairs].T), (len(points), len(points)))
    count, name = connected_components(links, directed=False)
    size = np.bincount(name)
    mean = np.stack([np.bincount(name, axis) / size for axis in points.T], axis=1)
    a, b, c = (faces := name.astype(np.int64)[faces]).T
    return mean, faces[(a != b) & (b != c) & (c != a)], len(points) - count


def _split(points: Array, faces: Faces, border: _Border) -> tuple[Faces, int]:
    """Faces split at the vertices that lie on an edge of theirs, one edge of each; how many lie."""
    edge, vertex, along = _on_edges(points, border)
    first = np.full(len(faces), len(border.edges))
    np.minimum.at(first, border.faces[edge], edge)
    chosen = first[border.faces[edge]] == edge
    edge, vertex, along = edge[chosen], vertex[chosen], along[chosen]
    if not len(edge):
        return faces, 0
    order = np.lexsort([along, edge])
    edge, vertex = edge[order], vertex[order]
    starts = np.flatnonzero(np.diff(edge, prepend=-1))
    ends = np.append(starts[1:], len(edge)) - 1
    a, b = border.edges[edge[starts]].T
    begin = np.insert(vertex, starts, a)  # of the parts of each edge
    end = np.insert(vertex, ends + 1, b)
    third = border.third[np.insert(edge, starts, edge[starts])]
    parts = np.stack([begin, end, third], axis=1)
    kept = np.delete(faces, border.faces[edge[starts]], axis=0)
    return np.concatenate([kept, parts]), len(edge)


def _on_edges(points: Array, border: _Border) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Which edges of the border have vertices of it between their ends: the edges (N,), the
    vertices (N,), and how far along (N,)."""
    rim = np.unique(border.edges)
    tree = search_tree(points[rim])
    start, end = np.moveaxis(points[border.edges], 1, 0)
    middle, way = (start + end) / 2, end - start
    length = np.linalg.norm(way, axis=1)
    many = tree.query_ball_point(middle, length / 2, return_length=True)  # (E,)
    order = np.argsort(many, kind="stable")
    near = np.cumsum(many[order])
    order = order[near <= MOST_NEAR]
    found = []
    for low, high in _batches(near[: len(order)]):
        look()
        part = order[low:high]
        lists = tree.query_ball_point(middle[part], length[part] / 2)
        edge = np.repeat(part, [len(one) for one in lists])
        vertex = rim[np.concatenate([np.asarray(one, np.int64) for one in lists])]
        offset = points[vertex] - start[edge]
        along = np.einsum("nd,nd->n", offset, way[edge]) / length[edge]
        beside = np.linalg.norm(offset - (along / length[edge])[:, None] * way[edge], axis=1)
        on = (beside < SEAM) & (along > SEAM) & (along < length[edge] - SEAM)
        on &= vertex != border.third[edge]
        found.append((edge[on], vertex[on], along[on]))
    edge, vertex, along = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
    return edge, vertex, along


def _batches(totals: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Ranges of what has these running totals, of `AT_ONCE` or one of them each."""
    cuts = np.searchsorted(totals, np.arange(AT_ONCE, totals[-1] + AT_ONCE + 1, AT_ONCE)) + 1
    cuts = np.unique(np.minimum(np.append(0, cuts), len(totals)))
    return list(zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))
