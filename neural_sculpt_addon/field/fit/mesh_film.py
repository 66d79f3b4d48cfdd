# SPDX-License-Identifier: GPL-3.0-or-later
"""Films: the surface across the openings of a mesh, as triangles (docs/method.md, section 5).

    border of the mesh -> cells around it -> flood along the film -> marching cubes -> triangles

In an opening the inside ends where the winding number passes its threshold, on a smooth surface
from rim to rim. With its triangles the distance is that to a closed surface, and f has somewhere to
be zero: without them the distance jumps from one sign to the other far from the mesh. Model space.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Check
from ..mesh.extraction.cells import find_near
from ..mesh.extraction.lattice import ActiveCells, corner_steps, places, steps
from ..mesh.extraction.march import march

Array = NDArray[np.float64]
Cells = NDArray[np.int32]
Depth = Callable[[Array], Array]
"""How far points (N, 3) are inside (N,): from 1 on they are."""

FILM_CELLS = 256
"""Cells along each axis of the lattice on which films are found: half as long as those of the
finest level of a fit. An opening narrower than one has no film."""
RIM_RINGS = 2  # rings of cells around the border that may hold both film and mesh
OFF_MESH = 1.0  # cells between the mesh and the middle of any other cell that holds film
OFF_RIM = 0.25  # cells between the mesh and some corner of each triangle of the film
HALVINGS = 5  # of an edge: at the rim the winding number jumps, and cannot be interpolated


def find_film(border: Array, depth: Depth, away: Callable[[Array], Array], check: Check) -> Array:
    """The triangles (T, 3, 3) of films, counter-clockwise seen from outside.

    border: edges that one face has (E, 2, 3)
    away:   how far points (N, 3) are from the mesh (N,)
    """
    if not len(border):
        return np.empty((0, 3, 3))
    h = 2 / FILM_CELLS
    rim = _cells_around(border)

    def within(cells: Cells) -> NDArray[np.bool_]:
        place = places(cells, FILM_CELLS).T
        found = ((place > 0) & (place <= FILM_CELLS)).all(axis=1)
        asked = np.flatnonzero(found & ~np.isin(cells, rim))
        found[asked] = away(_points(place[asked] + 0.5)) > OFF_MESH * h
        return found

    def value(points: NDArray[np.float32]) -> NDArray[np.float32]:
        return (1 - depth(points.astype(float))).astype(np.float32)

    middles = _points(places(rim, FILM_CELLS).T + 0.5).astype(np.float32)
    active = find_near(value, FILM_CELLS, middles, within, lambda *_: check())
    if not len(active.index):
        return np.empty((0, 3, 3))
    corners = _marched(active, within, depth)
    off = away(corners.reshape(-1, 3)).reshape(-1, 3).max(axis=1) > OFF_RIM * h
    return corners[off]


def _cells_around(border: Array) -> Cells:
    """The cells of the lattice within RIM_RINGS of the edges (E, 2, 3), rising."""
    h = 2 / FILM_CELLS
    begin, way = border[:, 0], border[:, 1] - border[:, 0]
    parts = np.ceil(np.linalg.norm(way, axis=1) / h).astype(int) + 1  # points on each edge
    edge = np.repeat(np.arange(len(border)), parts)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts)
    points = begin[edge] + (number / parts[edge])[:, None] * way[edge]
    place = np.unique(np.floor((points + 1) / h).astype(np.int32) + 1, axis=0)
    reach = np.arange(-RIM_RINGS, RIM_RINGS + 1)
    ring = np.stack(np.meshgrid(reach, reach, reach), axis=-1).reshape(-1, 3)
    place = (place[:, None] + ring).reshape(-1, 3)
    place = place[((place > 0) & (place <= FILM_CELLS)).all(axis=1)]
    return np.unique(place @ steps(FILM_CELLS)).astype(np.int32)


def _marched(
    active: ActiveCells, within: Callable[[Cells], NDArray[np.bool_]], depth: Depth
) -> Array:
    """The triangles (T, 3, 3) of active cells, their vertices where `depth` is 1."""
    owners = active.index + corner_steps(FILM_CELLS)[:, None]  # (8, A), of the cells' edges
    mesh = march(active, within(owners.ravel()).reshape(owners.shape).all(axis=0))
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    point, axis = np.divmod(mesh.edges[used], 3)
    low = _points(places(point.astype(np.int32), FILM_CELLS).T)
    way = np.eye(3)[axis] * (2 / FILM_CELLS)
    first, last = np.zeros(len(low)), np.ones(len(low))  # shares of the edge
    begins = depth(low) >= 1
    for _ in range(HALVINGS):
        middle = (first + last) / 2
        same = (depth(low + middle[:, None] * way) >= 1) == begins
        first, last = np.where(same, middle, first), np.where(same, last, middle)
    before, after = (depth(low + part[:, None] * way) - 1 for part in (first, last))
    part = first + (last - first) * before / (before - after)
    return (low + part[:, None] * way)[triangles.reshape(-1, 3)]


def _points(place: NDArray[np.number]) -> Array:
    """Points (N, 3) by their place in the ringed lattice."""
    return (place - 1) * (2 / FILM_CELLS) - 1.0
