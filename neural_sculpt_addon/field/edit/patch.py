# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of the surface that an absorbed mesh asks for. Model space. See docs/method.md,
section 6."""

from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ..fit.fit_detail import FIT_COARSEST
from ..geometry import unit
from ..mesh.edges import find_edges

Array = NDArray[np.float32]

FINEST_PATCH = 8
SHARP = 0.5
"""Cosine of the normals at the ends of an edge, 60 degrees, below which it is a crease and not what
stands for a curve: it stays straight."""

HELD = 2.0
"""Edge of what was moved / h of the finest level: with 1 the error is twice as large."""


class Patch(NamedTuple):
    """Points all over the new surface, and which of them are off the old one."""

    points: Array  # (N, 3)
    gradients: Array  # (N, 3), of what the field shall be there
    moved: NDArray[np.bool_]  # (N,)

    def where(self, chosen: NDArray[np.bool_]) -> "Patch":
        """Some of the points, `chosen` (N,)."""
        return Patch(self.points[chosen], self.gradients[chosen], self.moved[chosen])


def bent(
    vertices: NDArray[np.floating], triangles: NDArray[np.int32], moved: NDArray[np.bool_]
) -> Patch:
    """The vertices (which come first) of a mesh and the middles of its edges, bent as the normals
    say.

    An edge from a to b with normals n and m has its middle at (a + b) / 2 - (n (b - a) . n +
    m (a - b) . m) / 8, that of the cubic curve of Vlachos et al., "Curved PN triangles", 2001.
    SHARP ones stay straight, as those of a cube do.
    """
    normals = np.nan_to_num(igl.per_vertex_normals(vertices, triangles))
    one, other = find_edges(triangles)[0].T
    along = vertices[other] - vertices[one]  # (E, 3)
    n, m = normals[one], normals[other]
    smooth = (n * m).sum(1, keepdims=True) > SHARP
    middles = (vertices[one] + vertices[other]) / 2 - np.where(smooth, bend(along, n, m), 0)
    return Patch(
        np.concatenate([vertices, middles]).astype(np.float32),
        np.concatenate([normals, unit(n + m)]).astype(np.float32),
        np.concatenate([moved, moved[one] | moved[other]]),
    )


def bend(along: NDArray, n: NDArray, m: NDArray) -> NDArray:
    """How far (E, 3) the straight middles of edges `along` (E, 3) are above the bent ones, see
    `bent`; n, m: (E, 3), unit normals at both ends."""
    return ((along * n).sum(1, keepdims=True) * n - (along * m).sum(1, keepdims=True) * m) / 8


def finest_level(corners: NDArray[np.floating]) -> int:
    """The finest level that edges as long as those of triangles (F, 3, 3) can hold."""
    if not len(corners):
        return FIT_COARSEST
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    return int(np.clip(np.rint(np.log2(HELD / edge)), FIT_COARSEST, FINEST_PATCH))
