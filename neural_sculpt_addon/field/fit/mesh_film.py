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
from ..mesh.extraction.lattice import places, steps
from ..mesh.local_extraction import march_near

Array = NDArray[np.float64]
Cells = NDArray[np.int32]
Depth = Callable[[Array], Array]
"""How far points (N, 3) are inside (N,): from 1 on they are."""

FILM_CELLS = 256
"""Cells along each axis of the lattice on which films are found: as long as those of level 7, the
finest of the preset fine."""
WIDE = 0.05
"""Extent of an opening from which on it has a film: 1.6 cells of the coarsest level of a fit."""
MOST_RIM = 1 << 16  # cells at rims, from which on a mesh is so torn that films would take seconds
RIM_RINGS = 2  # rings of cells around the border that may hold both film and mesh
OFF_MESH = 1.0  # cells between the mesh and the middle of any other cell that holds film
GAP = 0.5  # cells between the mesh and the middle of a triangle of the film
HALVINGS = 6  # of an edge at the rim


def wide_borders(border: Array, opening: NDArray[np.int32]) -> Array:
    """Those of the edges (E, 2, 3) whose `opening` (E,) is WIDE."""
    count = int(opening.max(initial=-1)) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, opening, border.min(axis=1))
    np.maximum.at(high, opening, border.max(axis=1))
    return border[((high - low).max(axis=1) > WIDE)[opening]]


def find_film(border: Array, depth: Depth, away: Callable[[Array], Array], check: Check) -> Array:
    """The triangles (T, 3, 3) of films, counter-clockwise seen from outside.

    border: edges that one face has (E, 2, 3)
    away:   how far points (N, 3) are from the mesh (N,)
    """
    if not len(border):
        return np.empty((0, 3, 3))
    h, rim = 2 / FILM_CELLS, _cells_around(border)
    if len(rim) > MOST_RIM:
        return np.empty((0, 3, 3))

    def may_hold(middles: NDArray[np.float32]) -> NDArray[np.bool_]:
        found = (np.abs(middles) < 1).all(axis=1)
        asked = np.flatnonzero(found & ~np.isin(_places(middles) @ steps(FILM_CELLS), rim))
        found[asked] = away(middles[asked].astype(float)) > OFF_MESH * h
        return found

    def value(points: NDArray[np.float32]) -> NDArray[np.float32]:
        return (1 - depth(points.astype(float))).astype(np.float32)

    middles = _points(places(rim, FILM_CELLS).T + 0.5).astype(np.float32)
    mesh = march_near(value, middles, may_hold, FILM_CELLS, 1, check)
    vertices = mesh.vertices.astype(float)
    at_rim = np.flatnonzero(np.isin(mesh.edges // 3, rim))
    vertices[at_rim] = _on_film(mesh.edges[at_rim], depth)
    corners = vertices[mesh.triangles]
    return corners[away(corners.mean(axis=1)) > GAP * h]


def _on_film(edges: NDArray[np.int64], depth: Depth) -> Array:
    """Where `depth` is 1 (N, 3) on edges of the lattice, each named 3 * (point at its lower end) +
    axis; halved, for at the rim the winding number jumps and cannot be interpolated."""
    point, axis = np.divmod(edges, 3)
    low = _points(places(point.astype(np.int32), FILM_CELLS).T)
    way = np.eye(3)[axis] * (2 / FILM_CELLS)
    first, last = np.zeros(len(low)), np.ones(len(low))  # shares of the edge
    begins = depth(low) >= 1
    for _ in range(HALVINGS):
        middle = (first + last) / 2
        same = (depth(low + middle[:, None] * way) >= 1) == begins
        first, last = np.where(same, middle, first), np.where(same, last, middle)
    return low + ((first + last) / 2)[:, None] * way


def _cells_around(border: Array) -> Cells:
    """The cells of the lattice within RIM_RINGS of the edges (E, 2, 3), rising."""
    h = 2 / FILM_CELLS
    begin, way = border[:, 0], border[:, 1] - border[:, 0]
    parts = np.ceil(np.linalg.norm(way, axis=1) / h).astype(int) + 1  # points on each edge
    edge = np.repeat(np.arange(len(border)), parts)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts)
    points = begin[edge] + (number / parts[edge])[:, None] * way[edge]
    place = _places(points)
    cells = np.unique(place.clip(1 + RIM_RINGS, FILM_CELLS - RIM_RINGS) @ steps(FILM_CELLS))
    for step in steps(FILM_CELLS):
        cells = np.unique(cells[:, None] + step * np.arange(-RIM_RINGS, RIM_RINGS + 1))
    return cells.astype(np.int32)


def _places(points: NDArray[np.floating]) -> Cells:
    """Places (N, 3) in the ringed lattice of the cells in which points (N, 3) lie."""
    return np.floor((points + 1) * (FILM_CELLS / 2)).astype(np.int32) + 1


def _points(place: NDArray) -> Array:
    """Points (N, 3) by their place in the ringed lattice."""
    return (place - 1) * (2 / FILM_CELLS) - 1.0
