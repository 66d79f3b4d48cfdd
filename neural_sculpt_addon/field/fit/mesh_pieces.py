# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces of the surface that a mesh bounds: what a field of it should have.

What hangs together by vertices, crosses or is partly buried in something else is one piece; the
wall of a cavity is one of its own. Scraps that bound nothing do not count. Model space.
"""

from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...common.progress import look
from ..geometry import areas, face_normals, unit
from .mesh_cleanup import CleanMesh, in_place
from .mesh_orient import BULKY
from .mesh_union import BESIDE_FACE, BOTH_INSIDE, HIDDEN
from .mesh_winding import Winding

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

BURIED_PROBES = 20_000  # faces at most that tell whether parts are buried


class Pieces(NamedTuple):
    """The pieces of a surface."""

    of_faces: Indices  # (F,), the piece of each face
    solid: NDArray[np.bool_]  # (P,), pieces that bound a solid from outside
    cavity: NDArray[np.bool_]  # (P,), walls of cavities

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Pieces that bound something (P,)."""
        return self.solid | self.cavity


def find_pieces(mesh: CleanMesh, crossing: Indices) -> Pieces:
    """The pieces of a mesh, and those of its faces that are known to cross (N, 2)."""
    parts, of_parts = np.unique(mesh.pieces, return_inverse=True)
    count = len(parts)
    volume, is_whole = _volumes(mesh, of_parts, count)
    links = [np.empty((0, 2), np.intp)]
    if count > 1:
        links += [_sharing(mesh, of_parts), of_parts[crossing].reshape(-1, 2)]
        links.append(_buried(mesh, of_parts, np.where(is_whole, volume, 0)))
    first, second = np.concatenate(links).T
    graph = coo_array((np.ones(len(first), bool), (first, second)), shape=(count, count))
    total, label = connected_components(graph, directed=False)
    solid, cavity = np.zeros(total, bool), np.zeros(total, bool)
    solid[label[is_whole & (volume > 0)]] = True
    cavity[label[is_whole & (volume < 0)]] = True
    return Pieces(label[of_parts], solid, cavity & ~solid)


def _volumes(mesh: CleanMesh, of_parts: Indices, count: int) -> tuple[Array, NDArray[np.bool_]]:
    """The signed volume of each part about its middle (P,), and whether it bounds one (P,)."""
    corners = mesh.corners
    area = areas(corners)
    whole = np.bincount(of_parts, area, count)
    weighted = area[:, None] * corners.mean(axis=1)
    sums = [np.bincount(of_parts, axis, count) for axis in weighted.T]
    middle = np.stack(sums, axis=1) / whole[:, None]  # (P, 3)
    tetrahedra = np.einsum("fi,fi->f", corners[:, 0] - middle[of_parts], face_normals(corners)) / 6
    volume: Array = np.bincount(of_parts, tetrahedra, count).astype(float)
    opened = np.zeros(count, bool)
    opened[of_parts[np.asarray(igl.boundary_facets(mesh.triangles)[1], np.intp)]] = True
    return volume, ~opened | (np.abs(volume) > BULKY * whole**1.5)


def _sharing(mesh: CleanMesh, of_parts: Indices) -> Indices:
    """Pairs of parts (N, 2) that have vertices in the same place."""
    count = int(of_parts.max()) + 1
    place = np.unique(in_place(mesh.vertices), return_inverse=True)[1].reshape(-1)[mesh.triangles]
    place, part = np.divmod(np.unique(place.ravel() * count + of_parts.repeat(3)), count)
    same = place[1:] == place[:-1]
    return np.stack([part[:-1][same], part[1:][same]], axis=1)


def boxes(corners: Array, owner: Indices, count: int) -> tuple[Array, Array]:
    """The lowest and highest coordinates (P, 3) of the corners (F, 3, 3) of each of `count` owners.

    owner: of each face (F,)
    """
    order = np.argsort(owner, kind="stable")
    some, starts = np.unique(owner[order], return_index=True)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    low[some] = np.minimum.reduceat(corners.min(axis=1)[order], starts)
    high[some] = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    return low, high


def _buried(mesh: CleanMesh, of_parts: Indices, volume: Array) -> Indices:
    """Pairs of parts (N, 2) of which the second has faces within the first, that bound nothing.

    volume: of each part, 0 when it bounds none (P,)
    """
    corners = mesh.corners
    low, high = boxes(corners, of_parts, len(volume))
    chosen = np.linspace(0, len(corners) - 1, min(len(corners), BURIED_PROBES)).astype(int)
    middle = corners[chosen].mean(axis=1)
    step = BESIDE_FACE * unit(face_normals(corners[chosen]))
    number = Winding(mesh.vertices, mesh.triangles)
    sides = number(np.concatenate([middle - step, middle + step])).reshape(2, -1)
    inner = (np.abs(sides.mean(axis=0)) > BOTH_INSIDE) & (np.abs(sides).min(axis=0) > HIDDEN)
    middle, owner = middle[inner], of_parts[chosen[inner]]
    order = np.argsort(of_parts, kind="stable")
    starts = np.searchsorted(of_parts[order], np.arange(len(volume) + 1))
    pairs = [np.empty((0, 2), np.intp)]
    for part in np.flatnonzero(volume > 0):
        look()
        near = ((middle > low[part]) & (middle < high[part])).all(axis=1) & (owner != part)
        if near.any():
            own = mesh.triangles[order[starts[part] : starts[part + 1]]]
            within = Winding(mesh.vertices, own)(middle[near]) > 0.5
            others = np.unique(owner[near][within])
            pairs.append(np.stack([np.full(len(others), part), others], axis=1))
    return np.concatenate(pairs)
