# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy: the triangle mesh that stands for a field in the scene.

    active cells -> marching cubes -> tangential relaxation -> Newton step onto f = 0

Marching cubes leaves some 6 % slivers, triangles below 5 degrees: moving each vertex in its tangent
plane towards the mean of its neighbours removes them. One Newton step then brings the vertices to
within 1e-5 of the surface, and its gradients are the normals.

`extract` does this from nothing. `follow` does it after an edit, where the surface moved; elsewhere
each vertex takes one step along its normal, so that all of the mesh lies on the edited surface.

Where the surface leaves the box [-1, 1]^3 it is closed off by flat caps on the box faces. The mesh
is always watertight and wound counter-clockwise seen from outside. All lengths in model space.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from .cells import ActiveCells, find_active, find_again
from .evaluate import values, values_and_gradients
from .march import RawMesh, march
from .network import Siren

RELAXATION = 0.7  # share of the way to the mean of the neighbours
REACH = 0.5  # longest Newton step, in cells
SETTLED = 0.05  # a vertex that moved less, in cells, needs no further step
STEPS = 3
FLAT = 1e-6  # a gradient below this has no direction
FEWEST_CELLS, MOST_CELLS = 4, 1024  # per axis; the lattice of the most takes 4 GB
BATCH = 1 << 15  # vertices between two looks at `progress`


@dataclass(frozen=True)
class Proxy:
    """A closed triangle mesh in model space."""

    vertices: NDArray[np.float32]  # (V, 3)
    normals: NDArray[np.float32]  # (V, 3), unit, outward: the direction of grad f
    triangles: NDArray[np.int32]  # (F, 3), counter-clockwise seen from outside


def extract(network: Siren, cells: int = 128, progress: Progress = silent) -> Proxy:
    """The surface f = 0 within [-1, 1]^3, on a lattice of `cells` cells per axis.

    SculptError when there is no surface, the field's values are not finite, or nobody could hold
    so many cells.
    """
    check_cells(cells)
    active = find_active(network, cells, lambda part, text: progress(0.6 * part, text))
    if not len(active.index):
        raise SculptError(
            "The field has no surface in its box. Undo the last stroke or choose another model."
        )
    progress(0.6, "Meshing")
    mesh = march(active)
    mesh = _weld_caps(mesh) if mesh.cap.any() else mesh
    progress(0.7, "Meshing")
    _relax(mesh, active.spacing)
    _snap(mesh, network, active.spacing, lambda part, text: progress(0.75 + 0.25 * part, text))
    return Proxy(mesh.vertices, mesh.normals, mesh.triangles)


def check_cells(cells: int) -> None:
    """Refuse a resolution that makes no proxy. SculptError."""
    if not FEWEST_CELLS <= cells <= MOST_CELLS:
        raise SculptError(
            f"The resolution is {cells} cells per axis; choose {FEWEST_CELLS} to {MOST_CELLS}."
        )


def _weld_caps(mesh: RawMesh) -> RawMesh:
    """Merge the cap vertices that meet at an edge or corner of the box."""
    name = np.arange(len(mesh.vertices))  # (V,)
    cap = np.flatnonzero(mesh.cap)
    _, first, group = np.unique(mesh.vertices[cap], axis=0, return_index=True, return_inverse=True)
    name[cap] = cap[first][group.reshape(-1)]
    triangles = name[mesh.triangles]
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    used, triangles = np.unique(triangles[proper], return_inverse=True)
    return RawMesh(
        mesh.vertices[used],
        mesh.normals[used],
        triangles.reshape(-1, 3).astype(np.int32),
        mesh.edges[used],
        mesh.held[used],
        mesh.cap[used],
    )


def _relax(mesh: RawMesh, spacing: float) -> None:
    """Move each vertex within its tangent plane towards the mean of its neighbours.

    In a closed mesh of one winding every edge is walked once in each direction, so the sum over
    triangle corners of the next corner counts each neighbour exactly once.
    """
    count = len(mesh.vertices)
    corner, following = mesh.triangles.ravel(), np.roll(mesh.triangles, -1, axis=1).ravel()
    degree = np.bincount(corner, minlength=count)  # (V,)
    mean = np.stack(
        [
            np.bincount(corner, weights=mesh.vertices[following, axis], minlength=count) / degree
            for axis in range(3)
        ],
        axis=1,
    )  # (V, 3)
    move = RELAXATION * (mean - mesh.vertices)
    move -= np.sum(move * mesh.normals, axis=1, keepdims=True) * mesh.normals
    move *= np.minimum(1, REACH * spacing / np.maximum(_length(move), 1e-12))
    move[mesh.held] = 0
    np.clip(mesh.vertices + move, -1, 1, out=mesh.vertices)


def _snap(mesh: RawMesh, network: Siren, spacing: float, progress: Progress) -> None:
    """Newton steps onto f = 0, within the face for vertices held on one; normals from grad f."""
    moving = np.flatnonzero(~mesh.cap)
    for step in range(STEPS):
        unsettled = []
        for start in range(0, len(moving), BATCH):
            progress((step + start / len(moving)) / STEPS, "Snapping to the surface")
            part = moving[start : start + BATCH]
            value, gradient = values_and_gradients(network, mesh.vertices[part])
            slope = _length(gradient)  # (P, 1)
            steep = slope[:, 0] > FLAT
            mesh.normals[part[steep]] = (gradient / slope)[steep]
            gradient[mesh.held[part]] = 0
            slope = np.maximum(_length(gradient), FLAT)
            distance = np.clip(value[:, None] / slope, -REACH * spacing, REACH * spacing)  # (P, 1)
            mesh.vertices[part] -= distance * gradient / slope
            unsettled.append(part[np.abs(distance[:, 0]) > SETTLED * spacing])
        moving = np.concatenate(unsettled) if unsettled else moving
    np.clip(mesh.vertices, -1, 1, out=mesh.vertices)


def _length(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.linalg.norm(vectors, axis=1, keepdims=True)  # (N, 1)
