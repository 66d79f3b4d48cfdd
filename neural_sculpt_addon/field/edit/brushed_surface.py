# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that a brush of Blender's asks for, by the triangles that it moved.

    triangles before and after -> divided until they show the field's detail -> a patch of samples

Vertices of a proxy tell less than the field knows: detail lies between them. What a brush moves as
a whole takes its detail along; what it smooths, scrapes or flattens loses as much of the detail as
of the shape that the vertices have. The middles of edges, three for each vertex, are samples only
where a level finer than vertices can hold is asked for. Model space. See docs/method.md, section 6.
"""

from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ..field import Field
from ..fit.fit_detail import among
from ..geometry import unit
from ..levels import cells_of, linear
from ..mesh.edges import find_edges
from ..mesh.refinement.subdivide import divide, rows
from ..projection import ARRIVED, project
from .patch import HELD, Patch, bend, finest_level

Array = NDArray[np.float32]

MOST_VERTICES = 25_000  # vertices, about
BETWEEN = 1
"""Middles of edges are samples, too, on the finest level and so many before it. On coarser ones
vertices alone are enough: some six for each h^2."""


class Brushed(NamedTuple):
    """The triangles that a brush moved, and two rings around them that it did not."""

    before: Array  # (P, 3), on the zero level
    after: Array  # (P, 3)
    triangles: NDArray[np.int32]  # (T, 3)

    @property
    def changed(self) -> NDArray[np.bool_]:
        """Which vertices (P,) were moved."""
        return (self.before != self.after).any(axis=1)


class BrushedSurface(NamedTuple):
    """The surface that a brush asks for.

    brushed: the divided triangles; their first vertices are those of the proxy
    patch:   samples of the surface: the vertices. They count as moved beside vertices that were
             moved, too
    origins: (M, 3), where the moved samples were
    finest:  the finest level that the triangles can hold, before the stroke or after it, for those
             that are dragged far make folds as narrow as they were. At least that of the detail
             that they pass
    between: more samples
    """

    brushed: Brushed
    patch: Patch
    origins: Array
    finest: int
    between: "Between"


def brushed_surface(field: Field, brushed: Brushed) -> BrushedSurface:
    """What a brush asks of a field."""

    def excess(one: _Vertices, other: _Vertices) -> Array:
        edge = np.linalg.norm(one.before - other.before, axis=1)
        finest = field.detail.finest_at((one.before + other.before) / 2)
        return np.where(edge > HELD * 2.0**-finest, edge, 0)

    def middles(one: _Vertices, other: _Vertices) -> _Vertices:
        return _middles(field, one, other)

    triangles, vertices = divide(
        brushed.triangles, _vertices(field, brushed), excess, middles, MOST_VERTICES
    )
    fine = Brushed(vertices.before, vertices.after, triangles)
    moved = fine.changed
    moved[triangles[moved[triangles].any(axis=1)]] = True
    origins = vertices.before[moved]
    detail = int(field.detail.finest_at(origins).max())
    corners = triangles[moved[triangles].all(axis=1)]
    finest = max(finest_level(each[corners]) for each in (vertices.before, vertices.after))
    finest = max(finest, detail)
    patch = Patch(vertices.after, vertices.upright, moved)
    between = Between(field, vertices, find_edges(triangles)[0], moved, finest - BETWEEN)
    return BrushedSurface(fine, patch, origins, finest, between)


class Between:
    """The middles of edges, each given once, where they are asked for."""

    def __init__(
        self,
        field: Field,
        vertices: "_Vertices",
        edges: NDArray[np.int32],
        moved: NDArray[np.bool_],
        level: int,
    ) -> None:
        """edges: (E, 2);  moved: (V,), of the vertices;  level: the coarsest one that needs them"""
        self._field, self._vertices, self._edges, self._moved = field, vertices, edges, moved
        self._level = level

    def __call__(self, cells: NDArray[np.int32], level: int) -> Patch:
        """Those in the cells (K,), rising, of a level that were not given yet."""
        one, other = self._edges.T
        after = self._vertices.after
        asked = np.zeros(len(one), bool)
        if level >= self._level and len(cells):
            straight = (after[one] + after[other]) / 2
            asked = among(linear(cells_of(straight, level), level), cells)
        self._edges = self._edges[~asked]
        one, other = one[asked], other[asked]
        ends = (rows(self._vertices, end) for end in (one, other))
        middle = _middles(self._field, *ends)
        return Patch(middle.after, middle.upright, self._moved[one] | self._moved[other])


class _Vertices(NamedTuple):
    """Vertices, or middles of edges, before and after the stroke.

    upright: unit normals of the surface that is asked for
    was:     unit normals of the triangles before
    is_now:  unit normals of the triangles after
    kept:    the share of the surface's shape around a vertex that the stroke has left
    """

    before: Array  # (N, 3)
    after: Array  # (N, 3)
    upright: Array  # (N, 3)
    was: Array  # (N, 3)
    is_now: Array  # (N, 3)
    kept: Array  # (N, 1)


def _vertices(field: Field, brushed: Brushed) -> _Vertices:
    before, after, triangles = brushed
    was, is_now = (
        np.nan_to_num(igl.per_vertex_normals(each, triangles)).astype(np.float32)
        for each in (before, after)
    )
    kept = _kept_shape(before, after, triangles)[:, None]
    upright = unit(is_now + kept * (project(field, before, steps=1).normals - was))
    return _Vertices(before, after, upright, was, is_now, kept)


def _middles(field: Field, one: _Vertices, other: _Vertices) -> _Vertices:
    """The middles of edges, from both ends.

    The edge is bent as its normals say. The surface before the stroke was a little off such a bent
    edge: the share of that which the brush has kept is added.
    """
    halfway = _Vertices(*((a + b) / 2 for a, b in zip(one, other, strict=True)))
    true = project(field, halfway.before, tolerance=ARRIVED)
    was, is_now, kept = unit(halfway.was), unit(halfway.is_now), halfway.kept
    old = halfway.before - bend(other.before - one.before, one.was, other.was)
    smooth = halfway.after - bend(other.after - one.after, one.is_now, other.is_now)
    after = smooth + kept * (true.points - old)
    upright = unit(is_now + kept * (true.normals - was))
    ends = np.stack([(end.before == end.after).all(axis=1) for end in (one, other)])
    stays = ends.all(axis=0)[:, None]
    return _Vertices(
        true.points,
        np.where(stays, true.points, after),
        np.where(stays, true.normals, upright),
        was,
        is_now,
        kept,
    )


def _kept_shape(before: Array, after: Array, triangles: NDArray[np.int32]) -> Array:
    """The share (P,) of the shape around each vertex that is left, at most 1.

    The shape is how far vertices are from the middle of their neighbours, for the vertex and those
    beside it together.
    """
    around = igl.adjacency_matrix(triangles)
    count = np.asarray(around.sum(axis=1)).ravel()[:, None]

    def shape(points: Array) -> NDArray[np.float64]:
        away = ((around @ points / count - points) ** 2).sum(axis=1)
        return away + around @ away

    share = shape(after) / np.maximum(shape(before), 1e-30)
    return np.sqrt(np.minimum(share, 1)).astype(np.float32)
