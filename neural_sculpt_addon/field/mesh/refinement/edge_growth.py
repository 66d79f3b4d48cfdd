# SPDX-License-Identifier: GPL-3.0-or-later
"""Growth of a mesh by its edges: those whose middles are off the surface are split there.

The new vertices go onto f = 0 by Newton steps across their edges. Where a triangle would come out
thin or turned over, an edge of it stays as it is. How far an edge is off is judged by itself
(`edge_middles`), and the triangles on both sides of it split it alike. Model space. See
docs/method.md, section 8.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....common.progress import Progress, sub_progress
from ...evaluate import values_and_gradients
from ...field import Field
from ...geometry import any_true, lengths
from ..proxy import BATCH, FLAT
from ..quality import find_poor
from .edge_middles import Middles, find_middles
from .subdivide import Edges, Subdivision, divided, ends_of, names, open_edges

EDGE_HALVINGS = 4
"""How often an edge is halved at most."""

MOST_STRAY = 0.49
"""Lengths of an edge: the longest step of its new vertex, and from how far off the edge stays, for
what is there has little to do with it. With half as much meshes are a twentieth farther off on
average, at thin places; twice as much makes no difference."""

AWAY = -0.5
"""Cosine of normals, 120 degrees, below which two points are on different sides of something thin:
those of an edge across a right-angled crease are not."""

LEAN = 0.3
"""Share of the normal that is across an edge, below which a point moves along all of it."""

NEWTON_STEPS = 3
"""Newton steps of a new vertex at most. One that moved less than the tolerance needs no further
step: what is left falls with the square. One that moved more in the last has lost its way."""


class Splits(NamedTuple):
    """Edges that are split, by their `names`, and the vertex in the middle of each."""

    edges: NDArray[np.int64]  # (S,), rising
    middles: NDArray[np.int32]  # (S,)


class _New(NamedTuple):
    """New vertices.

    edges: (S,), in the middle of which each is
    stray: (S,), how far from there, in lengths of the edge
    """

    edges: NDArray[np.intp]
    stray: NDArray[np.float32]


class EdgeGrowth:
    """A mesh while its edges are split.

    known: splits of edges on the border of what is split, which are to be as they are; None where
           there is no border
    """

    def __init__(
        self,
        field: Field,
        vertices: NDArray[np.float32],
        normals: NDArray[np.float32],
        known: Splits | None = None,
    ) -> None:
        self.field, self.vertices, self.normals, self.known = field, vertices, normals, known
        self.splits = [in_order(np.empty(0, np.int64), np.empty(0, np.int32))]
        if known is not None:
            self.splits.append(known)

    def all_splits(self) -> Splits:
        """Those of the border, and those that were made."""
        return in_order(*map(np.concatenate, zip(*self.splits, strict=True)))

    def grow(
        self, parts: Subdivision, limit: float, most: int, progress: Progress
    ) -> Subdivision | None:
        """Split the edges of `parts` whose middles are farther than `limit` from the surface, some
        times. None if that takes more than `most` triangles."""
        done, count = [], 0
        for turn in range(EDGE_HALVINGS):
            share = sub_progress(progress, turn / EDGE_HALVINGS, (turn + 1) / EDGE_HALVINGS)
            edges = open_edges(parts)
            middles = find_middles(
                *(self.field, self.vertices, self.normals, edges, limit, self.known is not None),
                sub_progress(share, 0, 0.5),
            )
            whole, parts = self._split(parts, edges, middles, limit, sub_progress(share, 0.5, 1))
            done.append(whole)
            count += len(whole.triangles)
            if count + len(parts.triangles) > most and len(parts.triangles):
                return None
        return Subdivision.together([*done, parts])

    def _split(
        self, parts: Subdivision, edges: Edges, middles: Middles, limit: float, progress: Progress
    ) -> tuple[Subdivision, Subdivision]:
        """Put vertices on the edges of `parts` that are farther off than `limit`; the triangles
        that stay whole, and what the others are divided into.

        Edges on the border have the vertices that they had. One whose new vertex looks away from an
        end stays: the vertex is on another side of a thin wall or groove. So does one whose new
        vertex finds no surface, and one at a triangle that would come out thin or turned over.
        """
        first = len(self.vertices)
        number = self._on_border(edges)
        chosen = np.flatnonzero((middles.off > limit) & (number < 0))
        ends = edges.ends.take(chosen, axis=0)
        points, normals, lost = self._settled(ends, middles.points[chosen], limit, progress)
        low, high = (self.vertices.take(end, axis=0) for end in ends.T)
        way = lengths(points - (low + high) / 2)
        stray = (way / np.maximum(lengths(high - low), FLAT))[:, 0]
        stays = lost | (stray >= MOST_STRAY)
        for end in ends.T:
            stays |= np.einsum("sa,sa->s", self.normals.take(end, axis=0), normals) <= AWAY
        chosen, points, normals = chosen[~stays], points[~stays], normals[~stays]
        number[chosen] = first + np.arange(len(chosen), dtype=np.int32)
        self._add(points, normals)
        whole, fine = self._divided(parts, edges, number, first, _New(chosen, stray[~stays]))
        split = number.take(chosen) >= 0
        if not split.all():
            self.vertices, self.normals = self.vertices[:first], self.normals[:first]
            self._add(points[split], normals[split])
            chosen = chosen[split]
            renumbered = np.arange(first + len(split), dtype=np.int32)
            renumbered[first:] = first - 1 + np.cumsum(split)
            fine = fine._replace(triangles=renumbered.take(fine.triangles))
        middles_of = first + np.arange(len(chosen), dtype=np.int32)
        self.splits.append(in_order(names(edges.ends.take(chosen, axis=0)), middles_of))
        return whole, fine

    def _add(self, points: NDArray[np.float32], normals: NDArray[np.float32]) -> None:
        """Add vertices (N, 3)."""
        self.vertices = np.concatenate([self.vertices, points])
        self.normals = np.concatenate([self.normals, normals])

    def _on_border(self, edges: Edges) -> NDArray[np.int32]:
        """The vertex (E,) in the middle of each edge on the border that has one; -1 for others."""
        number = np.full(len(edges.ends), -1, np.int32)
        if self.known is not None and len(self.known.edges):
            border = np.flatnonzero(edges.alone)
            name = names(edges.ends[border])
            place = np.searchsorted(self.known.edges, name)
            found = self.known.edges.take(place, mode="clip") == name
            number[border[found]] = self.known.middles[place[found]]
        return number

    def _divided(
        self, parts: Subdivision, edges: Edges, number: NDArray[np.int32], first: int, new: _New
    ) -> tuple[Subdivision, Subdivision]:
        """Those of `parts` that stay whole, and what the others are divided into.

        number: (E,) of the vertex in the middle of each edge, or -1; those below `first` are on the
                border, and remain. Of the `new` ones some are taken away, in place: while a
                triangle comes out thin or turned over, its new corner that is farthest from its
                edge goes; where none of its corners is new, all new ones of the whole triangle
        """
        made = list[Subdivision]()
        last = np.full(len(parts.triangles), -1)  # turn at which each was divided, -1 if whole
        looked_at = np.arange(len(parts.triangles))
        while len(looked_at) or not made:
            middle = edges.at_corners(number, looked_at)  # (L, 3)
            marked = any_true(middle >= 0)
            last[looked_at] = np.where(marked, len(made), -1)
            looked_at, middle = looked_at.compress(marked), middle.compress(marked, axis=0)
            given = parts.triangles.take(looked_at, axis=0), looked_at.astype(np.int32)
            found = divided(Subdivision.whole(*given), middle, self.vertices)
            poor = found.where(find_poor(self.field, found.triangles, self.vertices, self.normals))
            stays = np.zeros(len(number) + 1, bool)  # the last one is no edge
            row = np.maximum(poor.triangles - first, -1)  # (P, 3), of the new ones, or -1
            row = row[np.arange(len(row)), np.append(new.stray, -1)[row].argmax(axis=1)]
            stays[new.edges[row[row >= 0]]] = True
            stays[edges.corners[poor.parents[row < 0]]] = True
            stays[:-1] &= number >= first
            stays[-1] = False
            number[stays[:-1]] = -1
            made.append(found)
            looked_at = np.flatnonzero(any_true(stays.take(edges.corners)))
        valid = [each.where(last.take(each.parents) == turn) for turn, each in enumerate(made)]
        fine = Subdivision.together(valid)
        return parts.where(last < 0), fine._replace(parents=parts.parents.take(fine.parents))

    def _settled(
        self,
        ends: NDArray[np.int32],
        points: NDArray[np.float32],
        enough: float,
        progress: Progress,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
        """Points (N, 3) on f = 0 and the normals (N, 3), from points near the middles of edges, and
        which (N,) of them have not come there.

        enough: a step that is shorter is the last one
        """
        low, high = (self.vertices.take(end, axis=0) for end in ends.T)
        along, normals = high - low, np.empty_like(points)
        left = np.arange(len(points))
        for step in range(NEWTON_STEPS):
            off = np.empty(len(left), np.float32)
            for begin in range(0, len(left), BATCH):
                progress((step + begin / len(left)) / NEWTON_STEPS, "Refining the mesh")
                part = left[begin : begin + BATCH]
                reach = MOST_STRAY * lengths(along[part])
                points[part], off[begin : begin + BATCH], normals[part] = _onto(
                    self.field, points[part], along[part], reach
                )
            left = left[off > enough]
        lost = np.zeros(len(points), bool)
        lost[left] = True
        return points, normals, lost


def _onto(
    field: Field,
    points: NDArray[np.float32],
    edges: NDArray[np.float32],
    reach: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Points (N, 3) after a Newton step onto f = 0 across their `edges` (N, 3) and no longer than
    `reach` (N, 1); its length (N,), and the normals (N, 3) where they were.

    Along its edge a point does not slide: the two halves would be of different length.
    """
    value, gradient = values_and_gradients(field, points)
    slope = np.maximum(lengths(gradient), FLAT)
    normals = gradient / slope
    along = edges / np.maximum(lengths(edges), FLAT)
    across = normals - np.einsum("na,na->n", normals, along)[:, None] * along
    lean = lengths(across)
    step = np.where(lean > LEAN, across / np.maximum(lean, LEAN) ** 2, normals)
    step *= value[:, None] / slope
    distance = lengths(step)
    step *= np.minimum(1, reach / np.maximum(distance, FLAT))
    return np.clip(points - step, -1, 1), np.minimum(distance, reach)[:, 0], normals


def in_order(edges: NDArray[np.int64], middles: NDArray[np.int32]) -> Splits:
    order = np.argsort(edges, kind="stable")  # quick, because they are a few rising runs
    return Splits(edges.take(order), middles.take(order))


def renamed(splits: Splits, number: NDArray[np.int32]) -> Splits:
    """Splits after the vertices got another `number` (V,), in the same order, of which those with
    -1 are gone."""
    low, high = (number.take(end) for end in ends_of(splits.edges).T)
    middles = number.take(splits.middles)
    left = np.flatnonzero((low >= 0) & (high >= 0) & (middles >= 0))
    ends = np.stack([low.take(left), high.take(left)], axis=1)
    return Splits(names(ends), middles.take(left))
