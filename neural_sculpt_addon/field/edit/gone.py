# SPDX-License-Identifier: GPL-3.0-or-later
"""Gone pieces: those of a field's surface of which an absorbed one has nothing left.

An island that was deleted, or that a Boolean takes away, leaves no vertex that tells of it: what is
there must be asked of the old surface. Model space. See docs/method.md, section 6.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Progress
from ...common.text import Text
from ..field import Field
from ..geometry import search_tree
from ..mesh.components import signed_volumes
from ..mesh.pieces import LEAST, Islands
from ..mesh.proxy import Proxy, sketch
from ..projection import project
from .absorption import Absorption
from .patch import Patch

Array = NDArray[np.float32]

CELLS, FINE_CELLS = 128, 256  # of lattices that find pieces: as of the usual proxy, and at most
NEAR = 2.0  # cells, within which a piece and one that is gone are the same on two lattices
REPAIRS = 4  # how often at most what is left of them is taken away

LEFT_OVER = Text(
    "A piece of surface is left where there should be none. Carve it away with a stroke, or make a"
    " new field of the proxy (Neural Field from Mesh)."
)


class Gone(NamedTuple):
    """The pieces that are gone, and the cells per axis of the lattice that showed the surface."""

    pieces: list[Array]  # points (K, 3) of the surface of each
    cells: int


def find_gone(field: Field, patch: Patch, cells: int, progress: Progress) -> Gone:
    """The pieces of the field's surface that have no part of a new one: the `patch` has no sample
    that has stayed there, or that was moved from there.

    cells: of the lattice that showed the surface: pieces between its points were never seen, so
           nobody has taken them away
    """
    cells = min(cells, FINE_CELLS)
    pieces = _without_part(field, patch, cells, progress)
    return Gone([project(field, piece).points for piece in pieces], cells)


def take_away(
    field: Field, solution: Absorption, patch: Patch, gone: Gone, progress: Progress
) -> tuple[int, list[Text]]:
    """Solve away pieces of surface that nobody asked for: neither a sample of the patch nor another
    piece that was there, unseen, is nearest to them. How many pieces the field has then, and what
    is to be said if one of these stays.

    Among them is what is left of `gone` pieces, which is thin.
    """
    cells = FINE_CELLS if gone.pieces else CELLS
    asked = np.concatenate([patch.points, *_unseen(field, patch, gone, cells, progress)])
    repairs = 0
    while True:
        proxy = sketch(field.plus(solution.layer), cells, progress)
        count, labels = proxy.components
        is_asked = _nearest_pieces(proxy, asked)
        if is_asked.all():
            return count, []
        if repairs == REPAIRS:
            return count, [LEFT_OVER]
        volumes = signed_volumes(proxy.vertices, proxy.triangles, labels, count)
        chosen = ~is_asked[labels]
        side = np.where(volumes > 0, LEAST, -LEAST)[labels[chosen]]
        solution.forbid(Islands(proxy.vertices[chosen], side))
        repairs += 1


def _unseen(field: Field, patch: Patch, gone: Gone, cells: int, progress: Progress) -> list[Array]:
    """The vertices (K, 3) of each piece that a lattice of so many cells shows and the one that
    showed the surface did not."""
    if cells <= gone.cells and not gone.pieces:
        return []
    reach = NEAR * 2 / cells
    return [
        piece
        for piece in _without_part(field, patch, cells, progress)
        if not any(_touch(piece, other, reach) for other in gone.pieces)
    ]


def _without_part(field: Field, patch: Patch, cells: int, progress: Progress) -> list[Array]:
    """The vertices (K, 3) of each piece of a lattice's mesh of the field that has no part of the
    patch."""
    old = sketch(field, cells, progress)
    is_left = _nearest_pieces(old, patch.points[~patch.moved])
    if not is_left.all():
        is_left |= _nearest_pieces(old, project(field, patch.points[patch.moved]).points)
    return [old.vertices[old.components.labels == piece] for piece in np.flatnonzero(~is_left)]


def _nearest_pieces(proxy: Proxy, points: Array) -> NDArray[np.bool_]:
    """Which pieces (P,) of a mesh have the vertex that is nearest to some of `points` (N, 3)."""
    count, labels = proxy.components
    found = np.zeros(count, bool)
    found[labels[search_tree(proxy.vertices).query(points)[1]]] = True
    return found


def _touch(one: Array, other: Array, reach: float) -> bool:
    """Whether some of points (N, 3) and (M, 3) are as near as that to each other."""
    return bool(np.isfinite(search_tree(one).query(other, distance_upper_bound=reach)[0]).any())
