# SPDX-License-Identifier: GPL-3.0-or-later
"""The signed distance to a mesh that need not be closed, and samples of its surface.

The magnitude is the exact distance to the triangles (libigl's AABB tree). The sign comes from the
winding number (Barill et al., "Fast winding numbers for soups and clouds", 2018): near 1 inside,
near 0 outside, and smoothly in between across a hole, which it closes like a soap film. Faces with
the inside on both sides (inner walls, pieces stuck into each other) are no part of the surface and
are dropped first. A sheet has no inside at all; it needs a thickness. Model space throughout.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from .mesh_cleanup import CleanMesh, areas, normals

Array = NDArray[np.float64]

BATCH = 1024  # queries between two looks at `progress`
BESIDE = 2e-3  # how far beside a face its two sides are looked at
PROBES = 4000  # places at which the whole mesh is judged
INNER = 0.8  # mean |winding number| of a face's sides, from which on both are inside
DOUBTFUL = (0.2, 0.8)  # |winding numbers| that are neither inside nor outside
SPLITS = 4  # times at most that a face partly inside is divided in four,
FINE = 0.02  # while an edge is longer than this
SHEET = 0.4  # share of the surface with both sides in doubt, from which on a mesh is a sheet
FILM = 0.2  # half width of the passage across a hole, as a share of the threshold

# Barycentric weights: a face's middle and three places near its corners; its four quarters.
_PLACES = np.array([[1, 1, 1], [2.8, 0.1, 0.1], [0.1, 2.8, 0.1], [0.1, 0.1, 2.8]]) / 3  # (4, 3)
_QUARTERS = (
    np.array(
        [
            [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
            [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
            [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
            [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
        ]
    )
    / 2
)  # (4, 3, 3)


class Surface(NamedTuple):
    """Points uniform by area, with the outward unit normals there."""

    points: Array  # (N, 3)
    normals: Array  # (N, 3)


class Distance(NamedTuple):
    """The signed distance at some points."""

    value: Array  # (N,), negative inside
    gradient: Array  # (N, 3), unit
    certain: NDArray[np.bool_]  # (N,), false near the film across a hole


class MeshDistance:
    """The signed distance to a clean mesh, or to a sheet of some thickness.

    thickness: model units; None for a mesh that encloses something
    Raises SculptError when such a mesh turns out to be an open sheet.
    """

    def __init__(
        self,
        mesh: CleanMesh,
        thickness: float | None,
        rng: np.random.Generator,
        progress: Progress = silent,
    ) -> None:
        self.vertices, self.faces = mesh.vertices, mesh.triangles
        self.offset = None if thickness is None else thickness / 2
        self.threshold = 0.5
        if self.offset is None:
            self._drop_inner_faces(rng, progress)
            self.winding = _winding(self.vertices, self.faces)
            self.threshold = _threshold(self.surface(PROBES, rng), self.winding, progress)
        self._tree = igl.AABB()
        self._tree.init(self.vertices, self.faces)

    def __call__(self, points: Array, progress: Progress = silent) -> Distance:
        """The distance at `points` (N, 3)."""
        order = _morton_order(points)  # neighbours walk the same branches of the tree
        sorted_points = np.ascontiguousarray(points[order])
        value, certain = np.empty(len(points)), np.ones(len(points), bool)
        gradient = np.empty((len(points), 3))
        for part in _batches(len(points), progress):
            found = self._measure(sorted_points[part])
            where = order[part]
            value[where], gradient[where], certain[where] = found
        return Distance(value, gradient, certain)

    def surface(self, count: int, rng: np.random.Generator) -> Surface:
        """`count` points of the zero level, on both sides of a sheet."""
        corners = self.vertices[self.faces]
        area = areas(corners)
        place = np.searchsorted(np.cumsum(area) / area.sum(), rng.random(count))
        corners = corners[np.minimum(place, len(area) - 1)]  # (N, 3, 3)
        u, v = np.sqrt(rng.random(count)), rng.random(count)
        weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)  # (N, 3)
        points = np.einsum("nk,nkd->nd", weights, corners)
        normal = _unit(normals(corners))
        if self.offset is not None:
            normal = normal * rng.choice([-1.0, 1.0], (count, 1))
            points = points + self.offset * normal
        return Surface(points, normal)

    def _measure(self, points: Array) -> Distance:
        found = self._tree.squared_distance(self.vertices, self.faces, points)
        square, face, closest = (np.asarray(array) for array in found)
        distance = np.sqrt(square)  # (N,)
        away: Array = points - closest  # (N, 3)
        touching = distance < 1e-7
        if self.offset is not None:
            sign = np.ones(len(points))
        else:
            inside = np.abs(self.winding(points)) - self.threshold
            sign = np.clip(-inside / (FILM * self.threshold), -1, 1)
        certain = np.abs(sign) == 1
        gradient = _unit(np.where(sign < 0, -1.0, 1.0)[:, None] * away)
        gradient[touching] = _unit(normals(self.vertices[self.faces[face[touching]]]))
        return Distance(sign * distance - (self.offset or 0.0), gradient, certain | touching)

    def _drop_inner_faces(self, rng: np.random.Generator, progress: Progress) -> None:
        """Keep the outer surface: faces of which at least one side is outside.

        Faces that are partly inside are divided. The quarters share no vertices with their
        neighbours, which neither the distance nor the winding number minds.
        """
        winding = _winding(self.vertices, self.faces)
        corners = self.vertices[self.faces]
        probes = corners[rng.integers(0, len(corners), min(PROBES, len(corners)))]
        if not _inner(probes, winding, progress).any():
            return
        kept, pending = [], corners
        for _ in range(SPLITS):
            edges = np.linalg.norm(pending - np.roll(pending, 1, axis=1), axis=2)  # (F, 3)
            large = edges.max(axis=1) > FINE
            small, pending = pending[~large], pending[large]
            kept.append(small[~_inner(small, winding, progress, _PLACES[:1]).any(axis=1)])
            inner = _inner(pending, winding, progress)  # (F, 4)
            kept.append(pending[~inner.any(axis=1)])
            pending = pending[inner.any(axis=1) & ~inner.all(axis=1)]
            pending = np.einsum("qkc,fcd->fqkd", _QUARTERS, pending).reshape(-1, 3, 3)
        corners = np.concatenate([*kept, pending])
        self.vertices = corners.reshape(-1, 3)
        self.faces = np.arange(3 * len(corners)).reshape(-1, 3)


def _winding(vertices: Array, faces: NDArray[np.int64]) -> Callable[[Array], Array]:
    """The winding number of the faces as a function of points (N, 3) -> (N,)."""
    hierarchy = igl.FastWindingNumberBVH()
    hierarchy.init(vertices, faces, 2)
    return lambda points: np.asarray(hierarchy.winding_number(points, 2.0))


def _inner(
    corners: Array,
    winding: Callable[[Array], Array],
    progress: Progress,
    places: Array = _PLACES,
) -> NDArray[np.bool_]:
    """Whether both sides of the faces (F, 3, 3) are inside, at P barycentric places each (F, P)."""
    step = BESIDE * _unit(normals(corners))[:, None]  # (F, 1, 3)
    inner = np.empty((len(corners), len(places)), bool)
    for part in _batches(len(corners), progress):
        middle = np.einsum("pc,fcd->fpd", places, corners[part])  # (f, P, 3)
        sides = np.stack([middle + step[part], middle - step[part]])  # (2, f, P, 3)
        number = np.abs(winding(sides.reshape(-1, 3))).reshape(sides.shape[:-1])
        inner[part] = number.mean(axis=0) > INNER  # of a face with one side outside: about 0.5
    return inner


def _threshold(surface: Surface, winding: Callable[[Array], Array], progress: Progress) -> float:
    """Half of the |winding number| just inside: 0.5 for a closed mesh, less for one with holes."""
    progress(0.0, "Looking for the inside")
    sides = np.concatenate([surface.points + side * BESIDE * surface.normals for side in (-1, 1)])
    number = np.abs(winding(sides)).reshape(2, -1)  # (side, N)
    doubtful = ((number > DOUBTFUL[0]) & (number < DOUBTFUL[1])).all(axis=0)  # (N,)
    if doubtful.mean() > SHEET:
        raise SculptError(
            "The mesh is an open sheet, so it has no inside to sculpt."
            " Close it, or give it a thickness (Solidify modifier)."
        )
    return float(np.clip(np.median(number.max(axis=0)) / 2, 0.25, 0.5))


def _morton_order(points: Array) -> NDArray[np.intp]:
    """Indices that sort `points` (N, 3) along a Z-order curve through [-2, 2]^3."""
    code = np.zeros(len(points), np.int64)
    place = np.clip((points + 2) * 256, 0, 1023).astype(np.int64)  # (N, 3)
    for bit in range(10):
        for axis in range(3):
            code |= (place[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(code)


def _batches(count: int, progress: Progress) -> Iterator[slice]:
    for start in range(0, count, BATCH):
        progress(start / count, "Measuring distances")
        yield slice(start, min(start + BATCH, count))


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
