# SPDX-License-Identifier: GPL-3.0-or-later
"""Middles of edges: where on the surface they should be, and how far off it the edge is there.

Each edge is judged by itself, so the triangles on both sides of it see the same. Model space. See
docs/method.md, section 8.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....common.progress import Progress
from ...evaluate import values
from ...field import Field
from ...geometry import all_true, lengths
from ..proxy import BATCH
from ..quality import HIDES, may_hide
from .subdivide import Edges

OFF_MIDDLE = 0.15
"""Lengths of an edge, on both sides of its middle, where f is asked where detail may hide: a groove
may cross the edge beside it."""

JOINS = -0.6
"""Cosine of the normals at both ends, 127 degrees, below which an edge joins two sides of something
thinner than the lattice's cells: what it is split into turns over as often as not."""


class Middles(NamedTuple):
    """Where the middles of edges should be.

    points: (E, 3), near f = 0
    off:    (E,), how far the edge is off the surface there; 0 where it stays
    """

    points: NDArray[np.float32]
    off: NDArray[np.float32]


def find_middles(
    field: Field,
    vertices: NDArray[np.float32],
    normals: NDArray[np.float32],
    edges: Edges,
    limit: float,
    border_stays: bool,
    progress: Progress,
) -> Middles:
    """Where the middles of `edges` should be. The normals at their ends tell; where there may be
    detail between, of which these say nothing, f itself does, near to a distance.

    vertices, normals: (V, 3)
    limit:             how far off the surface an edge may be

    Edges on the faces of the box stay, and those that join two sides of something thin; those on
    the border, too, if it does.
    """
    low, high = (vertices.take(end, axis=0) for end in edges.ends.T)
    along, points = high - low, (low + high) / 2
    first, second = (normals.take(end, axis=0) for end in edges.ends.T)
    inner = all_true(np.abs(points) < 1)
    inner &= np.einsum("na,na->n", first, second) > JOINS
    if border_stays:
        inner &= ~edges.alone
    bend = _bend(along, first, second)
    off = lengths(bend)[:, 0] * inner
    points += bend
    straight = np.flatnonzero(inner & (off <= limit))
    length = lengths(along.take(straight, axis=0))[:, 0]
    straight = straight[may_hide(field, points.take(straight, axis=0), length / np.float32(HIDES))]
    for begin in range(0, len(straight), BATCH):
        progress(begin / len(straight), "Refining the mesh")
        part = straight[begin : begin + BATCH]
        share = np.array([0.5 - OFF_MIDDLE, 0.5 + OFF_MIDDLE], np.float32)
        places = low[part] + share[:, None, None] * along[part]  # (2, N, 3)
        value = values(field, places.reshape(-1, 3)).reshape(places.shape[:2])
        off[part] = np.maximum(off[part], np.abs(value).max(axis=0))
    return Middles(points, off)


def _bend(
    edges: NDArray[np.float32], first: NDArray[np.float32], second: NDArray[np.float32]
) -> NDArray[np.float32]:
    """From the middles of `edges` (N, 3) to those of the cubics between their ends (N, 3) that are
    across the normals there, `first` and `second` (N, 3)."""
    rise = np.einsum("na,na->n", edges, first)[:, None] * first
    fall = np.einsum("na,na->n", edges, second)[:, None] * second
    return (fall - rise) / 8
