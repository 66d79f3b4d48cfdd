# SPDX-License-Identifier: GPL-3.0-or-later
"""Tubular sampling: a grid of surface samples around a stroke and where the stroke moves them.

Rows are spaced along the path, columns across it, in [-r, r]; each grid point is offset along v and
projected onto the surface (paper, section 4: 99 x 101). Around round ends and dabs the rows go on
past the end, and what lies within one radius is kept. Model space. See docs/method.md, section 2.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_opening

from ...common.progress import Check, go_on
from ...stroke.curve import Array
from ...stroke.displacement import Displacement, displace, local_radius
from ...stroke.path import Path
from ...stroke.stroke import Ends, Stroke
from ..evaluate import normals
from ..field import Field
from ..mesh.surface import Samples
from ..projection import ARRIVED, ON_SURFACE, project
from ..threads import in_pieces
from .copies import displaced

ROWS, COLUMNS = 99, 101  # along and across, as in the paper
LONGEST_CELL = 10  # times its width may be the length of a cell of the grid
FEWEST_COLUMNS = 7  # of a very long path, which gets more rows for them
MOST_CAP_ROWS = 99  # around an end of a path that is short beside its radius
TORN = 4.0  # usual edges of a triangle, at which it spans two parts of the surface
INNER_RIM = 1.02  # radii; the rim begins just outside of the tube


@dataclass(frozen=True)
class Tube:
    """Surface samples around a stroke and their targets.

    surface:      (N,) samples of the unedited surface
    target:       where they go, p' = p + d n, and the unit normals of the displaced surface
    displacement: (N,) what moves them
    stretch:      (N,) by what factor it stretches the surface's area
    grid:         (rows, columns) index of each sample's place in the grid, -1 where there is none
    """

    surface: Samples
    target: Samples
    displacement: Displacement
    stretch: Array
    grid: NDArray[np.intp]

    def where(self, chosen: NDArray[np.bool_]) -> "Tube":
        """The chosen samples."""
        places = np.append(np.where(chosen, np.cumsum(chosen) - 1, -1), -1)
        return Tube(
            self.surface.where(chosen),
            self.target.where(chosen),
            self.displacement.where(chosen),
            self.stretch[chosen],
            places[self.grid],
        )

    def inner(self) -> NDArray[np.bool_]:
        """Which samples (N,) have all four neighbours in the grid: beyond others nothing is known.

        On strongly curved surfaces those at the border lie well within the radius.
        """
        here = np.pad(self.grid >= 0, 1)
        around = here[:-2, 1:-1] & here[2:, 1:-1] & here[1:-1, :-2] & here[1:-1, 2:]
        inner = np.zeros(len(self.surface.points), bool)
        inner[self.grid[around & (self.grid >= 0)]] = True
        return inner

    def in_cells(self) -> NDArray[np.bool_]:
        """Which samples (N,) are corners of a whole cell of the grid."""
        cells = np.asarray(binary_opening(self.grid >= 0, np.ones((2, 2))), bool)
        inside = np.zeros(len(self.surface.points), bool)
        inside[self.grid[cells]] = True
        return inside

    def triangles(self) -> NDArray[np.int64]:
        """Triangles (T, 3) between neighbours of the grid, counter-clockwise seen from outside.

        Where projection led neighbours to different parts of the surface there are none.
        """
        a, b = self.grid[:-1, :-1].ravel(), self.grid[:-1, 1:].ravel()
        c, d = self.grid[1:, :-1].ravel(), self.grid[1:, 1:].ravel()
        both = np.concatenate([np.stack([a, d, b], 1), np.stack([a, c, d], 1)])
        triangles = both[(both >= 0).all(axis=1)].astype(np.int64)
        if not len(triangles):
            return triangles
        corners = self.surface.points[triangles]  # (T, 3, 3)
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        return triangles[edges < TORN * np.median(edges)]


def sample_tube(
    field: Field,
    stroke: Stroke,
    path: Path,
    rows: int = ROWS,
    columns: int = COLUMNS,
    jitter: np.random.Generator | None = None,
    check: Check = go_on,
    guide: Field | None = None,
) -> Tube:
    """The tube of a stroke placed on the surface as `path`.

    jitter: moves samples in their cells
    guide:  whose normals they are displaced along, if not those of `field`
    """
    guide = guide or field
    along, across = _grid(stroke, path, 1.0, rows, columns, jitter)

    def sample(part: slice) -> tuple[Samples, Samples, Displacement, Array, NDArray[np.bool_]]:
        start = _offset(stroke, path, along.ravel()[part], across.ravel()[part])
        surface, displacement, kept = _around(field, guide, stroke, path, 1.0, start)
        target, stretch = displaced(guide, stroke, path, surface, displacement)
        return surface, target, displacement, stretch, kept

    surface, target, displacement, stretch, kept = in_pieces(sample, along.size, check)
    grid = np.full(along.shape, -1)
    grid.ravel()[np.flatnonzero(kept)] = np.arange(np.count_nonzero(kept))
    return Tube(surface, target, displacement, stretch, grid)


def sample_rim(
    field: Field,
    stroke: Stroke,
    path: Path,
    reach: float,
    count: int,
    jitter: np.random.Generator,
    check: Check = go_on,
) -> Samples:
    """About `count` surface samples between one radius and `reach` radii from the path."""
    side = max(int(np.sqrt(2 * count)), 2)  # about half of the grid lies in the tube
    along, across = _grid(stroke, path, reach, side, side, jitter)

    def sample(part: slice) -> Samples:
        start = _offset(stroke, path, along.ravel()[part], across.ravel()[part])
        surface, displacement, _ = _around(field, field, stroke, path, reach, start)
        return surface.where(displacement.relative_distance > INNER_RIM)

    return in_pieces(sample, along.size, check)


def _around(
    field: Field, guide: Field, stroke: Stroke, path: Path, reach: float, points: Array
) -> tuple[Samples, Displacement, NDArray[np.bool_]]:
    """Surface samples within `reach` radii of the path, and which of `points` (N, 3) led there."""
    surface = project(field, points, tolerance=ARRIVED)
    samples = Samples(surface.points, surface.normals)
    upright = samples.normals if guide is field else normals(guide, samples.points)
    displacement = displace(stroke, path, samples.points, upright)
    kept = (displacement.relative_distance <= reach) & (surface.distance < ON_SURFACE)
    if stroke.ends is Ends.FLAT and len(path.points) > 1:
        kept &= ~displacement.beyond
    return samples.where(kept), displacement.where(kept), kept


def _grid(
    stroke: Stroke,
    path: Path,
    reach: float,
    rows: int,
    columns: int,
    jitter: np.random.Generator | None,
) -> tuple[Array, Array]:
    """Places along the path in model space and across it in radii: two (rows', columns') arrays.

    A very long path has more rows and fewer columns; round ends have rows of their own.
    """
    radius = reach * stroke.largest_radius
    longer = path.length / rows / (2 * radius / columns * LONGEST_CELL)
    if longer > 1:
        rows = round(rows * longer**0.5)
        columns = max(round(columns / longer**0.5), FEWEST_COLUMNS)
    if len(path.points) == 1:
        along = np.linspace(-radius, radius, rows)
    else:
        along = np.linspace(0, path.length, rows)
        if not path.closed and stroke.ends is Ends.ROUND:
            more = min(int(np.ceil(radius / along[1])), MOST_CAP_ROWS)
            ahead = np.linspace(0, radius, more + 1)[1:]
            along = np.concatenate([-ahead[::-1], along, path.length + ahead])
    across = np.linspace(-reach, reach, columns)
    along, across = np.meshgrid(along, across, indexing="ij")
    if jitter is not None:
        row = len(along) // 2
        shift = jitter.uniform(-0.5, 0.5, (2, *along.shape))
        along = along + (along[row, 0] - along[row - 1, 0]) * shift[0]
        across = (across * (columns - 1) + 2 * reach * shift[1]) / columns  # even up to the rim
    return along, across


def _offset(stroke: Stroke, path: Path, along: Array, across: Array) -> Array:
    """Places (N,) in the grid as points (N, 3) in the path's tangent planes, off the surface."""
    u = along / path.length if path.length else np.zeros(along.size)
    inside = np.clip(u, 0, 1)

    def at(values: Array) -> Array:
        if len(path.points) == 1:
            return np.repeat(values, len(u), axis=0)
        return np.stack([np.interp(inside, path.u, axis) for axis in values.T], axis=1)

    ahead = along - inside * path.length
    sideways = across * local_radius(stroke, inside)
    return (
        at(path.points) + ahead[:, None] * at(path.tangents) + sideways[:, None] * at(path.laterals)
    )
