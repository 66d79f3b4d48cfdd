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
from functools import partial
from typing import Any, NamedTuple

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent, sub_progress
from .detail import Coefficients, Level, cells_of, centres, dilated, linear, places, spacing
from .evaluate import values, values_and_gradients
from .field import Field
from .fit_detail import COARSEST, DAMPED, EMPTY, ITERATIONS, SIDE, SLOPE, among
from .fit_report import deviation
from .mesh_cleanup import CleanMesh, clean, unit
from .mesh_distance import MeshDistance
from .pieces import components
from .projection import find_surface, project
from .proxy import extract
from .solvers.spline_system import Rows, solve_level

Array = NDArray[np.float32]

MOVED = 3e-4  # from the zero level, model units; vertices of a proxy are within 1.5e-4
FLATTEST = 0.3  # |grad f| from which on a small f is believed to be near the zero level
FINEST = 8
HELD = 2.0
"""Edge of what was moved / h of the finest level: with 1 the error is twice as large."""

KEPT = 1.5  # weight of what was not moved, where a moved vertex has 1
STEP = 0.7  # of h, between places on the way of a vertex
CELLS = 64  # of the lattice that finds pieces


class Absorbed(NamedTuple):
    """The field that has taken in its proxy, the layer that does it, and a report ready for JSON.

    error_mean, error_p95, error_max  distance of what was moved to the zero level
    normal_deg                        mean angle between its normals and those of the field, degrees
    components, seconds
    """

    field: Field
    layer: Coefficients
    report: dict[str, Any]


class _Patch(NamedTuple):
    """Vertices and curved middles of edges."""

    points: Array  # (N, 3)
    normals: Array  # (N, 3), unit
    moved: NDArray[np.bool_]  # (N,)


def absorb(
    field: Field,
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    seed: int = 0,
    progress: Progress = silent,
) -> Absorbed:
    """The `field` after its proxy became `vertices` (V, 3) and `triangles` (F, 3).

    SculptError when the proxy has left the box, has no inside, or was not moved at all.
    """
    start = time.monotonic()
    rng = np.random.default_rng(seed)
    progress(0.0, "Looking for what was moved")
    mesh = _in_place(clean(vertices, triangles))
    moved = _moved(field, mesh)
    distance = MeshDistance(mesh, rng, sub_progress(progress, 0.1, 0.3))
    patch = _patch(mesh, moved)
    levels = range(COARSEST, _finest(mesh, moved) + 1)
    progress(0.3, "Absorbing")
    rows, nodes = _rows(field, distance, mesh, patch, moved, levels, rng)
    check = partial(progress, 0.5, "Absorbing")
    layer: dict[int, Level] = {}
    for level in levels:
        layer[level] = solve_level(level, nodes[level], rows, check, ITERATIONS, DAMPED)
    done = field.plus(layer)
    report = {
        **deviation(done, patch.points[patch.moved], patch.normals[patch.moved]),
        "components": components(extract(done, CELLS, sub_progress(progress, 0.8, 1.0))),
        "seconds": time.monotonic() - start,
    }
    return Absorbed(done, layer, report)


def _in_place(mesh: CleanMesh) -> CleanMesh:
    """The mesh back where it came from, which was model space already."""
    vertices = mesh.scale * mesh.vertices + mesh.center
    if np.abs(vertices).max() > 1:
        raise SculptError(
            "The sculpted proxy leaves the box of the field. Sculpt it back to within its size, or"
            " make a new field from it (Neural Field from Mesh)."
        )
    return replace(mesh, vertices=vertices, scale=1.0, center=np.zeros(3))


def _moved(field: Field, mesh: CleanMesh) -> NDArray[np.bool_]:
    """The vertices (V,) that have left the zero level, and their neighbours."""
    moved = np.abs(values(field, mesh.vertices)) > FLATTEST * MOVED
    moved[moved] = find_surface(field, mesh.vertices[moved]).distance > MOVED
    if not moved.any():
        raise SculptError("The proxy is as the field made it; there is nothing to absorb.")
    moved[mesh.triangles[moved[mesh.triangles].any(axis=1)]] = True
    return moved


def _finest(mesh: CleanMesh, moved: NDArray[np.bool_]) -> int:
    """The finest level that edges as long as those of what was moved can hold."""
    corners = mesh.corners[moved[mesh.triangles].all(axis=1)]
    if not len(corners):
        return COARSEST
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    return int(np.clip(np.rint(np.log2(HELD / edge)), COARSEST, FINEST))


def _patch(mesh: CleanMesh, moved: NDArray[np.bool_]) -> _Patch:
    """The vertices of the mesh (V first) and the middles of its edges, bent as the normals say.

    An edge from a to b with normals n and m has its middle at (a + b) / 2 - (n (b - a) . n +
    m (a - b) . m) / 8, that of the cubic curve of Vlachos et al., "Curved PN triangles", 2001.
    """
    normals = np.nan_to_num(igl.per_vertex_normals(mesh.vertices, mesh.triangles))
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges = np.unique(edges[:, 0] * len(normals) + edges[:, 1])
    one, other = np.divmod(edges, len(normals))
    along = mesh.vertices[other] - mesh.vertices[one]  # (E, 3)
    n, m = normals[one], normals[other]
    bend = ((along * n).sum(1, keepdims=True) * n - (along * m).sum(1, keepdims=True) * m) / 8
    middles = (mesh.vertices[one] + mesh.vertices[other]) / 2 - bend
    return _Patch(
        np.concatenate([mesh.vertices, middles]).astype(np.float32),
        np.concatenate([normals, unit(n + m)]).astype(np.float32),
        np.concatenate([moved, moved[one] | moved[other]]),
    )


def _rows(
    field: Field,
    distance: MeshDistance,
    mesh: CleanMesh,
    patch: _Patch,
    moved: NDArray[np.bool_],
    levels: range,
    rng: np.random.Generator,
) -> tuple[Rows, dict[int, NDArray[np.int32]]]:
    """The equations of all levels, and the nodes of each."""
    points, normals = patch.points[patch.moved], patch.normals[patch.moved]
    new = patch.points[: len(moved)][moved]
    way = project(field, new).points - new  # to where the surface was
    longest = float(np.linalg.norm(way, axis=1).max())
    nodes, inside, empty = {}, np.zeros(len(patch.points), bool), []
    for level in levels:
        h = spacing(level)
        touched = [points]
        if level == COARSEST:
            steps = max(int(np.ceil(longest / (STEP * h))), 1)
            touched += [new + part * way for part in np.linspace(0, 1, steps + 1)]
        cells = linear(cells_of(np.concatenate(touched), level), level)
        nodes[level] = dilated(np.unique(cells), level)
        reached = dilated(nodes[level], level)
        cells = linear(cells_of(patch.points, level), level)
        inside |= among(cells, reached)
        apart = centres(places(np.setdiff1d(reached, cells), level), level)
        empty.append(apart + rng.uniform(-h / 2, h / 2, apart.shape).astype(np.float32))
    kept = patch.points[inside & ~patch.moved]

    h = spacing(levels[-1])
    side = rng.uniform(0.3, 1.5, len(points)) * rng.choice([-h, h], len(points))
    beside = points + side[:, None].astype(np.float32) * normals
    off = np.concatenate([beside, *empty])
    value = values(field, off)
    truth = distance(off.astype(float)).value
    near = moved[KDTree(mesh.vertices).query(off)[1]]
    target = np.where(near | ((truth < 0) != (value < 0)), truth, value)
    f, gradient = values_and_gradients(field, points)
    at = np.concatenate([points, kept])
    along = rng.standard_normal(at.shape, np.float32)
    along = unit(along)
    slopes = np.zeros(len(at), np.float32)
    n = len(points)
    slopes[:n] = ((normals - gradient) * along[:n]).sum(axis=1)
    targets = np.concatenate([np.zeros(n), values(field, kept), target]).astype(np.float32)
    residuals = np.concatenate([-f, np.zeros(len(kept)), target - value]).astype(np.float32)
    weights = np.repeat([1, KEPT, SIDE, EMPTY], [n, len(kept), len(beside), len(off) - len(beside)])
    rows = Rows(
        points=np.concatenate([at, off]),
        targets=targets,
        residuals=residuals,
        weights=weights.astype(np.float32),
        at=at,
        along=along,
        slopes=slopes,
        steep=np.full(len(at), SLOPE * h, np.float32),
    )
    return rows, nodes
