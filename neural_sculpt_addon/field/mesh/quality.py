# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality of triangles: which are thin, or look the other way than the surface. Model space."""

import numpy as np
from numpy.typing import NDArray

from ..evaluate import values_and_gradients
from ..field import Field
from ..geometry import lengths
from ..levels import spacing

POOR = 0.25
"""Quality below which a triangle is poor: angles of some 8 degrees. 1 is equilateral."""

LEANS = 0.9
"""Cosine between a triangle and the surface at a corner, 26 degrees, below which the field is asked
which way the triangle looks: to ask about all takes ten times as many questions."""

HIDES = 1.5
"""Length of an edge, in cells of a level, above which the level's detail may hide between its ends:
to ask about all that are longer than a cell takes twice as many places, and finds 2 % more edges
that are off."""

AGREES, ENGULFS = 0.97, 3.0
"""A triangle that leans less is asked about, too, if its longest edge has so many cells of a level
of detail that is there: HIDES if it leans more than 14 degrees, ENGULFS if it does not. Of
seven million triangles fifteen were turned over by what lay between their corners, all of these."""

NOT_ZERO = np.float32(1e-30)


def shapes(
    a: NDArray[np.float32], b: NDArray[np.float32], c: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Vectors (F, 3) across triangles by their corners (F, 3), twice as long as they have area, and
    their qualities (F,), 1 of an equilateral one and 0 of one without area."""
    across = np.cross(b - a, c - a)
    squares = sum(np.einsum("fa,fa->f", edge, edge) for edge in (b - a, c - b, a - c))
    return across, 2 * np.sqrt(np.float32(3)) * lengths(across)[:, 0] / np.maximum(
        squares, NOT_ZERO
    )


def facing(
    field: Field,
    a: NDArray[np.float32],
    b: NDArray[np.float32],
    c: NDArray[np.float32],
    across: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Cosines (F,) between triangles and the field in their middles: below 0 one is turned over.

    across: (F, 3), see `shapes`
    """
    _, gradient = values_and_gradients(field, (a + b + c) / 3)
    size = np.maximum(lengths(across) * lengths(gradient), NOT_ZERO)[:, 0]
    return np.einsum("fa,fa->f", across, gradient) / size


def find_poor(
    field: Field,
    triangles: NDArray[np.int32],
    vertices: NDArray[np.float32],
    normals: NDArray[np.float32],
) -> NDArray[np.bool_]:
    """Which triangles (F,) are thin or turned over: against the normals of their corners, or
    against the field in their middle.

    vertices, normals: (V, 3)
    """
    a, b, c = (vertices.take(corner, axis=0) for corner in triangles.T)
    at_corners = tuple(normals.take(corner, axis=0) for corner in triangles.T)
    across, quality = shapes(a, b, c)
    poor = (quality < POOR) | (np.einsum("fa,fa->f", across, sum(at_corners)) <= 0)
    asked = np.flatnonzero(find_doubtful(field, (a, b, c), at_corners, across) & ~poor)
    a, b, c, across = (each.take(asked, axis=0) for each in (a, b, c, across))
    poor[asked] = facing(field, a, b, c, across) < 0
    return poor


def find_doubtful(
    field: Field,
    corners: tuple[NDArray[np.float32], ...],
    normals: tuple[NDArray[np.float32], ...],
    across: NDArray[np.float32],
) -> NDArray[np.bool_]:
    """Which triangles (F,) may be turned over: those that lean away from the surface at a corner,
    and those so large that detail may lie between their corners.

    corners, normals: of the three corners, (F, 3) each
    across:           (F, 3), see `shapes`
    """
    sides = [np.einsum("fa,fa->f", across, normal) for normal in normals]
    lean = np.minimum.reduce(sides) / np.maximum(lengths(across)[:, 0], NOT_ZERO)
    doubtful = lean < LEANS
    others = np.flatnonzero(~doubtful)
    a, b, c = (corner.take(others, axis=0) for corner in corners)
    squares = [np.einsum("fa,fa->f", edge, edge) for edge in (b - a, c - b, a - c)]
    longest = np.sqrt(np.maximum.reduce(squares))
    cells = np.where(lean.take(others) < AGREES, *np.array([HIDES, ENGULFS], np.float32))
    doubtful[others] = may_hide(field, (a + b + c) / 3, longest / cells)
    return doubtful


def may_hide(
    field: Field, points: NDArray[np.float32], sizes: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """Whether there is detail at `points` (N, 3) whose cells are smaller than `sizes` (N,)."""
    found = np.zeros(len(points), bool)
    for grid in field.detail.grids:
        some = np.flatnonzero((sizes > spacing(grid.level)) & ~found)
        found[some] = grid.reaches(points.take(some, axis=0))
    return found
