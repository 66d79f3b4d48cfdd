# SPDX-License-Identifier: GPL-3.0-or-later
"""Local extraction: a mesh of a part of the surface, finer than the proxy, with an open rim.

In the proxy a crest that is thinner than its cells comes out as a row of teeth. Model space.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Check
from ..evaluate import values
from ..field import Field
from ..projection import ARRIVED, project
from ..threads import in_pieces
from .extraction.cells import Values, find_near
from .extraction.lattice import corner_steps, places
from .extraction.march import RawMesh, march
from .surface import Samples, SurfaceMesh


def extract_near(
    field: Field,
    points: NDArray[np.float32],
    is_near: Callable[[NDArray[np.float32]], NDArray[np.bool_]],
    cells: int,
    times: int,
    check: Check,
) -> SurfaceMesh:
    """The surface around `points` (N, 3) of it, as far as it goes on in cells that are near.

    Arguments as of `march_near`.
    """
    mesh = march_near(partial(values, field), points, is_near, cells, times, check)
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    start = mesh.vertices[used]

    def bring(part: slice) -> Samples:
        return Samples(*project(field, start[part], tolerance=ARRIVED)[:2])

    surface = in_pieces(bring, len(used), check)
    return SurfaceMesh(surface, triangles.reshape(-1, 3).astype(np.int32))


def march_near(
    value: Values,
    points: NDArray[np.float32],
    is_near: Callable[[NDArray[np.float32]], NDArray[np.bool_]],
    cells: int,
    times: int,
    check: Check,
) -> RawMesh:
    """Marching cubes where `value` is zero around `points` (N, 3), as far as that goes on in cells
    that are near.

    is_near: which cells of a coarse lattice are, by their middles (C, 3)
    cells:   of that lattice, per axis
    times:   a power of two: the mesh has so many cells along the edge of each of those

    It ends a cell of the mesh before those that are not near.
    """
    fine = cells * times
    known = np.zeros((cells + 2,) * 3, np.int8)  # 1 near, -1 not, 0 not asked yet

    def within(index: NDArray[np.int32]) -> NDArray[np.bool_]:
        place = (places(index, fine) - 1) // times + 1  # (3, I)
        new = np.unique(place[:, known[tuple(place)] == 0], axis=1)
        middles = ((new.T - 0.5) * (2 / cells) - 1).astype(np.float32)
        known[tuple(new)] = np.where(is_near(middles), 1, -1)
        return known[tuple(place)] > 0

    active = find_near(value, fine, points, within, lambda *_: check())
    beside = active.index + corner_steps(fine)[:, None]  # (8, A), own the cells' edges
    return march(active, within(beside.ravel()).reshape(beside.shape).all(axis=0))
