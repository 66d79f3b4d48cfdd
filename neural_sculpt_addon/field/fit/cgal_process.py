# SPDX-License-Identifier: GPL-3.0-or-later
"""CGAL's cuts, in this process or, run as a script, in one of its own (see `mesh_cut`).

As a script it reads the corners from stdin and writes triangles and owners to stdout, as NumPy's
files. It imports nothing of the package, for it is run by its path.
"""

import io
import sys

import numpy as np
from igl.copyleft import cgal
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cut(corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """Triangles (P, 3, 3) that the faces (F, 3, 3) are cut into where they cross, and of which each
    is a part (P,)."""
    points, pieces, _, owners, _ = cgal.remesh_self_intersections(
        *_welded(corners), stitch_all=True
    )
    return np.asarray(points)[np.asarray(pieces)], np.asarray(owners, np.int64).ravel()


def crossings(corners: Array) -> NDArray[np.int64]:
    """The pairs (N, 2) of the faces (F, 3, 3) that cross."""
    found = cgal.remesh_self_intersections(*_welded(corners), detect_only=True)[2]
    return np.asarray(found, np.int64).reshape(-1, 2)


def _welded(corners: Array) -> tuple[Array, NDArray[np.int64]]:
    points, names = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return points, names.reshape(-1, 3).astype(np.int64)


def _main() -> None:
    made = io.BytesIO()
    for array in cut(np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False)):
        np.save(made, array, allow_pickle=False)
    sys.stdout.buffer.write(made.getbuffer())


if __name__ == "__main__":
    _main()
