# SPDX-License-Identifier: GPL-3.0-or-later
"""Gone pieces: those of a field's surface of which an absorbed one has nothing left.

An island that was deleted, or that a Boolean takes away, leaves no vertex that tells of it: what is
there must be asked of the old surface. Model space. See docs/method.md, section 6.
"""

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Progress
from ...common.text import Text
from ..field import Field
from ..geometry import search_tree
from ..mesh.components import signed_volumes
from ..mesh.pieces import LEAST, Islands
from ..mesh.proxy import sketch
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


def find_gone(field: Field, patch: Patch, cells: int, progress: Progress) -> list[Array]:
    """Points (K, 3) of each piece of the field's surface that has no part of a new one: the `patch`
    has no sample that has stayed there, or that was moved from there.

    cells: of the lattice that showed the surface: pieces between its points were never seen, so
           nobody has taken them away
    """
    return [
        project(field, piece).points
        for piece in _without_part(field, patch, min(cells, FINE_CELLS), progress)
    ]


def take_away(
    field: Field, solution: Absorption, patch: Patch, gone: list[Array], progress: Progress
) -> list[Text]:
    """Solve away pieces of surface that nobody asked for: neither a sample of the patch nor another
    piece that was there, unseen, is nearest to them. What is to be said if some of it stays.

    Among them is what is left of `gone` pieces, which is thin.
    """
    cells = FINE_CELLS if gone else CELLS
    unseen = [
        piece
        for piece in _without_part(field, patch, cells, progress)
        if not any(_touch(piece, other, NEAR * 2 / cells) for other in gone)
    ]
    asked = np.concatenate([patch.points, *unseen])
    for repairs in range(REPAIRS + 1):
        proxy = sketch(field.plus(solution.layer), cells, progress)
        count, labels = proxy.components
        is_asked = np.zeros(count, bool)
        is_asked[labels[search_tree(proxy.vertices).query(asked)[1]]] = True
        if is_asked.all():
            return []
        if repairs < REPAIRS:
            volumes = signed_volumes(proxy.vertices, proxy.triangles, labels, count)
            chosen = ~is_asked[labels]
            side = np.where(volumes > 0, LEAST, -LEAST)[labels[chosen]]
            solution.forbid(Islands(proxy.vertices[chosen], side))
    return [LEFT_OVER]


def _without_part(field: Field, patch: Patch, cells: int, progress: Progress) -> list[Array]:
    """The vertices (K, 3) of each piece of a lattice's mesh of the field that has no part of the
    patch."""
    old = sketch(field, cells, progress)
    count, labels = old.components
    tree = search_tree(old.vertices)
    is_left = np.zeros(count, bool)
    is_left[labels[tree.query(patch.points[~patch.moved])[1]]] = True
    if not is_left.all():
        origins = project(field, patch.points[patch.moved]).points
        is_left[labels[tree.query(origins)[1]]] = True
    return [old.vertices[labels == piece] for piece in np.flatnonzero(~is_left)]


def _touch(one: Array, other: Array, reach: float) -> bool:
    """Whether some of points (N, 3) and (M, 3) are as near as that to each other."""
    return bool(np.isfinite(search_tree(one).query(other, distance_upper_bound=reach)[0]).any())
