# SPDX-License-Identifier: GPL-3.0-or-later
"""Open parts of a mesh: their openings, which of them are sheets, and what is made of them.

A part with an opening has an inside when a film across the opening is small enough; a sheet has
none: the winding number is one half on one side and minus one half on the other. Model space.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ...common.errors import SculptError
from ...common.text import Text
from ..geometry import areas, face_normals, unit
from .mesh_cleanup import FLAT_MESH, LONGEST_SIDE, CleanMesh
from .mesh_thicken import open_faces, thicken
from .mesh_union import BESIDE_FACE
from .mesh_winding import Winding

Array = NDArray[np.float64]

DOUBTFUL = (0.2, 0.8)  # |winding numbers| that are neither inside nor outside,
ALIKE = 0.4  # when those of a face's two sides differ by less
SHEET = 0.4  # share of a piece with both sides in doubt, from which on it is a sheet
FEW_SHEETS = 0.05  # share of the surface that may be sheets which get a thickness unasked
PROPOSED = 0.02  # thickness as a share of the longest side: two cells of a proxy of 128
WORTH = 0.02  # area of openings as a share of the surface, from which on a film gets a word
FLAT = 1e-3  # of the longest side: a closed mesh so thin is flat, for no field holds it
SHEET_PROBES = 20_000  # faces at most that tell which pieces are sheets


class Open(StrEnum):
    """What becomes of open parts."""

    SOLID = "solid"
    THICKNESS = "thickness"


class Openings(NamedTuple):
    """The borders of a mesh, those that touch counted once, and what they enclose."""

    number: int
    share: float  # of the area of the mesh


class Prepared(NamedTuple):
    """A mesh whose open parts are what was asked for, and sentences about what was done."""

    mesh: CleanMesh
    notes: Sequence[str]


def prepare(mesh: CleanMesh, kind: Open, thickness: float | None = None) -> Prepared:
    """`mesh` with its open parts solid or of a `thickness` in its own units.

    Without a thickness it is `PROPOSED`. Small sheets get it even when solids are asked for.
    SculptError for a thickness that is none, and for a flat mesh that is no sheet.
    """
    if thickness is not None and not 0 < thickness < np.inf:
        raise SculptError("The thickness of a sheet must be a positive number.")
    proposed = PROPOSED * LONGEST_SIDE
    in_units = proposed * mesh.scale
    notes = []
    if gone := mesh.repairs.get("decimated"):
        notes.append(
            Text(
                "Faces that no field can hold were merged: {} fewer, {} left.",
                gone,
                len(mesh.triangles),
            )
        )
    opened = open_faces(mesh)  # (F,)
    usable = opened.any() if kind is Open.THICKNESS else opened.all()
    if not usable and _is_flat(mesh.vertices):
        raise SculptError(FLAT_MESH)
    if not opened.any():
        return Prepared(mesh, notes)
    if kind is Open.THICKNESS:
        thick = thicken(mesh, proposed if thickness is None else thickness / mesh.scale)
        return Prepared(
            thick,
            notes
            if thickness
            else [*notes, Text("Open parts got a thickness of {}.", f"{in_units:.2g}")],
        )
    hole = openings(mesh)
    sheets = _sheets(mesh, opened)
    area = areas(mesh.corners)
    part = float(area[sheets].sum() / area.sum())
    if 0 < part <= FEW_SHEETS:
        notes.append(
            Text(
                "Open sheets ({} of the area) got a thickness of {}.",
                f"{part:.1%}",
                f"{in_units:.2g}",
            )
        )
        mesh = thicken(mesh, proposed, sheets)
        hole = openings(mesh)
    mesh.repairs["openings"] = hole.number
    if hole.share > WORTH:
        notes.append(
            Text(
                "Openings closed by a film: {} ({} of the area). Choose Thickness for open"
                " parts to have a shell instead.",
                hole.number,
                f"{hole.share:.0%}",
            )
        )
    return Prepared(mesh, notes)


def _is_flat(points: Array) -> bool:
    """Whether points (V, 3) lie near one plane."""
    around = points - points.mean(axis=0)
    axes = np.linalg.eigh(around.T @ around)[1]
    return float(np.ptp(around @ axes[:, 0])) < FLAT * LONGEST_SIDE


def borders(mesh: CleanMesh) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Edges that one face has (E, 2), as that is wound, and which opening each is of (E,)."""
    edges = np.asarray(igl.boundary_facets(mesh.triangles)[0]).reshape(-1, 2)
    _, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(-1, 2)
    count = int(ends.max(initial=-1)) + 1
    graph = csr_matrix((np.ones(len(ends)), ends.T), (count, count))
    _, of_vertex = connected_components(graph, directed=False)
    return edges, of_vertex[ends[:, 0]]


def openings(mesh: CleanMesh) -> Openings:
    """How many openings the mesh has, and how large they are."""
    edges, border = borders(mesh)
    if not len(edges):
        return Openings(0, 0.0)
    number = int(border.max()) + 1
    a, b = mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]]
    lengths = np.bincount(border, minlength=number)
    sums = [np.bincount(border, a[:, axis], number) for axis in range(3)]
    center = (np.stack(sums, axis=1) / lengths[:, None])[border]  # (E, 3)
    fan = np.cross(a - center, b - center) / 2
    vector = np.stack([np.bincount(border, fan[:, axis], number) for axis in range(3)], axis=1)
    share = np.linalg.norm(vector, axis=1).sum() / areas(mesh.corners).sum()
    return Openings(number, float(share))


def doubtful(sides: Array) -> NDArray[np.bool_]:
    """Whether places with these winding numbers on their two `sides` (2, N) may lie on a sheet."""
    size = np.abs(sides)
    between = ((size > DOUBTFUL[0]) & (size < DOUBTFUL[1])).all(axis=0)
    return between & (np.abs(size[0] - size[1]) < ALIKE)


def _sheets(mesh: CleanMesh, opened: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the `opened` faces (F,) belong to pieces that are sheets (F,)."""
    chosen = np.flatnonzero(opened)
    chosen = chosen[np.linspace(0, len(chosen) - 1, min(len(chosen), SHEET_PROBES)).astype(int)]
    corners = mesh.corners[chosen]
    middle, step = corners.mean(axis=1), BESIDE_FACE * unit(face_normals(corners))
    number = Winding(mesh.vertices, mesh.triangles)
    sides = number(np.concatenate([middle - step, middle + step])).reshape(2, -1)
    pieces, area = mesh.pieces[chosen], areas(corners)
    many = int(mesh.pieces.max()) + 1
    whole = np.bincount(pieces, area, many)
    doubted = np.bincount(pieces, area * doubtful(sides), many)
    return opened & (doubted > SHEET * whole)[mesh.pieces]
