# SPDX-License-Identifier: GPL-3.0-or-later
"""Any triangle mesh made fit for a signed distance: checked, scaled, welded, oriented outward.

Meshes come as artists have them: vertices doubled along seams, faces doubled, collapsed or flipped,
several pieces, nested or not, at any scale and place. What can be repaired is repaired and counted;
what cannot raises SculptError. The result is in model space, its longest side 1.7, centred on the
origin, or about the origin that it came with as far as that leaves it nearly as large.
"""

from dataclasses import dataclass

import igl
import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components

from ...common.errors import SculptError
from ...common.text import Text
from ..geometry import areas
from .mesh_orient import orient
from .mesh_sew import sew

LONGEST_SIDE = 1.7  # of the shape in model space: a margin of 0.15 to each face of the box
SMALLER = 1.25  # at most, so that the origin stays where it is: cells are larger by as much
WELD_CELLS = 1 << 20  # along the longest side: vertices in one become one; no more fit a key
MOST_FACES = 2_000_000  # more than the finest level of a field can hold
CLUSTERS = 1000  # cells along the longest side where there are more; fewer until there are not,
COARSER = 0.8  # by this ratio
SMALLEST_AREA = 1e-13  # model units squared: thinner triangles have no normal worth the name
LEAST_PLACES = 2000  # coordinates must tell apart this many places along the longest side
FLAT_MESH = Text(
    "The mesh is flat, so it has no inside to sculpt. Make it thicker, or delete the faces that lie"
    " upon others and choose Thickness for open parts (--open thickness)."
)


@dataclass(frozen=True)
class CleanMesh:
    """A welded triangle mesh in model space; pieces face outward, but for walls of cavities.

    mesh space = scale * model space + center. A piece is what hangs together by edges of two faces.
    `repairs` counts what was done, by name. keeps_origin: whether it is scaled about its origin.
    """

    vertices: NDArray[np.float64]  # (V, 3)
    triangles: NDArray[np.int64]  # (F, 3)
    pieces: NDArray[np.int64]  # (F,), the piece of each face
    scale: float
    center: NDArray[np.float64]  # (3,)
    repairs: dict[str, int]
    keeps_origin: bool = False

    @property
    def corners(self) -> NDArray[np.float64]:
        """The three corners of each triangle (F, 3, 3)."""
        return self.vertices[self.triangles]


def clean(vertices: ArrayLike, triangles: ArrayLike, keep_origin: bool = False) -> CleanMesh:
    """The mesh of `vertices` (V, 3) and `triangles` (F, 3), any real and integer types, repaired.

    keep_origin: whether the mesh's origin becomes that of model space, see `placed`

    SculptError when it has no faces, no extent, or coordinates that are not numbers.
    """
    points, faces = _checked(vertices, triangles)
    points, scale, center = _normalised(points, _resolution(vertices), keep_origin)
    count = len(faces)
    points, faces = _decimate(points, faces)
    decimated = count - len(faces)
    points, faces, welded = _weld_parts(points, faces)
    count = len(faces)
    faces = _drop_collapsed(points, faces)
    collapsed, count = count - len(faces), len(faces)
    if not count:
        raise SculptError("All faces of the mesh have zero area. Choose a mesh with a surface.")
    faces = _drop_doubled(faces)
    doubled = count - len(faces)
    points, faces, sewn = sew(points, faces)
    faces, pieces, flipped, copies = orient(points, faces)
    walls = _cancelled(faces)
    faces, pieces = faces[~walls], _names(pieces[~walls])
    if not len(faces):
        raise SculptError(FLAT_MESH)
    repairs = {"decimated": decimated} if decimated else {}
    repairs |= {"sewn": sewn} if sewn else {}
    repairs |= {"welded": welded, "collapsed": collapsed}
    repairs |= {"doubled": doubled + copies + int(walls.sum()), "flipped": flipped}
    return CleanMesh(points, faces, pieces, scale, center, repairs, keep_origin)


def placed(
    low: NDArray[np.float64], high: NDArray[np.float64], origin: NDArray[np.float64] | None = None
) -> tuple[float, NDArray[np.float64]]:
    """Scale and center (3,) that bring a box into model space.

    low, high: its corners (3,)
    origin:    (3,), what becomes the center along each axis along which that makes the shape
               smaller by SMALLER at most; along others it is the middle
    """
    half, middle = (high - low) / 2, (low + high) / 2
    if origin is None:
        return float((high - low).max()) / LONGEST_SIDE, middle
    near = np.abs(middle - origin) + half <= SMALLER * half.max()
    center = np.where(near, origin, middle)
    return float((np.abs(middle - center) + half).max()) * 2 / LONGEST_SIDE, center


def _checked(
    vertices: ArrayLike, triangles: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The arrays, without vertices that no face uses."""
    points, faces = np.asarray(vertices, np.float64), np.asarray(triangles)
    if faces.size == 0 or points.size == 0:
        raise SculptError("The mesh has no faces. Choose an object with a surface.")
    if points.ndim != 2 or points.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise SculptError("The mesh is not made of triangles in space. Triangulate it first.")
    faces = faces.astype(np.int64)
    if faces.min() < 0 or faces.max() >= len(points):
        raise SculptError("The mesh is damaged: its faces name vertices that it does not have.")
    used, faces = np.unique(faces, return_inverse=True)
    points, faces = points[used], faces.reshape(-1, 3)
    if not np.isfinite(points).all():
        raise SculptError(
            "Some vertices of the mesh have no finite position (NaN or infinite)."
            " Delete them and try again."
        )
    return points, faces


def _resolution(vertices: ArrayLike) -> float:
    """Relative rounding error of the coordinates as they were given."""
    dtype = np.asarray(vertices).dtype
    return float(np.finfo(dtype if dtype.kind == "f" else np.float64).eps)


def _normalised(
    points: NDArray[np.float64], resolution: float, keep_origin: bool
) -> tuple[NDArray[np.float64], float, NDArray[np.float64]]:
    low, high = points.min(axis=0), points.max(axis=0)
    with np.errstate(over="ignore"):
        longest, farthest = float((high - low).max()), float(np.abs(points).max())
    if longest == 0:
        raise SculptError("The mesh has no extent: all its vertices lie in one place.")
    if not 1e-30 < longest < 1e30:
        raise SculptError(
            "The mesh is {} units large. Give it a sensible size and apply the scale.",
            f"{longest:.0e}",
        )
    if longest < LEAST_PLACES * resolution * farthest:
        raise SculptError(
            "The mesh is so far from its origin that its shape is lost in rounding."
            " Move the mesh back to the object's origin."
        )
    scale, center = placed(low, high, np.zeros(3) if keep_origin else None)
    return (points - center) / scale, scale, center


def _decimate(
    points: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The mesh with at most `MOST_FACES`: vertices of a cell become their mean."""
    cells, given, many = float(CLUSTERS), points, faces
    while len(faces) > MOST_FACES:
        points, faces, _ = _weld(given, many, int(cells))
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        cells *= COARSER
    return (points, faces[~_cancelled(faces)]) if faces is not many else (points, faces)


def _weld_parts(
    points: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], int]:
    """The mesh with one vertex for those in one place, but for those of closed parts: two solids
    that touch, or a solid and the wall of its cavity, stay two.

    A part is what shares vertices as it is given; how many vertices are gone.
    """
    a, b, c = faces.T
    ends, size = (np.tile(a, 2), np.append(b, c)), (len(points), len(points))
    links = csr_matrix((np.ones(2 * len(faces), bool), ends), size)
    part = connected_components(links, directed=False)[1]
    within, inner, fewer = _weld(points, faces, WELD_CELLS, part)
    part_of = np.empty(len(within), np.int64)
    part_of[inner] = part[faces]
    opened = np.zeros(part.max() + 1, bool)
    opened[part_of[np.asarray(igl.boundary_facets(inner)[0])]] = True
    if not opened.any():
        return within, inner, fewer
    together, outer, more = _weld(within, inner, WELD_CELLS, np.where(opened[part_of], -1, part_of))
    return together, outer, fewer + more


def in_place(points: NDArray[np.float64], cells: int = WELD_CELLS) -> NDArray[np.int64]:
    """The number (V,) of the place of each of the points (V, 3): those in one cell of a grid, so
    many of which the longest side has, are in one."""
    x, y, z = np.rint((points / LONGEST_SIDE + 0.5) * cells).astype(np.int64).T
    return (x << 42) | (y << 21) | z  # 21 bits each


def _weld(
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    cells: int,
    part: NDArray[np.int64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.int64], int]:
    """One vertex, their mean, for all in one place and of one `part` (V,); how many are gone."""
    name = _names(in_place(points, cells))
    if part is not None:
        name = _names(name * (int(part.max()) + 2) + part + 1)
    size = np.bincount(name)
    mean = np.stack([np.bincount(name, axis) / size for axis in points.T], axis=1)
    return mean, name[faces], len(points) - len(mean)


def _names(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Equal numbers (V,) from 0 for equal keys (V,), in their order."""
    return np.unique(keys, return_inverse=True)[1].reshape(-1)


def _drop_collapsed(points: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    return faces[areas(points[faces]) > SMALLEST_AREA]


def _cancelled(faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which faces (F,) another face cancels: one with the same vertices and the opposite winding.

    The two bound nothing. They are the wall between two solids, or lie where a cavity touches the
    outer wall, or merging vertices has folded them. With only one of them a closed mesh is open.
    """
    first = faces.argmin(axis=1)[:, None]
    _, second, third = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1).T
    side = np.where(second < third, 1, -1)
    _, group = trimesh.grouping.unique_rows(np.sort(faces, axis=1))
    return side * np.bincount(group, side)[group] <= 0


def _drop_doubled(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Keep one of the faces that have the same three vertices, whatever their winding, but both
    where they are the wall between two solids that touch: one alone would bend winding numbers."""
    _, group = trimesh.grouping.unique_rows(np.sort(faces, axis=1))
    first = np.unique(group, return_index=True)[1]
    kept = np.zeros(len(faces), bool)
    kept[first] = True
    pair = np.flatnonzero((np.bincount(group) == 2)[group])
    if len(pair):
        kept[pair] |= _are_walls(faces, pair)
    return faces[kept]


def _are_walls(faces: NDArray[np.int64], pair: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of the faces that are a `pair` (N,) with another are such walls (N,): as far as these
    hang together, as many others that meet them at each edge as two solids have there."""
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)  # (3F, 2)
    edge = _names(ends @ [int(faces.max()) + 1, 1]).reshape(-1, 3)  # (F, 3)
    own = edge[pair]  # (N, 3)
    others = np.bincount(edge.ravel()) - np.bincount(own.ravel(), minlength=edge.max() + 1)  # (E,)
    _, at = np.unique(own, return_inverse=True)
    links = coo_matrix((np.ones(at.size), (np.repeat(np.arange(len(pair)), 3), at.ravel())))
    wall = connected_components(links.tocsr() @ links.T, directed=False)[1]  # (N,)
    free = (others == 0) & (np.bincount(own.ravel(), minlength=edge.max() + 1) == 2)
    odd = ((others % 2 == 1) | free)[own].any(axis=1)
    bounded = (others > 0)[own].any(axis=1)
    return (np.bincount(wall, odd) == 0)[wall] & (np.bincount(wall, bounded) > 0)[wall]
