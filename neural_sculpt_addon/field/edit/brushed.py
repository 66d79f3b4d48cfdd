# SPDX-License-Identifier: GPL-3.0-or-later
"""A brush stroke of Blender's on a part of the proxy becomes a layer (docs/method.md, section 6).

    triangles before and after -> rows where they moved -> coefficients -> vertices on the new field

`absorb` takes a whole mesh and assumes nothing of it. Here only the triangles that a brush moved
come, with those around them, and it is known where they were. All else of the surface is where the
field has it, so the cost is that of the region and not of the mesh. The new inside is

    [f < 0] + w(triangles after) - w(triangles before) > 1/2

with w the winding number: both patches have the same border, so together they bound what was added
and taken away. The vertices then move onto the new zero level and the mesh keeps its triangles,
unless the brush has stretched or folded them. Model space.
"""

import time
from typing import Any, NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...common.progress import Progress, silent, sub_progress
from ..fit.fit_detail import FIT_COARSEST
from ..fit.fit_report import deviation
from ..geometry import areas, face_normals
from ..levels import Coefficients, spacing, support
from ..mesh.pieces import Asked, find_islands
from ..mesh.proxy import Proxy, update
from ..mesh.surface import spatial_order
from ..problem.prepare import Preparation
from ..projection import ARRIVED, Projection, project
from .absorb import refuse_outside
from .absorption import Absorption, Closely, Tolerance
from .brushed_surface import Brushed, BrushedSurface, brushed_surface
from .lost import lost
from .patch import Patch

Array = NDArray[np.float32]

CLOSE_ENOUGH, OF_WAY = Tolerance(1.5e-4, 0.1), 0.1
"""Half of what an artist could see, and 6 degrees: where more is missed, a finer level comes. With
1e-4 and 0.05 results are a quarter closer and take a tenth more time. The distance is at most
OF_WAY times the longest way of a vertex, so that a faint stroke is not lost."""

REPAIRS = 4
"""How often at most pieces that nobody asked for are taken away."""

STRETCHED_EDGE = 2.5
"""Times the usual edge, and what it was, from which on a triangle shows the field too coarsely."""

LAYER_REACH = 3.0
"""Of the coarsest cell, how far from what was moved the layer reaches."""

WITHIN = 0.5
"""Of an edge, the distance from the brushed triangles up to which they tell all of the surface."""


class Snapped(NamedTuple):
    """Where vertices are on the new field."""

    vertices: Array  # (P, 3)
    normals: Array  # (P, 3), unit


class AbsorbedStroke(NamedTuple):
    """The field that has taken in what a brush did, and the layer that does it.

    report:   as of `absorb.Absorbed`
    is_shown: whether the triangles show the new surface well
    """

    preparation: Preparation
    layer: Coefficients
    report: dict[str, Any]
    snapped: Snapped
    is_shown: bool


def absorb_brushed(
    preparation: Preparation, brushed: Brushed, *, seed: int = 0, progress: Progress = silent
) -> AbsorbedStroke:
    """The field of `preparation` after a part of its proxy was `brushed`.

    SculptError when nothing was moved, or something out of the box.
    """
    start = time.monotonic()
    _check(brushed)
    if not (brushed.before != brushed.after).any():
        raise SculptError("The proxy is as the field made it; there is nothing to absorb.")
    refuse_outside(brushed.after)
    surface = brushed_surface(preparation.field, brushed)
    solution = Absorption(
        preparation.field,
        _with_rest(surface, preparation.proxy),
        _SignedDistance(surface.brushed),
        surface.finest,
        np.random.default_rng(seed),
        sub_progress(progress, 0.0, 0.6),
        surface.origins,
        Closely(_tolerance(surface), surface.between),
    )
    done = _without_islands(preparation, solution, surface.patch, sub_progress(progress, 0.6, 0.9))
    points, gradients, moved = surface.patch
    found = project(done.field, points, tolerance=ARRIVED)
    off = np.linalg.norm(found.points - points, axis=1)[moved]
    report = {
        **deviation(found.where(moved), points[moved], gradients[moved]),
        **lost(points[moved], off),
        "components_before": preparation.proxy.components.total,
        "components_after": done.proxy.components.total,
        "seconds": time.monotonic() - start,
    }
    of_vertices = found.where(np.arange(len(points)) < len(brushed.after))
    snapped = _snap(of_vertices, brushed)
    is_shown = bool((of_vertices.distance < ARRIVED).all()) and not _is_bent(snapped, brushed)
    return AbsorbedStroke(done, solution.layer, report, snapped, is_shown)


def _tolerance(surface: BrushedSurface) -> Tolerance:
    """What is close enough."""
    return CLOSE_ENOUGH._replace(
        distance=min(CLOSE_ENOUGH.distance, OF_WAY * _longest_way(surface))
    )


def _longest_way(surface: BrushedSurface) -> float:
    """Of a sample, by the brush."""
    there = surface.patch.points[surface.patch.moved]
    return float(np.linalg.norm(there - surface.origins, axis=1).max())


def _check(brushed: Brushed) -> None:
    """SculptError when these are no triangles before and after."""
    before, after, triangles = brushed
    points = before.dtype == after.dtype == np.float32 and before.ndim == 2
    corners = triangles.dtype == np.int32 and triangles.ndim == 2 and triangles.shape[1] == 3
    if not (points and corners and before.shape == after.shape == (len(before), 3)):
        raise SculptError("A brushed part of the proxy is made of vertices and triangles.")
    if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(before):
        raise SculptError("Triangles of the brushed proxy name vertices that it does not have.")
    if not (np.isfinite(before).all() and np.isfinite(after).all()):
        raise SculptError(
            "Vertices of the brushed proxy have no finite position (NaN or infinite)."
        )


def _without_islands(
    before: Preparation, solution: Absorption, new: Patch, progress: Progress
) -> Preparation:
    """The field with the layer, in which pieces that the brush did not make are taken away."""
    repairs = 0
    while True:
        field = before.field.plus(solution.layer)
        proxy = update(before.proxy, field, support(solution.layer), progress)
        done = Preparation(field, proxy)
        if repairs == REPAIRS or proxy.components.total == before.proxy.components.total:
            return done
        _, old, now = np.intersect1d(before.proxy.edges, proxy.edges, return_indices=True)
        held = before.proxy.vertices[old]
        held = held[(held == proxy.vertices[now]).all(axis=1)]
        islands = find_islands(proxy, Asked(new.points[new.moved], held, before.proxy))
        if not len(islands.points):
            return done
        solution.forbid(islands)
        repairs += 1


class _SignedDistance:
    """The signed distance to a surface of which a part was brushed."""

    def __init__(self, brushed: Brushed) -> None:
        """Of these triangles."""
        self._after = brushed.after.astype(float)
        self._triangles = brushed.triangles.astype(np.int64)
        self._tree = igl.AABB()
        self._tree.init(self._after, self._triangles)
        some = self._triangles[brushed.changed[self._triangles].any(axis=1)]
        both = np.concatenate([self._after, brushed.before.astype(float)])
        self._added = igl.FastWindingNumberBVH()
        some = np.concatenate([some, some[:, ::-1] + len(self._after)])
        self._added.init(both, some, 2)
        self._low, self._high = both[some].min(axis=(0, 1)), both[some].max(axis=(0, 1))

    def __call__(self, points: Array, value: Array, near: NDArray[np.bool_]) -> NDArray[np.float64]:
        """At `points` (N, 3), where the field was `value` (N,). It is no more than a sign where the
        brushed surface is not `near` (N,) and the side is what it was."""
        within = np.flatnonzero(((points > self._low) & (points < self._high)).all(axis=1))
        within = within[spatial_order(points[within])]  # neighbours walk the same branches
        added = np.zeros(len(points))
        added[within] = self._added.winding_number(points[within].astype(float), 2.0)
        inside = (value < 0) + added > 0.5
        asked = np.flatnonzero(near | (inside != (value < 0)))
        asked = asked[spatial_order(points[asked])]
        queries = points[asked].astype(float)
        square = self._tree.squared_distance(self._after, self._triangles, queries)[0]
        signed = np.where(inside, -1.0, 1.0)
        signed[asked] *= np.sqrt(np.asarray(square))
        return signed


def _with_rest(surface: BrushedSurface, proxy: Proxy) -> Patch:
    """The brushed patch and, unmoved, what coarse levels reach of the surface beyond it: vertices
    of the proxy."""
    new, brushed = surface.patch, surface.brushed
    moved = np.concatenate([new.points[new.moved], surface.origins])
    margin = LAYER_REACH * max(spacing(FIT_COARSEST), _longest_way(surface))
    low, high = moved.min(axis=0) - margin, moved.max(axis=0) + margin
    near = np.flatnonzero(((proxy.vertices > low) & (proxy.vertices < high)).all(axis=1))
    tree = igl.AABB()
    before, triangles = brushed.before.astype(float), brushed.triangles.astype(np.int64)
    tree.init(before, triangles)
    edge = np.linalg.norm(np.diff(before[triangles[:, :2]], axis=1), axis=2).mean()
    points = proxy.vertices[near].astype(float)
    distance = np.asarray(tree.squared_distance(before, triangles, points)[0])
    near = near[distance > (WITHIN * edge) ** 2]
    return Patch(
        np.concatenate([new.points, proxy.vertices[near]]),
        np.concatenate([new.gradients, proxy.normals[near]]),
        np.concatenate([new.moved, np.zeros(len(near), bool)]),
    )


def _snap(found: Projection, brushed: Brushed) -> Snapped:
    """The vertices on the zero level, as `found`; where that was not, as the brush left them."""
    moves = brushed.changed & (found.distance < ARRIVED)
    return Snapped(np.where(moves[:, None], found.points, brushed.after), found.normals)


def _is_bent(snapped: Snapped, brushed: Brushed) -> bool:
    """Whether triangles are stretched, or fold."""
    before, _, triangles = brushed
    corners = snapped.vertices[triangles].astype(float)  # (T, 3, 3)
    edges, was = (_edges(each) for each in (corners, before[triangles]))  # (T, 3)
    usual = np.linalg.norm(np.diff(before[triangles[:, :2]], axis=1), axis=2).mean()
    facing = np.einsum("ti,tci->tc", face_normals(corners), snapped.normals[triangles])
    folded = areas(corners[(facing <= 0).any(axis=1)]).sum()  # slivers may look anywhere
    return bool((edges > STRETCHED_EDGE * np.maximum(usual, was)).any() or folded > usual**2)


def _edges(corners: Array) -> Array:
    """The lengths (T, 3) of the edges of triangles (T, 3, 3)."""
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
