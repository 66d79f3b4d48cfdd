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

import math
import time
from collections.abc import Callable
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
from .solvers.local import children
from .solvers.spline_system import LEAST_TOUCHED, Rows, solve_level

Array = NDArray[np.float32]

MOVED = 3e-4  # from the zero level, model units; vertices of a proxy are within 1.5e-4
FLATTEST = 0.3  # |grad f| from which on a small f is believed to be near the zero level
FINEST = 8
HELD = 2.0
"""Edge of what was moved / h of the finest level: with 1 the error is twice as large."""

LARGEST = 3
"""Level of the largest cells, for what has moved far."""

DEPTH = 2.0
"""Cells of the coarsest level that the surface may pass on its way. Finer levels could not hold
what f was deep inside beside what it shall be on the new surface: it would swing, and leave
crumbs."""

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


class Patch(NamedTuple):
    """Points all over the new surface, and which of them are off the old one."""

    points: Array  # (N, 3)
    gradients: Array  # (N, 3), of what the field shall be there
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
    moved = find_moved(field, mesh.vertices, mesh.triangles)
    distance = MeshDistance(mesh, rng, sub_progress(progress, 0.1, 0.3))
    patch = _patch(mesh, moved)

    def signed(points: Array) -> NDArray[np.float64]:
        return distance(points.astype(float)).value

    finest = _finest(mesh, moved)
    layer = solve(field, patch, signed, finest, rng, sub_progress(progress, 0.3, 0.8))
    done = field.plus(layer)
    report = measure(done, patch, sub_progress(progress, 0.8, 1.0))
    return Absorbed(done, layer, report | {"seconds": time.monotonic() - start})


def solve(
    field: Field,
    patch: Patch,
    signed: Callable[[Array], ArrayLike],
    finest: int,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Coefficients:
    """The layer that brings the zero level of a field to `patch`.

    signed: the signed distance (N,) to the new surface, at points (N, 3)
    finest: level

    Where the surface has moved far, levels coarser than usual hold the smooth rest of it.
    """
    progress(0.0, "Absorbing")
    between = _ways(field, patch.points[patch.moved])
    deepest = max(float(np.abs(values(field, between)).max()), DEPTH * spacing(COARSEST))
    coarsest = max(math.floor(math.log2(DEPTH / deepest)), LARGEST)
    if coarsest < COARSEST:
        between = _changed(field, signed)
    levels = range(coarsest, finest + 1)
    rows, nodes = _rows(field, signed, patch, levels, between, rng)
    check = partial(progress, 0.5, "Absorbing")
    layer: dict[int, Level] = {}
    for level in levels:
        damped = LEAST_TOUCHED if coarsest < COARSEST >= level else DAMPED
        layer[level] = solve_level(level, nodes[level], rows, check, ITERATIONS, damped)
    return layer


def _in_place(mesh: CleanMesh) -> CleanMesh:
    """The mesh back where it came from, which was model space already."""
    vertices = mesh.scale * mesh.vertices + mesh.center
    if np.abs(vertices).max() > 1:
        raise SculptError(
            "The sculpted proxy leaves the box of the field. Sculpt it back to within its size, or"
            " make a new field from it (Neural Field from Mesh)."
        )
    return replace(mesh, vertices=vertices, scale=1.0, center=np.zeros(3))


def find_moved(field: Field, vertices: NDArray, triangles: NDArray) -> NDArray[np.bool_]:
    """The vertices (V,) that are off the zero level, and their neighbours. SculptError when none
    is."""
    moved = np.abs(values(field, vertices)) > FLATTEST * MOVED
    moved[moved] = find_surface(field, vertices[moved]).distance > MOVED
    if not moved.any():
        raise SculptError("The proxy is as the field made it; there is nothing to absorb.")
    moved[triangles[moved[triangles].any(axis=1)]] = True
    return moved


def _ways(field: Field, points: Array) -> Array:
    """Points (K, 3) on the straight ways of `points` (N, 3) to where the surface was."""
    way = project(field, points).points - points
    longest = float(np.linalg.norm(way, axis=1).max())
    steps = max(int(np.ceil(longest / (STEP * spacing(COARSEST)))), 1)
    return np.concatenate(
        [points + np.float32(part) * way for part in np.linspace(0, 1, steps + 1)]
    )


def _finest(mesh: CleanMesh, moved: NDArray[np.bool_]) -> int:
    """The finest level that edges as long as those of what was moved can hold."""
    corners = mesh.corners[moved[mesh.triangles].all(axis=1)]
    if not len(corners):
        return COARSEST
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    return int(np.clip(np.rint(np.log2(HELD / edge)), COARSEST, FINEST))


def _patch(mesh: CleanMesh, moved: NDArray[np.bool_]) -> Patch:
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
    return Patch(
        np.concatenate([mesh.vertices, middles]).astype(np.float32),
        np.concatenate([normals, unit(n + m)]).astype(np.float32),
        np.concatenate([moved, moved[one] | moved[other]]),
    )


def _changed(field: Field, signed: Callable[[Array], ArrayLike]) -> Array:
    """The middles (K, 3) of all cells of the coarsest level that change sides."""
    axis = np.arange(spacing(COARSEST) / 2 - 1, 1, spacing(COARSEST), dtype=np.float32)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    return points[(values(field, points) < 0) != (np.asarray(signed(points)) < 0)]


def _rows(
    field: Field,
    signed: Callable[[Array], ArrayLike],
    patch: Patch,
    levels: range,
    between: Array,
    rng: np.random.Generator,
) -> tuple[Rows, dict[int, NDArray[np.int32]]]:
    """The equations of all levels, and the nodes of each."""
    points, wanted = patch.points[patch.moved], patch.gradients[patch.moved]
    nodes, inside, empty = {}, np.zeros(len(patch.points), bool), []
    for level in levels:
        h = spacing(level)
        shown = patch.moved  # and, where the largest cells reach, what has not moved
        if levels[0] < COARSEST and level < levels[-1]:
            shown = shown | inside
        touched = patch.points[shown]
        if level <= COARSEST:
            touched = np.concatenate([touched, between])
        cells = linear(cells_of(touched, level), level)
        nodes[level] = dilated(np.unique(cells), level)
        reached = dilated(nodes[level], level)
        inside |= among(linear(cells_of(patch.points, level), level), reached)
        for larger in range(level, COARSEST):  # a row in each of the usual cells
            reached = children(reached, larger)
        usual = max(level, COARSEST)
        apart = np.setdiff1d(reached, linear(cells_of(patch.points, usual), usual))
        empty.append(centres(places(apart, usual), usual))
    kept = patch.points[inside & ~patch.moved]

    h = spacing(levels[-1])
    side = rng.uniform(0.3, 1.5, len(points)) * rng.choice([-h, h], len(points))
    beside = points + side[:, None].astype(np.float32) * unit(wanted)
    off = np.concatenate([beside, *empty])
    value = values(field, off)
    truth = np.asarray(signed(off))
    near = patch.moved[KDTree(patch.points).query(off)[1]]
    target = np.where(near | ((truth < 0) != (value < 0)), truth, value)
    f, gradient = values_and_gradients(field, points)
    at = np.concatenate([points, kept])
    along = rng.standard_normal(at.shape, np.float32)
    along = unit(along)
    slopes = np.zeros(len(at), np.float32)
    n = len(points)
    slopes[:n] = ((wanted - gradient) * along[:n]).sum(axis=1)
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


def measure(field: Field, patch: Patch, progress: Progress) -> dict[str, Any]:
    """How close the zero level came to what was moved, see `Absorbed`."""
    moved = patch.moved
    return {
        **deviation(field, patch.points[moved], unit(patch.gradients[moved])),
        "components": components(extract(field, CELLS, progress)),
    }
