# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy: the triangle mesh that stands for a field in the scene (docs/method.md, section 8).

    active cells -> marching cubes -> tangential relaxation -> Newton steps onto f = 0 -> untangling

Marching cubes leaves some 6 % slivers, triangles below 5 degrees: moving each vertex in its tangent
plane towards the mean of its neighbours removes them. Newton steps then bring the vertices to
within 1e-5 of the surface, and the last gradients are the normals. Triangles that are turned over
then are turned back.

`extract` does so from nothing; `update` after an edit, and only in the cells that the edit reached:
nothing else of the field has changed. `sketch` stops after marching cubes.

Where the surface leaves the box [-1, 1]^3 it is closed off by flat caps on the box faces. The mesh
is always watertight and wound counter-clockwise seen from outside. All lengths in model space.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from ...common.errors import SculptError
from ...common.progress import Progress, silent, sub_progress
from ...common.text import Text
from ..evaluate import values, values_and_gradients
from ..field import Field
from ..geometry import lengths
from ..levels import SUPPORT, cells_of, cells_per_axis, centres, linear, places
from ..levels import spacing as level_spacing
from .components import Components, find_components
from .extraction.cell_update import update_cells
from .extraction.cells import find_active
from .extraction.lattice import ActiveCells, edge_centres, steps
from .extraction.march import RawMesh, march, weld_caps
from .extraction.mesh_update import update_mesh
from .extraction.specks import find_specks
from .extraction.untangle import untangle

RELAXATION = 0.7  # share of the way to the mean of the neighbours
LONGEST_STEP = 0.5  # longest Newton step, in cells
LEAST_STEP = 0.02  # a vertex that moved less, in cells, needs no further step
NEWTON_STEPS = 3
BISECTIONS = 10  # of a lattice edge, where Newton steps lose the surface
FLAT = 1e-6  # a gradient below this has no direction
ROUNDING = 1e-3  # cells; of places that are multiples of a power of two
NO_SURFACE = Text(
    "The field has no surface in its box. Undo the last stroke or choose another model."
)
FEWEST_CELLS, MOST_CELLS = 4, 1024  # per axis; the lattice of the most takes 6 GB
BATCH = 1 << 13  # vertices between two looks at `progress`; some 5 ms, in wide networks 20


@dataclass(frozen=True)
class Proxy:
    """A closed triangle mesh in model space, and what its update after an edit starts from."""

    vertices: NDArray[np.float32]  # (V, 3)
    normals: NDArray[np.float32]  # (V, 3), unit, outward: the direction of grad f
    triangles: NDArray[np.int32]  # (F, 3), counter-clockwise seen from outside
    edges: NDArray[np.int64]  # (V,), rising: the lattice edges that the vertices come from
    active: ActiveCells
    marched: RawMesh  # the same with its specks, from which an update starts

    @cached_property
    def components(self) -> Components:
        """Its connected pieces."""
        return find_components(self.triangles, len(self.vertices))


class Rough(NamedTuple):
    """What marching cubes make of a field: slivers, and vertices a little beside the surface."""

    mesh: RawMesh
    active: ActiveCells


def extract(field: Field, cells: int = 128, progress: Progress = silent) -> Proxy:
    """The surface f = 0 within [-1, 1]^3, on a lattice of `cells` cells per axis.

    SculptError when there is no surface, the field's values are not finite, or nobody could hold
    so many cells.
    """
    return finish(
        find(field, cells, sub_progress(progress, 0, 0.7)), field, sub_progress(progress, 0.7, 1)
    )


def find(field: Field, cells: int, progress: Progress = silent) -> Rough:
    """The first half of `extract`, which tells all pieces of the surface. Errors as there."""
    check_cells(cells)
    active = find_active(field, cells, sub_progress(progress, 0, 0.9))
    progress(0.9, "Meshing")
    return Rough(_mesh(active), active)


def finish(rough: Rough, field: Field, progress: Progress = silent) -> Proxy:
    """The second half, for the same field; it takes the mesh for itself."""
    mesh, active = rough
    progress(0.0, "Meshing")
    fresh = np.ones(len(mesh.vertices), bool)
    _relax(mesh, fresh, active.spacing)
    _snap(mesh, fresh, active, field, sub_progress(progress, 0.2, 0.8))
    return _untangled(mesh, fresh, active, field, sub_progress(progress, 0.8, 1))


def update(
    proxy: Proxy, field: Field, reached: NDArray[np.int32], progress: Progress = silent
) -> Proxy:
    """The proxy of `field`, which differs from the one that `proxy` shows in `reached` alone.

    reached: (S,) cells as of `levels.support`

    Errors as from `extract`.
    """
    if np.abs(proxy.vertices).max() >= 1:  # it has caps
        return extract(field, proxy.active.cells, progress)
    rough, fresh = _updated(proxy, field, reached, sub_progress(progress, 0, 0.6))
    mesh, active = rough
    if mesh.cap.any():
        return extract(field, active.cells, sub_progress(progress, 0.6, 1))
    _relax(mesh, fresh, active.spacing)
    moved = fresh | _within(mesh.vertices, reached)
    _snap(mesh, moved, active, field, sub_progress(progress, 0.7, 0.9))
    a, b, c = (mesh.vertices.take(corner, axis=0) for corner in mesh.triangles.T)
    moved[mesh.triangles[_within((a + b + c) / 3, reached)]] = True
    return _untangled(mesh, moved, active, field, sub_progress(progress, 0.9, 1))


def sketch(field: Field, cells: int, progress: Progress = silent) -> Proxy:
    """The proxy as marching cubes leave it: each vertex is on its edge of the lattice, within a
    cell of the surface, and no triangle has been improved. It tells all pieces, in half the time.

    Errors as from `extract`.
    """
    proxy = _proxy(*find(field, cells, progress))
    return _without(proxy, _find_specks(proxy, field, progress))


def update_sketch(
    proxy: Proxy, field: Field, reached: NDArray[np.int32], progress: Progress = silent
) -> Proxy:
    """As `update`, of a `sketch`."""
    if not proxy.marched.cap.any():
        rough, _ = _updated(proxy, field, reached, progress)
        if not rough.mesh.cap.any():
            proxy = _proxy(*rough)
            return _without(proxy, _find_specks(proxy, field, progress))
    return sketch(field, proxy.active.cells, progress)


def _updated(
    proxy: Proxy, field: Field, reached: NDArray[np.int32], progress: Progress
) -> tuple[Rough, NDArray[np.bool_]]:
    """What is marched after an edit, its caps not welded; which of its vertices are new (V,)."""
    known = proxy.active
    guesses = _lattice_cells(reached, known.cells)
    changed = np.isin(known.index, guesses, kind="table")
    updated = update_cells(known, changed, guesses, field, progress)
    if not len(updated.active.index):
        raise SculptError(NO_SURFACE)
    mesh, source = update_mesh(proxy.marched, known, updated)
    return Rough(mesh, updated.active), source >= len(proxy.marched.vertices)


def check_cells(cells: int) -> None:
    """Refuse a resolution that makes no proxy. SculptError."""
    if not FEWEST_CELLS <= cells <= MOST_CELLS:
        raise SculptError(
            "The resolution is {} cells per axis; choose {} to {}.", cells, FEWEST_CELLS, MOST_CELLS
        )


def _mesh(active: ActiveCells) -> RawMesh:
    if not len(active.index):
        raise SculptError(NO_SURFACE)
    mesh = march(active)
    return weld_caps(mesh) if mesh.cap.any() else mesh


def _untangled(
    mesh: RawMesh, fresh: NDArray[np.bool_], active: ActiveCells, field: Field, progress: Progress
) -> Proxy:
    """The proxy whose mesh is ready but for what is turned over about its `fresh` (V,) vertices."""
    proxy = _proxy(mesh, active)  # it has the mesh's own arrays
    specks = _find_specks(proxy, field, progress)
    untangle(mesh, fresh & ~specks, field, active.spacing, progress)
    return _without(proxy, specks)


def _proxy(mesh: RawMesh, active: ActiveCells) -> Proxy:
    """The proxy with a mesh, and with its specks."""
    np.clip(mesh.vertices, -1, 1, out=mesh.vertices)
    return Proxy(mesh.vertices, mesh.normals, mesh.triangles, mesh.edges, active, mesh)


def _find_specks(proxy: Proxy, field: Field, progress: Progress) -> NDArray[np.bool_]:
    """Which vertices (V,) of a proxy that has its specks belong to these."""
    return find_specks(
        *(field, edge_centres(proxy.edges, proxy.active.cells), proxy.triangles),
        *(proxy.components, proxy.active.spacing, lambda: progress(1, "Meshing")),
    )


def _without(proxy: Proxy, specks: NDArray[np.bool_]) -> Proxy:
    """The proxy without the vertices (V,) of its specks."""
    if not specks.any():
        return proxy
    vertices, normals, triangles = proxy.vertices, proxy.normals, proxy.triangles
    left = ~specks
    number = (np.cumsum(left) - 1).astype(np.int32)
    triangles = number[triangles[left[triangles[:, 0]]]]
    edges = proxy.edges[left]
    return Proxy(vertices[left], normals[left], triangles, edges, proxy.active, proxy.marched)


def _within(points: NDArray[np.float32], reached: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which of the points (N, 3) lie in cells `reached` (S,), as of `levels.support`."""
    inside = np.zeros(cells_per_axis(SUPPORT) ** 3, bool)
    inside[reached] = True
    return inside.take(linear(cells_of(points, SUPPORT), SUPPORT))


def _lattice_cells(reached: NDArray[np.int32], cells: int) -> NDArray[np.int32]:
    """The cells (C,) of a lattice of `cells` cells per axis that meet cells as of `support`."""
    corner = centres(places(reached, SUPPORT), SUPPORT) - np.float32(level_spacing(SUPPORT) / 2)
    scale = cells / 2
    first = np.floor((corner + 1) * scale + ROUNDING).astype(np.int32)  # (S, 3)
    count = math.ceil(level_spacing(SUPPORT) * scale - ROUNDING)
    if cells % 2 ** (SUPPORT + 1):  # the lattices do not match: a cell more may be met
        count += 1
    block = np.indices((count,) * 3).reshape(3, -1).T.astype(np.int32)
    place = (first[:, None] + block).reshape(-1, 3)
    place = place[((place >= 0) & (place < cells)).all(axis=1)]
    return np.unique((place + 1) @ steps(cells))


def _relax(mesh: RawMesh, fresh: NDArray[np.bool_], spacing: float) -> None:
    """Move each `fresh` vertex within its tangent plane towards the mean of its neighbours.

    In a closed mesh each neighbour is in two of the vertex's triangles, and the vertex in all.
    """
    a, b, c = fresh.take(mesh.triangles).T
    triangles = mesh.triangles.compress(a | b | c, axis=0)
    corners = triangles.ravel()
    ends = np.arange(0, len(corners) + 1, 3, dtype=np.int32)
    shape = len(mesh.vertices), len(triangles)
    members = csc_array((np.ones(len(corners), np.float32), corners, ends), shape)
    total = members @ (members.T @ mesh.vertices)  # (V, 3)
    moving = np.flatnonzero(fresh)  # (M,)
    degree = np.bincount(corners, minlength=len(fresh)).take(moving)[:, None].astype(np.float32)
    start = mesh.vertices.take(moving, axis=0)  # (M, 3)
    move = RELAXATION / 2 * (total.take(moving, axis=0) / degree - 3 * start)
    normals = mesh.normals.take(moving, axis=0)
    move -= np.einsum("ma,ma->m", move, normals)[:, None] * normals
    move *= np.minimum(1, LONGEST_STEP * spacing / np.maximum(lengths(move), 1e-12))
    move *= ~mesh.held.take(moving, axis=0)
    mesh.vertices[moving] = np.clip(start + move, -1, 1)


def _snap(
    mesh: RawMesh,
    fresh: NDArray[np.bool_],
    active: ActiveCells,
    field: Field,
    progress: Progress,
) -> None:
    """Newton steps of the `fresh` vertices until they are settled, and their normals. Those that
    lose their way go to where their edge of the lattice crosses the surface."""
    moving = np.flatnonzero(fresh & ~mesh.cap)
    for number in range(NEWTON_STEPS):
        share = sub_progress(progress, number / NEWTON_STEPS, (number + 1) / NEWTON_STEPS)
        distance = _step(field, mesh, moving, active.spacing, share)
        moving = moving[distance > LEAST_STEP * active.spacing]
    if len(moving):
        _onto_edges(mesh, moving, active, field)


def _onto_edges(mesh: RawMesh, lost: NDArray[np.intp], active: ActiveCells, field: Field) -> None:
    """Bring the `lost` vertices (P,) to f = 0 on their edges, at whose ends its signs differ."""
    edges = mesh.edges.take(lost)
    cell = np.searchsorted(active.index, edges // 3)  # that owns the edge, at its lowest corner
    inside = active.values[0].take(cell)[:, None] < 0  # the lower end
    along = np.eye(3, dtype=np.float32).take(edges % 3, axis=0)  # (P, 3)
    points = edge_centres(edges, active.cells)
    for number in range(2, BISECTIONS + 2):
        same = (values(field, points)[:, None] < 0) == inside
        points += np.where(same, along, -along) * np.float32(active.spacing / 2**number)
    _, gradient = values_and_gradients(field, points)
    mesh.vertices[lost] = points
    mesh.normals[lost] = gradient / np.maximum(lengths(gradient), FLAT)


def _step(
    field: Field, mesh: RawMesh, moving: NDArray[np.intp], spacing: float, progress: Progress
) -> NDArray[np.float32]:
    """One Newton step of the `moving` vertices (P,) onto f = 0; how far each moved (P,).

    Their normals become those where they were. A vertex held on a box face stays in it.
    """
    moved = np.empty(len(moving), np.float32)
    for start in range(0, len(moving), BATCH):
        progress(start / len(moving), "Snapping to the surface")
        part = moving[start : start + BATCH]
        points = mesh.vertices.take(part, axis=0)
        value, gradient = values_and_gradients(field, points)
        slope = lengths(gradient)  # (B, 1)
        known = mesh.normals.take(part, axis=0)
        mesh.normals[part] = np.where(slope > FLAT, gradient / np.maximum(slope, FLAT), known)
        gradient *= ~mesh.held.take(part, axis=0)
        slope = np.maximum(lengths(gradient), FLAT)
        distance = np.clip(
            value[:, None] / slope, -LONGEST_STEP * spacing, LONGEST_STEP * spacing
        )  # (B, 1)
        mesh.vertices[part] = points - distance / slope * gradient
        moved[start : start + BATCH] = np.abs(distance[:, 0])
    return moved
