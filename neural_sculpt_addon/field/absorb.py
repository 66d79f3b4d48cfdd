# SPDX-License-Identifier: GPL-3.0-or-later
"""A field takes in what was done to its proxy by other means: Blender's own sculpt brushes.

    which faces moved -> samples: there the mesh's distance, elsewhere the field itself -> learn

Vertices of a proxy lie on the zero level, so those that have left it were moved by the artist. Only
around their faces does the field learn the mesh; elsewhere it keeps its own values, for a proxy is
coarser than the field, and fitting its facets everywhere would wear the field down with each use.
The network starts from what it is, so a second is enough. Model space.
"""

import time
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent, sub_progress
from .course import Course, follow
from .evaluate import values_and_gradients
from .field import Field
from .fit import one_thread
from .fit_distance import AROUND, BOX, NEAR, Learner, Samples, arranged
from .fit_report import report
from .mesh_cleanup import CleanMesh, clean
from .mesh_distance import MeshDistance
from .projection import find_surface

COURSE = Course(steps=400, batch=384, samples=40_000, rate=1.5e-4, tolerance=np.inf)
MOVED = 3e-4  # from the zero level, model units; vertices of a proxy are within 1.5e-4
NEW_SHARE, OLD_SHARE = 0.4, 0.35  # of the samples near what was moved, and near all of the mesh


class _Change(NamedTuple):
    """What became of the proxy."""

    mesh: CleanMesh
    moved: NDArray[np.bool_]  # (V,), vertices that have left the zero level, and their neighbours
    reach: float  # how far the farthest has


class Absorbed(NamedTuple):
    """The field that has taken in its proxy, and how well: see `fit_report`."""

    field: Field
    report: dict[str, Any]


def absorb(
    field: Field,
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    seed: int = 0,
    progress: Progress = silent,
) -> Absorbed:
    """The field of `network` after its proxy became `vertices` (V, 3) and `triangles` (F, 3).

    SculptError when the proxy has left the box, has no inside, or was not moved at all.
    """
    start = time.monotonic()
    rng = np.random.default_rng(seed)
    progress(0.0, "Looking for what was moved")
    change = _find_change(field, _in_place(clean(vertices, triangles)))
    distance = MeshDistance(change.mesh, rng, sub_progress(progress, 0.05, 0.1))
    with one_thread():
        samples = _sample(field, change, distance, rng, sub_progress(progress, 0.1, 0.3))
        learner = Learner(samples, field.network, COURSE.batch, seed)
        follow(learner, COURSE, sub_progress(progress, 0.3, 0.9))
        quality = report(Field(learner.network), distance, rng, sub_progress(progress, 0.9, 1.0))
    seconds = time.monotonic() - start
    return Absorbed(learner.network, quality | {"seconds": seconds})


def _in_place(mesh: CleanMesh) -> CleanMesh:
    """The mesh back where it came from, which was model space already."""
    vertices = mesh.scale * mesh.vertices + mesh.center
    if np.abs(vertices).max() > 1:
        raise SculptError(
            "The sculpted proxy leaves the box of the field. Sculpt it back to within its size, or"
            " make a new field from it (Neural Field from Mesh)."
        )
    return replace(mesh, vertices=vertices, scale=1.0, center=np.zeros(3))


def _find_change(field: Field, mesh: CleanMesh) -> _Change:
    away = find_surface(field, mesh.vertices).distance  # (V,)
    moved = away > MOVED
    if not moved.any():
        raise SculptError("The proxy is as the field made it; there is nothing to absorb.")
    moved[mesh.triangles[moved[mesh.triangles].any(axis=1)]] = True
    return _Change(mesh, moved, float(away.max()))


def _sample(
    field: Field,
    change: _Change,
    distance: MeshDistance,
    rng: np.random.Generator,
    progress: Progress,
) -> Samples:
    """The field as it shall be: the mesh's distance near what was moved, itself elsewhere."""
    count, vertices = COURSE.samples, change.mesh.vertices
    moved, still = KDTree(vertices[change.moved]), KDTree(vertices[~change.moved])
    surface = distance.surface(count, rng).points
    new = surface[moved.query(surface)[0] < still.query(surface)[0]]
    if not len(new):  # a speck that no sample met
        new = vertices[change.moved]
    new = new[rng.integers(0, len(new), int(NEW_SHARE * count))]
    near = np.concatenate([new, surface[: int(OLD_SHARE * count)]])
    spread = rng.choice([NEAR, AROUND], (len(near), 1), p=[0.75, 0.25])
    near = near + spread * rng.standard_normal(near.shape)
    rest = rng.uniform(-BOX, BOX, (count - len(near), 3))
    points = np.concatenate([near, rest]).clip(-BOX, BOX)
    value, gradient = values_and_gradients(field, points)
    # The old surface lies within `reach` of what was moved: from here it cannot be the nearest.
    learns = still.query(points)[0] + change.reach >= moved.query(points)[0]
    found = distance(points[learns], progress)
    value[learns], gradient[learns] = found.value, found.gradient
    close = np.arange(count) < len(near)
    close[learns] &= found.certain
    return arranged(points, value, gradient, close)
