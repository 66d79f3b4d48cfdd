# SPDX-License-Identifier: GPL-3.0-or-later
"""A field takes in what was done to its proxy by other means: Blender's own sculpt brushes.

    which vertices moved -> rows: there the mesh, around it the field itself -> coefficients

Vertices of a proxy lie on the zero level, so those that have left it were moved by the artist. The
field becomes 0 on them and on the curved middles of their edges, and the mesh's signed distance
between and beside the old and the new surface; on what was not moved, and wherever that is nearer,
it keeps its value. The result is a layer: outside of its support the field does not change. A proxy
of other topology (dyntopo, remesh) has moved all over, and is absorbed as a whole. Model space.
See docs/method.md, section 6.
"""

import time
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...common.errors import SculptError
from ...common.progress import Progress, rising, silent, sub_progress
from ..evaluate import values
from ..field import Field
from ..fit.fit_report import deviation
from ..fit.mesh_cleanup import CleanMesh, clean
from ..fit.mesh_distance import MeshDistance
from ..geometry import unit
from ..levels import Coefficients
from ..projection import find_surface, project
from .absorption import Absorption
from .gone import CELLS, Gone, find_gone, take_away
from .lost import lost
from .patch import Patch, bent, finest_level

Array = NDArray[np.float32]

MOVED = 3e-4  # from the zero level, model units; vertices of a proxy are within 1.5e-4
FLATTEST = 0.3  # |grad f| from which on a small f is believed to be near the zero level


class Absorbed(NamedTuple):
    """The field that has taken in its proxy, the layer that does it, and a report ready for JSON.

    error_mean, error_p95, error_max  distance of what was moved to the zero level
    normal_deg                        mean angle between its normals and those of the field, degrees
                                      (none of these where nothing was moved, and pieces are gone)
    lost_share, worst, notes          what the field lacks of it, see `lost`
    components, seconds
    """

    field: Field
    layer: Coefficients
    report: dict[str, Any]


def absorb(
    field: Field,
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    cells: int = CELLS,
    seed: int = 0,
    progress: Progress = silent,
) -> Absorbed:
    """The `field` after its proxy, of so many `cells` per axis, became `vertices` (V, 3) and
    `triangles` (F, 3).

    SculptError when the proxy has left the box, has no inside, or is all where it was.
    """
    start = time.monotonic()
    rng = np.random.default_rng(seed)
    progress(0.0, "Looking for what was moved")
    mesh = _in_place(clean(vertices, triangles))
    moved = find_moved(field, mesh.vertices, mesh.triangles)
    distance = MeshDistance(mesh, rng, sub_progress(progress, 0.1, 0.3))
    patch = bent(mesh.vertices, mesh.triangles.astype(np.int32), moved)
    gone = find_gone(field, patch, cells, sub_progress(progress, 0.3, 0.35))
    if not moved.any() and not gone.pieces:
        raise SculptError(
            "Nothing of the proxy was moved, so there is nothing to absorb. Deleted faces come back"
            " with Remesh Proxy."
        )

    def signed(points: Array, *_: NDArray) -> NDArray[np.float64]:
        return distance(points.astype(float)).value

    finest = finest_level(mesh.corners[moved[mesh.triangles].all(axis=1)])
    share = sub_progress(progress, 0.35, 0.8)
    solution = Absorption(field, patch, signed, finest, rng, share, gone=gone.pieces)
    return finished(field, solution, patch, gone, start, sub_progress(progress, 0.8, 1.0))


def finished(
    field: Field, solution: Absorption, patch: Patch, gone: Gone, start: float, progress: Progress
) -> Absorbed:
    """The `field` with a solution's layer, without what nobody asked for, and the report.

    start: of the absorption, as of `time.monotonic`
    """
    count, notes = take_away(field, solution, patch, gone, rising(progress))
    done = field.plus(solution.layer)
    report = _measure(done, patch) | {"components": count}
    if notes:
        report["notes"] = [*report.get("notes", ()), *notes]
    return Absorbed(done, solution.layer, report | {"seconds": time.monotonic() - start})


def _in_place(mesh: CleanMesh) -> CleanMesh:
    """The mesh back where it came from, which was model space already."""
    vertices = mesh.scale * mesh.vertices + mesh.center
    refuse_outside(vertices)
    return replace(mesh, vertices=vertices, scale=1.0, center=np.zeros(3))


def refuse_outside(vertices: NDArray[np.floating]) -> None:
    """SculptError when some of the vertices (V, 3) are out of the box."""
    if np.abs(vertices).max(initial=0) > 1:
        raise SculptError(
            "The sculpted proxy leaves the box of the field. Sculpt it back to within its size, or"
            " make a new field from it (Neural Field from Mesh)."
        )


def find_moved(field: Field, vertices: NDArray, triangles: NDArray) -> NDArray[np.bool_]:
    """The vertices (V,) that are off the zero level, and their neighbours."""
    moved = np.abs(values(field, vertices)) > FLATTEST * MOVED
    moved[moved] = find_surface(field, vertices[moved]).distance > MOVED
    moved[triangles[moved[triangles].any(axis=1)]] = True
    return moved


def _measure(field: Field, patch: Patch) -> dict[str, Any]:
    """How close the zero level came to what was moved, see `Absorbed`."""
    moved = patch.where(patch.moved)
    error = np.empty(0)
    measures = dict[str, Any]()
    if len(moved.points):  # else only pieces are gone
        found = project(field, moved.points)
        error = np.linalg.norm(found.points - moved.points, axis=1)
        measures = deviation(found, moved.points, unit(moved.gradients))
    return {**measures, **lost(moved.points, error)}
