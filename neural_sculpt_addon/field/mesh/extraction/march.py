# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching cubes (Lorensen and Cline 1987) on a list of active cells, all at once in NumPy.

scikit-image triangulates one cell of each sign code, once; from that table all cells get the
triangles that it would make of a dense array. Every crossed lattice edge has one owner, the active
cell at its lower end, so vertices are welded without searching.

Where the surface leaves the box, the ring's cells close it off: their vertices, the caps, are drawn
onto the box faces. All lengths in model space.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from .lattice import CORNERS, ActiveCells, places, steps

UPPER = np.array([4, 2, 1])  # the corner at the upper end of a cell's edge along each axis
TRIANGLES_PER_CELL = 5  # triangles of a cell
FROM_ENDS = 0.02  # share of its edge that a vertex keeps from the ends; it is snapped later

# Whether the cell's own edge along each axis is crossed, for each sign code: (256, 3).
CROSSED = (np.arange(256)[:, None] >> UPPER & 1) != (np.arange(256)[:, None] & 1)


@dataclass
class RawMesh:
    """A closed mesh of a lattice, whose vertices are near the surface.

    The vertices are in the order of their edges, each named 3 * (point at its lower end) + axis.
    """

    vertices: NDArray[np.float32]  # (V, 3)
    normals: NDArray[np.float32]  # (V, 3), unit, outward, rough
    triangles: NDArray[np.int32]  # (F, 3), counter-clockwise seen from outside
    edges: NDArray[np.int64]  # (V,), rising
    held: NDArray[np.bool_]  # (V, 3), coordinates that stay on their box face
    cap: NDArray[np.bool_]  # (V,)


def march(active: ActiveCells, chosen: NDArray[np.bool_] | None = None) -> RawMesh:
    """The surface within the active cells, or the triangles of the `chosen` (A,) among them."""
    codes, count = active.codes, len(active.index)
    crossed = CROSSED.take(codes, axis=0)  # (A, 3)
    vertex = np.cumsum(crossed, dtype=np.int32) - 1  # (3A,)
    triangles = _triangles(active, codes if chosen is None else codes * chosen, vertex)
    name = np.flatnonzero(crossed).astype(np.int32)  # (V,)
    owner = name // 3
    axis = name - 3 * owner
    along = 3 * np.arange(len(name)) + axis  # in an array (V, 3)

    corners = active.values.ravel()
    low, high = corners.take(owner), corners.take(UPPER.take(axis) * count + owner)
    cube = active.values.reshape(2, 2, 2, count)
    means = [np.diff(cube, axis=way).mean(axis=(0, 1, 2)) for way in range(3)]
    gradient = np.stack(means, axis=1).take(owner, axis=0)  # (V, 3), the cells' mean
    gradient.put(along, high - low)
    slopes = np.sqrt(np.einsum("va,va->v", gradient, gradient))  # (V,), per cell's edge
    normals = gradient / slopes[:, None]

    spacing = np.float32(active.spacing)
    part = np.clip(low / (low - high), FROM_ENDS, 1 - FROM_ENDS)  # (V,)
    point = active.index.take(owner)
    edges = 3 * point.astype(np.int64) + axis
    cap = find_caps(edges, active.cells)
    place = places(point, active.cells).T.copy()  # (V, 3)
    held = (place == 1) | (place == active.cells + 1)
    held.put(along, cap)
    axis_points = np.pad(np.linspace(-1, 1, active.cells + 1, dtype=np.float32), 1, "edge")
    vertices = axis_points.take(place)
    vertices.ravel()[along] += np.where(cap, 0, part * spacing)
    normals[cap] = held[cap] * vertices[cap]
    normals[cap] /= np.linalg.norm(normals[cap], axis=1, keepdims=True)
    return RawMesh(vertices, normals, triangles, edges, held, cap)


def weld_caps(mesh: RawMesh) -> RawMesh:
    """Merge the cap vertices that meet at an edge or corner of the box."""
    name = np.arange(len(mesh.vertices))  # (V,)
    cap = np.flatnonzero(mesh.cap)
    _, first, group = np.unique(mesh.vertices[cap], axis=0, return_index=True, return_inverse=True)
    name[cap] = cap[first][group.reshape(-1)]
    triangles = name[mesh.triangles]
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    used, triangles = np.unique(triangles[proper], return_inverse=True)
    return RawMesh(
        mesh.vertices[used],
        mesh.normals[used],
        triangles.reshape(-1, 3).astype(np.int32),
        mesh.edges[used],
        mesh.held[used],
        mesh.cap[used],
    )


def find_caps(edges: NDArray[np.int64], cells: int) -> NDArray[np.bool_]:
    """Which lattice edges (V,) lead from the box into the ring."""
    point, axis = np.divmod(edges, 3)
    place = point // steps(cells)[axis] % (cells + 3)
    return (place == 0) | (place == cells + 1)


def _triangles(
    active: ActiveCells, codes: NDArray[np.uint8], vertex: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Triangles (F, 3), cell by cell, given the vertices (3A,) that each cell owns."""
    count, table = triangle_table()
    counts = count.take(codes)  # (A,)
    cell = np.repeat(np.arange(len(codes), dtype=np.int32), counts)  # (F,)
    first = np.cumsum(counts, dtype=np.int32) - counts  # (A,)
    entry = np.repeat(
        TRIANGLES_PER_CELL * codes.astype(np.int32) - first, counts
    )  # (F,), of the table
    entry += np.arange(len(cell), dtype=np.int32)
    edge = table.reshape(-1, 3).take(entry, axis=0)  # (F, 3)
    corner = edge // 3
    place = places(active.index, active.cells)  # (3, A)
    place -= place.min(axis=1, initial=active.cells + 2, keepdims=True)
    shape = place.max(axis=1, initial=0) + 1
    step = np.array([shape[1] * shape[2], shape[2], 1], np.int32)
    index = step @ place  # (A,), in the box around all active cells
    row = np.empty(np.prod(shape), np.int32)  # of each active cell; of others any
    row[index] = np.arange(len(codes))
    above = (CORNERS @ step).astype(np.int32).take(corner)  # (F, 3)
    owner = row.take(index.take(cell)[:, None] + above)  # (F, 3)
    return vertex.take(3 * owner + edge - 3 * corner)


@cache
def triangle_table() -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Triangles of each sign code: how many (256,), and their edges (256, TRIANGLES_PER_CELL, 3).

    An edge is named 3 * (corner at its lower end) + axis.
    """
    count = np.zeros(256, np.int32)
    table = np.zeros((256, TRIANGLES_PER_CELL, 3), np.int32)
    for code in range(1, 255):
        cube = np.where(code >> np.arange(8) & 1, -1.0, 1.0).reshape(2, 2, 2)
        middles, triangles, _, _ = marching_cubes(cube, 0.0, method="lorensen")
        axis = np.argmax(middles == 0.5, axis=1)
        corner = np.floor(middles).astype(int) @ UPPER
        count[code] = len(triangles)
        table[code, : len(triangles)] = (3 * corner + axis)[triangles]
    return count, table
