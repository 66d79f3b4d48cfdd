# SPDX-License-Identifier: GPL-3.0-or-later
"""Absorption: what brushes of Blender's do to a proxy, and strokes that reshape what is there
(docs/method.md, section 6).

A dab moves places as a formula says, so it is known where all of the surface belongs, between the
vertices too. Of a stroke that reshapes, the surface that was asked for with the constants as they
are is what is measured from.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from neural_sculpt_addon.common.progress import silent
from neural_sculpt_addon.field.edit.absorb import absorb
from neural_sculpt_addon.field.edit.brushed import absorb_brushed
from neural_sculpt_addon.field.edit.brushed_surface import Brushed
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.edit.reshape import reshape
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.geometry import angles
from neural_sculpt_addon.field.levels import Coefficients
from neural_sculpt_addon.field.mesh.proxy import Proxy, extract
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import Preparation
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.stroke.stroke import Kind, Stroke

from .strokes import SHAPES, drawn, packed
from .subject import Case, Made, Subject, layer_bits

Array = NDArray[np.float32]

FINE = 320  # cells per axis of the proxy that tells where the surface belongs
RADII = (0.08, 0.15)  # of dabs
NEAR = 1.5  # radii from a dab's middle to which what it did not move is measured
RESHAPED = (0.15, 1.0)  # radius and strength of strokes that reshape
DEEP = 0.05  # of the strokes before


class Dab(NamedTuple):
    """A brush that acts around a place."""

    move: Callable[[Array, Array, float], Array]
    center: Array
    radius: float

    def __call__(self, points: Array, normals: Array) -> Array:
        """Where points (N, 3) of the surface go."""
        share = np.linalg.norm(points - self.center, axis=1, keepdims=True) / self.radius
        way = self.move(points, normals, self.radius)
        return (points + np.clip(1 - share**2, 0, None) ** 2 * way).astype(np.float32)


def inflated(points: Array, normals: Array, radius: float) -> Array:
    """Out by a third of the radius."""
    return radius / 3 * normals


def grabbed(points: Array, normals: Array, radius: float) -> Array:
    """Along with the brush, nearly as far as it is wide."""
    return radius * np.array([0.5, 0.5, 0.4], np.float32) + 0 * points


def rippled(points: Array, normals: Array, radius: float) -> Array:
    """Waves shorter than the brush."""
    return radius / 12 * np.sin(9 * points / radius).sum(axis=1, keepdims=True) * normals


class Goal(NamedTuple):
    """Where the surface belongs, moved or not."""

    moved: Samples
    still: Array  # (N, 3)


DABS = (inflated, grabbed, rippled)
KINDS = (Kind.SMOOTH, Kind.FLATTEN, Kind.PINCH)


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Dabs on a part of a proxy and on a whole one, and strokes that reshape, in turn."""
    found = list[Case]()
    for number in range(count):
        on, turn = _sculpted(SHAPES[number % len(SHAPES)], seed), number // 2
        rng = np.random.default_rng([seed, number])
        if number % 2:
            found.append(_reshaping(on, seed, number, more, KINDS[turn % len(KINDS)]))
        else:
            middle = on.proxy.vertices[rng.integers(len(on.proxy.vertices))]
            dab = Dab(DABS[rng.integers(len(DABS))], middle, rng.uniform(*RADII))
            found.append(partial(_by_whole if turn % 3 == 2 else _by_part, on, dab, more))
    return found


@cache
def _sculpted(shape: str, seed: int) -> Preparation:
    """A field that has detail."""
    now = packed(shape)
    for number in (0, 2):
        now = sculpt(now, drawn(now, seed, number, 0, DEEP)).preparation
    return now


@cache
def _fine(field: Field) -> Proxy:
    return extract(field, FINE)


def _goal(on: Preparation, dab: Dab) -> Goal:
    fine = _fine(on.field)
    there = dab(fine.vertices, fine.normals)
    away = np.linalg.norm(fine.vertices - dab.center, axis=1)
    moves, stays = away < dab.radius, (away > dab.radius) & (away < NEAR * dab.radius)
    triangles = fine.triangles.astype(np.int64)
    normals = np.asarray(igl.per_vertex_normals(there.astype(float), triangles), np.float32)
    return Goal(Samples(there[moves], normals[moves]), fine.vertices[stays])


def _by_part(on: Preparation, dab: Dab, more: int) -> Made:
    """As Blender sends it: the triangles that moved and a ring around them."""
    proxy = on.proxy
    after = dab(proxy.vertices, proxy.normals)
    ring = (after != proxy.vertices).any(axis=1)
    ring[proxy.triangles[ring[proxy.triangles].any(axis=1)]] = True
    chosen = proxy.triangles[ring[proxy.triangles].any(axis=1)]
    used, corners = np.unique(chosen, return_inverse=True)
    part = Brushed(proxy.vertices[used], after[used], corners.reshape(-1, 3).astype(np.int32))
    done = absorb_brushed(on, part, seed=more)
    pieces = int(done.preparation.proxy.components.total != proxy.components.total)
    return _made(done.preparation.field, done.layer, pieces, partial(_goal, on, dab))


def _by_whole(on: Preparation, dab: Dab, more: int) -> Made:
    """As a mesh of which nothing is known."""
    proxy = on.proxy
    done = absorb(on.field, dab(proxy.vertices, proxy.normals), proxy.triangles, seed=more)
    pieces = int(done.report["components"] != proxy.components.total)
    return _made(done.field, done.layer, pieces, partial(_goal, on, dab))


def _reshaping(on: Preparation, seed: int, number: int, more: int, kind: Kind) -> Case:
    """A stroke that reshapes, and the goal that it has as things are."""
    radius, strength = RESHAPED
    stroke = drawn(on, seed, 2 * number, 0, DEEP)
    brush = replace(stroke.brush, radius=radius, intensity=strength)
    stroke = replace(stroke, kind=kind, brush=brush)
    asked = reshape(pose(on, stroke), silent).goal.after
    away = np.linalg.norm(on.surface.points[:, None] - stroke.points[None], axis=2).min(axis=1)
    still = on.surface.points[(away > radius * 1.1) & (away < NEAR * radius)]
    goal = Goal(asked, still)
    return partial(_reshaped, on, replace(stroke, seed=stroke.seed + more), goal)


def _reshaped(on: Preparation, stroke: Stroke, goal: Goal) -> Made:
    done = reshape(pose(on, stroke), silent).stroke
    pieces = done.preparation.proxy.components.total != on.proxy.components.total
    return _made(done.preparation.field, done.layer, int(pieces), lambda: goal)


def _made(field: Field, layer: Coefficients, pieces: int, goal: Callable[[], Goal]) -> Made:
    return Made(layer_bits(layer), lambda: _measured(field, layer, pieces, goal()))


def _measured(field: Field, layer: Coefficients, pieces: int, goal: Goal) -> dict[str, Any]:
    found = find_surface(field, goal.moved.points)
    return {
        "error_mean": float(found.distance.mean()),
        "error_p95": float(np.percentile(found.distance, 95)),
        "normal_deg": float(angles(found.normals, goal.moved.normals).mean()),
        "drift": float(find_surface(field, goal.still).distance.mean()),
        "coefficients": sum(len(level.index) for level in layer.values()),
        "pieces": pieces,
    }


SUBJECT = Subject(
    cases=cases,
    count=12,
    constants={
        "edit.absorb": ("MOVED", "FLATTEST"),
        "edit.absorption": (
            *("LARGEST_CELLS", "DEPTH", "CLEARED", "CLEAR", "HEAVIER", "STEP_OF_WAY"),
        ),
        "edit.absorption_rows": ("MOVED_PER_SIDE", "KEPT_WEIGHT"),
        "edit.gone": ("REPAIRS",),
        "edit.patch": ("FINEST_PATCH", "HELD"),
        "edit.brushed": (
            *("CLOSE_ENOUGH.distance", "CLOSE_ENOUGH.slope", "OF_WAY", "REPAIRS"),
            *("STRETCHED_EDGE", "LAYER_REACH", "WITHIN"),
        ),
        "edit.brushed_surface": ("MOST_VERTICES", "BETWEEN"),
        "edit.reshape": ("SURROUNDINGS", "FINE_EDGE", "PER_CELL", "RINGS"),
        "fit.fit_detail": (
            *("MISSED_SHARE", "SIDE_WEIGHT", "EMPTY_WEIGHT", "SLOPE_WEIGHT", "ITERATIONS"),
            "DAMPED",
        ),
        "solve.spline_system": ("LEAST_TOUCHED",),
    },
    ratios=("error_mean", "error_p95", "normal_deg", "drift", "coefficients"),
    sums=("pieces",),
)
