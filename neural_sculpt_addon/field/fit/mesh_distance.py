# SPDX-License-Identifier: GPL-3.0-or-later
"""The signed distance to a mesh that need not be closed, and samples of its surface.

The magnitude is the exact distance to the triangles (libigl's AABB tree). The sign comes from the
winding number (Barill et al., "Fast winding numbers for soups and clouds", 2018): near 1 inside,
near 0 outside, and smoothly in between across a hole, which a film closes (`mesh_film`). What has
the inside on both sides (inner walls, parts stuck into each other) is no part of the surface and
is dropped first (`mesh_union`). A sheet has no inside at all; it needs a thickness first
(`mesh_thicken`). Model space throughout.
"""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...common.progress import Progress, silent
from ..geometry import areas, face_normals, unit
from ..mesh.surface import spatial_order
from .mesh_cleanup import CleanMesh
from .mesh_film import find_film, wide_borders
from .mesh_open import SHEET, borders, doubtful
from .mesh_union import BESIDE_FACE, HIDDEN, crossings, cut
from .mesh_winding import CLOSE, FAST, Winding

Array = NDArray[np.float64]

BATCH = 1 << 14
"""Queries between two looks at `progress`, at most some 200 ms of one core. libigl asks its tree on
all cores from 10,000 on."""
LOOKING = "Looking for the inside"  # told by `progress`
PROBES = 4000  # places at which the whole mesh is judged
WALLS = 0.002  # share of the surface with both sides inside, from which on it is worth dropping
ALL_SHEETS = 0.99  # share of the surface from which on all of it is said to be sheets
SCRAP = 0.01  # share of the surface that may be sheets without a word about it
PASSAGE = 0.2
"""Half width of the passage from side to side in a torn mesh, as a share of the threshold."""
INSIDE_OUT = 0.5  # minus the winding number of what is inside of faces that look inward


class MeshSamples(NamedTuple):
    """Points uniform by area, with the outward unit normals there."""

    points: Array  # (N, 3)
    normals: Array  # (N, 3)
    faces: NDArray[np.intp]  # (N,), on which they lie


class Distance(NamedTuple):
    """The signed distance at some points."""

    value: Array  # (N,), negative inside
    gradient: Array  # (N, 3), unit


class MeshDistance:
    """The signed distance to a clean mesh. SculptError when much of it is an open sheet.

    vertices, faces: of what bounds the inside, (V, 3) and (F, 3): of the mesh, then of its films
    of_mesh:         how many of the faces are the mesh's
    crossing:        pairs of faces of the mesh that cross (N, 2)
    uncut:           how many of these were too many to cut, so that inner walls may be left
    """

    def __init__(
        self, mesh: CleanMesh, rng: np.random.Generator, progress: Progress = silent
    ) -> None:
        """Judge the mesh by `PROBES` random places, and drop what is no outer surface."""
        self.vertices, self.faces = mesh.vertices, mesh.triangles
        self.of_mesh = len(self.faces)
        self._winding = Winding(self.vertices, self.faces)
        probes = self.surface(PROBES, rng)
        sides = self._sides(probes, progress)
        _refuse_sheets(sides, mesh.pieces[probes.faces])
        self.crossing = pairs = crossings(self.vertices, self.faces)
        self.uncut = 0
        if len(pairs) or (np.abs(sides).min(axis=0) > HIDDEN).mean() > WALLS:
            parts = cut(self.vertices, self.faces, pairs, self._winding, progress)
            self._winding = Winding(*_soup(parts.solid))
            self.vertices, self.faces = _soup(parts.surface)
            self.of_mesh, self.uncut = len(self.faces), parts.uncut
            sides = self._sides(self.surface(PROBES, rng), progress)
        # Half of what it is just inside: 0.5 for a closed mesh, less for one with holes.
        self._threshold = float(np.clip(np.median(np.abs(sides).max(axis=0)) / 2, 0.25, 0.5))
        self._build_tree()
        edges, opening = borders(mesh)
        wide = wide_borders(mesh.vertices[edges], opening)
        depth = partial(self._depth, accuracy=CLOSE)
        film = find_film(wide, depth, self.away, lambda: progress(0.9, LOOKING))
        self._torn = len(wide) > 0 and not len(film)  # or all is hidden, where it does not matter
        if len(film):
            corners, count = film.reshape(-1, 3), len(self.vertices)
            faces = count + np.arange(len(corners)).reshape(-1, 3)
            self.vertices = np.concatenate([self.vertices, corners])
            self.faces = np.concatenate([self.faces, faces])
            self._build_tree()

    def __call__(self, points: Array, progress: Progress = silent) -> Distance:
        """The distance at `points` (N, 3)."""
        order = spatial_order(points)  # neighbours walk the same branches of the tree
        sorted_points = np.ascontiguousarray(points[order])
        value, gradient = np.empty(len(points)), np.empty((len(points), 3))
        for part in _batches(len(points), progress):
            where = order[part]
            value[where], gradient[where] = self._measure(sorted_points[part])
        return Distance(value, gradient)

    def away(self, points: Array) -> Array:
        """How far the points (N, 3) are from the mesh and its films (N,); without the sign, which
        takes three times as long where the mesh is near."""
        order = spatial_order(points)
        square = np.empty(len(points))
        sorted_points = np.ascontiguousarray(points[order])
        square[order] = self._tree.squared_distance(self.vertices, self.faces, sorted_points)[0]
        return np.sqrt(square)

    def surface(self, count: int, rng: np.random.Generator, *, films: bool = False) -> MeshSamples:
        """`count` points of the mesh, or of it and its films, spread evenly, in the order of the
        faces."""
        corners = self.vertices[self.faces[: None if films else self.of_mesh]]
        area = areas(corners)
        part = (np.arange(count) + rng.random(count)) / count  # of the whole area
        faces = np.searchsorted(np.cumsum(area) / area.sum(), part)
        faces = np.minimum(faces, len(area) - 1)
        corners = corners[faces]  # (N, 3, 3)
        u, v = np.sqrt(rng.random(count)), rng.random(count)
        weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)  # (N, 3)
        return MeshSamples(
            np.einsum("nk,nkd->nd", weights, corners), unit(face_normals(corners)), faces
        )

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """Which of the points (N, 3) are inside."""
        return self._depth(points) > 1

    def facing(
        self, points: NDArray, normals: NDArray, beside: float | NDArray = BESIDE_FACE
    ) -> NDArray[np.int8]:
        """Which way faces with these points and normals (N, 3) look: 1 outward, -1 inward, 0 when
        both of their sides, so far `beside` them (N,), are inside, or both outside.
        """
        step: Array = normals.astype(float)
        step *= np.reshape(beside, (-1, 1))
        sides = np.concatenate([points - step, points + step])
        inside = self._depth(sides).reshape(2, -1) > 1
        return inside[0].astype(np.int8) - inside[1]

    def _measure(self, points: Array) -> Distance:
        found = self._tree.squared_distance(self.vertices, self.faces, points)
        square, face, closest = (np.asarray(array) for array in found)
        distance = np.sqrt(square)  # (N,)
        touching = distance < 1e-7
        beyond = 1 - self._depth(points)
        side = np.where(beyond < 0, -1.0, 1.0)
        sign: Array = np.clip(beyond / PASSAGE, -1, 1) if self._torn else side
        away: Array = points - closest  # (N, 3)
        gradient = unit(side[:, None] * away)
        gradient[touching] = unit(face_normals(self.vertices[self.faces[face[touching]]]))
        return Distance(sign * distance, gradient)

    def _build_tree(self) -> None:
        self._tree = igl.AABB()
        self._tree.init(self.vertices, self.faces)

    def _depth(self, points: Array, accuracy: float = FAST) -> Array:
        """How far points (N, 3) are inside by their winding number: from 1 on they are."""
        number = self._winding(points, accuracy)
        return np.maximum(number / self._threshold, -number / INSIDE_OUT)

    def _sides(self, probes: MeshSamples, progress: Progress) -> Array:
        """Winding number just behind and just before each of the probes (2, N)."""
        progress(0.0, LOOKING)
        step = BESIDE_FACE * probes.normals
        sides = np.concatenate([probes.points - step, probes.points + step])
        return self._winding(sides).reshape(2, -1)


def _soup(corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (3F, 3) and faces (F, 3) of triangles by their corners (F, 3, 3)."""
    return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)


def _refuse_sheets(sides: Array, pieces: NDArray[np.int64]) -> None:
    """SculptError when too many of the probes, with these `sides` (2, N), lie on sheets."""
    probes, in_doubt = np.bincount(pieces), np.bincount(pieces, doubtful(sides))
    share = float((in_doubt > SHEET * probes)[pieces].mean())
    if share > SCRAP:
        if share > ALL_SHEETS:
            raise SculptError(
                "The mesh is an open sheet, so it has no inside to sculpt. Give it a thickness"
                " (Open Parts, or --open thickness), or close or delete it."
            )
        raise SculptError(
            "A part of the mesh ({} of its area) is an open sheet, so it has no inside to sculpt."
            " Give it a thickness (Open Parts, or --open thickness), or close or delete it.",
            f"{share:.0%}",
        )


def _batches(count: int, progress: Progress) -> Iterator[slice]:
    for start in range(0, count, BATCH):
        progress(start / count, "Measuring distances")
        yield slice(start, min(start + BATCH, count))
