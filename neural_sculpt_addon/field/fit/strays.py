# SPDX-License-Identifier: GPL-3.0-or-later
"""Strays of a fit: surface where the mesh has none (docs/method.md, section 5).

A network learns from samples, and can dip through zero where there were none; splines can swing
between rows. So vertices of the proxy are asked how far the mesh is. Places around the surface
where f is nearly zero are looked at closely, for what lies there is thinner than the proxy's cells.
Model space.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..evaluate import normals, values
from ..field import Field
from ..geometry import search_tree
from ..levels import SUPPORT, cells_of, centres, dilated, distinct, linear, places, spacing
from ..mesh.extraction.loose_pieces import loose_places
from ..mesh.proxy import Proxy
from .fit_detail import among
from .mesh_distance import MeshDistance

SHORT_OF_MESH = 0.9  # of the way to the mesh, within which the inside ends in openings alone
NEAR_MESH = 1.0  # cells of the proxy from the mesh, beyond which it has no vertex there
NO_PIECE = 0.25
"""Cells that the vertices of a piece are off on average when the mesh has none there."""
FACING_ALIKE = 0.5
"""Mean cosine between the normals of a piece and those of the mesh at its vertices. A piece with
less is a crumb or a hollow beside the mesh."""
ASKED, ASKED_OF_PIECE = 30_000, 64  # vertices that are asked: in all, and of each piece at least
HIDDEN_LEVEL, HIDDEN_RINGS, HIDDEN_LOW = 6, 3, 0.4
"""Where hidden pieces are looked for: at a place in each cell of this level, in so many rings of
cells around the surface. |f| below HIDDEN_LOW times a cell is nearly zero."""
LARGE_COEFFICIENT = 0.1  # share of the edge of such a cell; detail of smaller ones hides nothing
ON_ITS_SIDE = 0.3  # share of the distance that f must have on its side, or is looked at closely:
PLACES_IN_BALL, WRONG_SHARE = 64, 0.05
"""At so many places around, where the share that is a stray is smaller."""

TINY = 2.0
"""Cells of the proxy's lattice, as which a piece that it does not see is smaller; closer to the
surface than that none is looked for."""

Points = NDArray[np.float32]
Cells = NDArray[np.int32]


class Strays(NamedTuple):
    """Places of a surface where the mesh has none, and how far that is."""

    points: Points  # (N, 3)
    away: NDArray[np.float64]  # (N,)


def find_strays(proxy: Proxy, distance: MeshDistance, reached: Cells | None = None) -> Strays:
    """Strays: vertices of the proxy that the mesh is not near to, and those of pieces that the mesh
    does not have. Some of all vertices are asked, or of those in `reached` cells (see
    `support`)."""
    count, labels = proxy.components
    sizes = np.bincount(labels, minlength=count)
    starts = np.cumsum(sizes) - sizes
    spread = (np.arange(ASKED_OF_PIECE) + 0.5) / ASKED_OF_PIECE
    of_pieces = (starts[:, None] + spread * sizes[:, None]).astype(int)
    every = np.arange(len(labels))
    if reached is not None:
        every = np.flatnonzero(is_within(proxy.vertices, reached))
    every = every[np.linspace(0, len(every) - 1, min(len(every), ASKED)).astype(int)]
    asked = np.concatenate([every, np.argsort(labels, kind="stable")[of_pieces.ravel()]])
    asked = np.unique(asked)
    points, piece = proxy.vertices[asked], labels[asked]
    away = distance.away(points.astype(float))
    cell = proxy.active.spacing
    mean = np.bincount(piece, away, count) / np.maximum(np.bincount(piece, minlength=count), 1)
    far = away > NEAR_MESH * cell
    far[far] = ~_bounds(points[far], proxy.normals[asked[far]], away[far], distance)
    far |= (mean > NO_PIECE * cell)[piece]
    far |= _facing_elsewhere(proxy, asked, piece, distance)
    return Strays(points[far], away[far])


def _bounds(
    points: Points, normals: NDArray, away: NDArray[np.float64], distance: MeshDistance
) -> NDArray[np.bool_]:
    """Whether the inside ends at points (N, 3) of surface with these normals, though they are
    `away` (N,) from the mesh: they are in one of its openings."""
    return distance.facing(points, normals, SHORT_OF_MESH * away) == 1


def _facing_elsewhere(
    proxy: Proxy, vertices: NDArray[np.intp], piece: NDArray[np.integer], distance: MeshDistance
) -> NDArray[np.bool_]:
    """Which `vertices` (N,) are of pieces that do not face as the mesh does where they are: crumbs
    and hollows beside it. The largest piece is none.

    piece: (N,) of each
    """
    chosen = np.flatnonzero(piece != np.bincount(proxy.components.labels).argmax())
    place = vertices[chosen]
    there = distance(proxy.vertices[place].astype(float)).gradient
    cosines = np.einsum("na,na->n", there, proxy.normals[place])
    count = proxy.components.total
    mean = np.bincount(piece[chosen], cosines, count) / np.maximum(
        np.bincount(piece[chosen], minlength=count), 1
    )
    found = np.zeros(len(vertices), bool)
    found[chosen] = mean[piece[chosen]] < FACING_ALIKE
    return found


def find_hidden(
    field: Field,
    proxy: Proxy,
    distance: MeshDistance,
    rng: np.random.Generator,
    reached: Cells | None,
) -> Strays:
    """Places around the surface, in `reached` cells as of `support` if given, that are far from the
    mesh and have f on the wrong side, or nearly, beside them."""
    h = spacing(HIDDEN_LEVEL)
    points = _around_surface(field, proxy, reached, rng)
    value = values(field, points)
    low = np.abs(value) < HIDDEN_LOW * h
    points, value = points[low], value[low]
    true = distance(points.astype(float)).value
    doubted = (value * np.sign(true) < ON_ITS_SIDE * np.abs(true)) & (np.abs(true) > h / 2)
    points, true = points[doubted], true[doubted]
    opened = _bounds(points, normals(field, points), np.abs(true), distance)
    points, true = points[~opened], true[~opened]
    wrong = _worst_around(field, points, true, rng) < WRONG_SHARE * np.abs(true)
    return Strays(points[wrong], np.abs(true[wrong]))


def _around_surface(
    field: Field, proxy: Proxy, reached: Cells | None, rng: np.random.Generator
) -> Points:
    """A place in each cell around the surface that has detail large enough to hide something, and
    in one of eight of the other cells."""
    h = spacing(HIDDEN_LEVEL)
    rings = near = distinct(cells_of(proxy.vertices, HIDDEN_LEVEL), HIDDEN_LEVEL)
    for _ in range(HIDDEN_RINGS):
        rings = dilated(rings, HIDDEN_LEVEL)
    rings = rings[~among(rings, near)]
    large = [np.empty((0, 3), np.float32)]
    for level, part in field.detail.coefficients.items():
        if level >= HIDDEN_LEVEL:
            nodes = part.index[np.abs(part.values) > LARGE_COEFFICIENT * h]
            large.append(centres(places(nodes, level), level))
    detailed = dilated(
        distinct(cells_of(np.concatenate(large), HIDDEN_LEVEL), HIDDEN_LEVEL), HIDDEN_LEVEL
    )
    place = places(rings, HIDDEN_LEVEL)
    asked = np.isin(rings, detailed) | (place % 2 == 0).all(axis=1)
    points = centres(place[asked], HIDDEN_LEVEL)
    if reached is not None:
        points = points[is_within(points, reached)]
    return points + np.float32(h) * (rng.random(points.shape, np.float32) - np.float32(0.5))


def _worst_around(
    field: Field, points: Points, true: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.floating]:
    """The least f (N,) within half the way from points (N, 3) to the mesh, in a ball that is as far
    on one side as its middle; negative on the wrong side.

    true: the signed distance of the points (N,)
    """
    way = rng.standard_normal((len(points), PLACES_IN_BALL, 3))
    way *= (
        rng.random((len(points), PLACES_IN_BALL, 1)) ** (1 / 3)
        / np.linalg.norm(way, axis=2)[..., None]
    )
    around = points[:, None] + np.abs(true)[:, None, None] / 2 * way
    value = values(field, around.reshape(-1, 3)).reshape(len(points), PLACES_IN_BALL)
    return (value * np.sign(true)[:, None]).min(axis=1)


def find_tiny(field: Field, proxy: Proxy, distance: MeshDistance) -> Strays:
    """Strays among the pieces that pass between the points of the proxy's lattice, by the rules for
    pieces that it sees: they are off by more than NO_PIECE, or do not face as the mesh does."""
    points, cell = tiny_places(field, proxy), proxy.active.spacing
    place = points.astype(float)
    away = distance.away(place)
    cosines = np.einsum("na,na->n", distance(place).gradient, normals(field, points))
    stray = (away > NO_PIECE * cell) | (cosines < FACING_ALIKE)
    return Strays(points[stray], away[stray])


def tiny_places(field: Field, proxy: Proxy) -> Points:
    """Places (P, 3) of pieces so small that they pass between the points of the proxy's lattice."""
    surface, near = search_tree(proxy.vertices), TINY * proxy.active.spacing
    return loose_places(field, lambda points: surface.query(points)[0] > near)


def is_within(points: Points, reached: Cells) -> NDArray[np.bool_]:
    """Which of the points (N, 3) are in `reached` cells, as of `support`."""
    return among(linear(cells_of(points, SUPPORT), SUPPORT), reached)
