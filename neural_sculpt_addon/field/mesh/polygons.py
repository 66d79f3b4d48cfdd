# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons as triangles: a fan for each that one covers, ears for the others.

The triangles of a fan add up to the polygon's normal, Newell's. Where one of them faces away from
it, the fan covers more than the polygon, which is concave.
"""

import numpy as np
from numpy.typing import NDArray

from .ear_clipping import clipped

BLOCK = 1 << 16  # polygons that are looked at together, so that their corners fit the cache
FACES_AWAY = 1e-6  # of the polygon's area: a triangle of less is the rounding of a straight corner
MOST_CORNERS = 30_000  # of a concave polygon: ten seconds. Of several the squares add up


def triangulated(
    vertices: NDArray[np.floating], corners: NDArray[np.int64], counts: NDArray[np.int64]
) -> NDArray[np.int64]:
    """The triangles (T, 3) of polygons of `vertices` (V, 3). Their corners (C,) stand one polygon
    after another, `counts` (F,) of them: fewer than three are no triangle, and corners that are not
    there stay. ValueError when concave polygons have too many."""
    starts = np.cumsum(counts) - counts
    parts = np.maximum(counts - 2, 0)
    rows = np.cumsum(parts) - parts  # where the triangles of each begin
    triangles = corners[_fans(starts, counts)]
    if not triangles.size or triangles.min() < 0 or triangles.max() >= len(vertices):
        return triangles
    many, squares = np.flatnonzero(counts > 3), 0
    for block in np.array_split(many, range(BLOCK, len(many), BLOCK)):
        places = ranges(rows[block], parts[block])
        bad = block[~_are_covered(vertices, triangles[places], parts[block])]
        places = ranges(rows[bad], parts[bad])
        triangles[places] = corners[_fans(starts[bad], counts[bad], 1)]  # right for quads
        bad = bad[~_are_covered(vertices, triangles[places], parts[bad])]
        squares += int((counts[bad] ** 2).sum())
        if squares > MOST_CORNERS**2:
            raise ValueError("its concave faces have too many corners; triangulate it first")
        for face in bad:
            polygon = corners[starts[face] : starts[face] + counts[face]]
            ears = polygon[clipped(vertices[polygon].astype(np.float64))]
            triangles[rows[face] : rows[face] + parts[face]] = ears
    return triangles


def ranges(firsts: NDArray[np.int64], lengths: NDArray[np.int64]) -> NDArray[np.int64]:
    """The numbers from each of `firsts` (N,) on, as many as its length, in one row."""
    ends = np.cumsum(lengths)
    return np.arange(lengths.sum()) + np.repeat(firsts - ends + lengths, lengths)


def _fans(
    starts: NDArray[np.int64], counts: NDArray[np.int64], first: int = 0
) -> NDArray[np.int64]:
    """Where in an array the corners (T, 3) of the triangles lie of polygons whose own begin at
    `starts` (F,), `counts` (F,) of them. All triangles of one share its corner `first`, 0 or 1."""
    parts = np.maximum(counts - 2, 0)
    second = ranges(starts + first + 1, parts)
    third = second + 1
    if first:
        third[np.cumsum(parts)[parts > 0] - 1] = starts[parts > 0]
    return np.stack([np.repeat(starts + first, parts), second, third], axis=1)


def _are_covered(
    vertices: NDArray[np.floating], triangles: NDArray[np.int64], parts: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether the triangles (T, 3) of each polygon, `parts` (B,) of them, all face its way."""
    if not len(parts):
        return np.ones(0, bool)
    a, b, c = (vertices[triangles[:, corner]].astype(np.float64).T for corner in range(3))  # (3, T)
    (x, y, z), (u, v, w) = b - a, c - a
    areas = np.stack([y * w - z * v, z * u - x * w, x * v - y * u])  # (3, T)
    normals = np.add.reduceat(areas, np.cumsum(parts) - parts, axis=1)  # (3, B)
    along = (areas * np.repeat(normals, parts, axis=1)).sum(axis=0)
    least = np.minimum.reduceat(along, np.cumsum(parts) - parts)
    return ~(least < -FACES_AWAY * (normals * normals).sum(axis=0))
