# SPDX-License-Identifier: GPL-3.0-or-later
"""Detail where a mesh asks for it, level by level (docs/method.md, section 5).

    samples that miss the tolerance -> cells -> nodes around them -> rows -> coefficients

A level is added only in cells where more than `MISSED_SHARE` of the samples of the mesh miss the
tolerance in distance or normals. Its rows, all in cells that its nodes reach:

    on the mesh     f = 0, and slopes of 0 along a random tangent
    beside it       f = signed distance, at 0.3 to 1.5 h
    in empty cells  f = signed distance on the first level, which puts right what the network got
                    wrong, islands included; on finer ones f as it is, so that nothing drifts
    where f is      f = signed distance: in empty cells where f is near zero, and around samples
    doubted         beside the mesh where it misses their distance by a third

Model space.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.progress import Check, Progress, silent
from ...common.text import Text
from ..evaluate import values, values_and_gradients
from ..field import Field
from ..geometry import areas
from ..levels import Level, cells_of, centres, dilated, distinct, linear, places, spacing
from ..solve.spline_system import Rows, solve_level
from ..threads import in_pieces, join
from .mesh_distance import MeshDistance

Array = NDArray[np.float32]
Cells = NDArray[np.int32]

FIT_COARSEST = 5
"""A draft network is within 0.1 h of the mesh there, but for thin parts. From level 4 on drafts
have a fifth fewer coefficients, and two fifths more error."""

MISSED_SHARE = 0.15
"""Share of a cell's samples: twice as much saves a twentieth of the coefficients, for a twelfth
more error; half as much is 2 % closer."""

DENSITY = 5.0
"""Samples of the mesh for each h^2 of its area: half as many have a quarter more error, twice as
many an eighth less, for a sixth more time."""

PROBE_DENSITY = 6.0
"""Samples for each h^2 of the level before that tell where another one is needed: half or twice as
many change errors by 2 % at most."""

MOST_SAMPLES = 800_000
"""Samples of one level. Three rows each take 650 bytes; what is beyond is thinned out evenly."""

BATCH = 1 << 16  # samples between two looks at a cancel
AT_ONCE = 1 << 13  # points that one thread takes at a time

SIDE_DENSITY, SIDE_FROM, SIDE_TO = 2.0, 0.3, 1.5
"""Samples beside the mesh for each h^2, and from and to how far beside it, h. Errors stay within
2 % between half and twice of any; half of SIDE_DENSITY or SIDE_TO has a twentieth or a tenth fewer
coefficients."""
SIDE_WEIGHT, EMPTY_WEIGHT = 0.3, 0.2
"""Weights, where a sample on the mesh has 1: twice of either takes an eighth or a third more
coefficients, and is less close; half takes a tenth or a twentieth fewer."""
SLOPE_WEIGHT = 0.5
"""Weight, times h: half is 7 % closer with 5 % more coefficients, twice a quarter less close."""
MISS_SHARE = 0.3  # share of a distance by which f may miss it before another part may be near
DOUBTED_SAMPLES = 4  # samples in cells where it may
BELIEVED = 0.5  # |f| / h, below which f is not believed where no sample of the mesh is
NO_BOUND = 0.005  # |f| at a sample that may bound nothing
DOUBTED = 0.5  # cosine between a face and the field, below which the face may be flipped
ROW_REACH, SIDE_CLEARANCE = 0.5, 0.1
"""Cells from the surface that a row may ask for, and of these, how far f must be on its side."""
HEAVIER, HEAVIER_RINGS = 4.0, 3
"""Weight of what is not, and rings of nodes around it that are solved once more."""

GROSS = 5.0
"""Times the tolerance: what misses by more, creases and gaps thinner than a cell, gets one level
more than the preset's finest. Fits take 20 to 60 % longer, and are 10 to 50 % closer."""

ITERATIONS = 10
"""Of conjugate gradients: a level only adds what coarser ones miss. 30 are 1 % closer."""
DAMPED = 1.0
"""Of the mean diagonal, for nodes that few rows touch. With 0.1 there are crumbs near creases."""

LEFT_OUT = 0.05
"""Of the mean diagonal: 0 takes half as many coefficients more for a twentieth less of error."""


class FitTolerance(NamedTuple):
    """What is close enough, and the finest level that may be used for it."""

    distance: float  # model units
    degrees: float  # of normals
    finest: int


class _Samples(NamedTuple):
    """Samples of the mesh, and the field there."""

    points: Array  # (N, 3)
    normals: Array  # (N, 3)
    value: Array  # (N,)
    gradient: Array  # (N, 3)

    def where(self, chosen: NDArray[np.bool_]) -> "_Samples":
        return _Samples(*(array[chosen] for array in self))


def refine(
    field: Field,
    distance: MeshDistance,
    tolerance: FitTolerance,
    rng: np.random.Generator,
    progress: Progress = silent,
    preview: Callable[[Field], None] = lambda _: None,
    enough: Callable[[], bool] = lambda: False,
) -> Field:
    """The field with detail wherever it missed the mesh by more than the tolerance.

    preview: given the field after each level but the last
    enough:  once it is true, no other level is begun

    Where the finest level of the tolerance misses by GROSS times as much, there is one more.
    """
    levels = range(FIT_COARSEST, tolerance.finest + 2)
    for done, level in enumerate(levels):
        if level > tolerance.finest:
            tolerance = FitTolerance(GROSS * tolerance.distance, GROSS * tolerance.degrees, level)
        if enough():
            break
        if done:
            preview(field)
        check = partial(progress, done / len(levels), Text("Fitting detail, level {}", level))
        check()
        candidates = None
        if done:
            probes = _sample(field, distance, PROBE_DENSITY / spacing(level - 1) ** 2, rng, check)
            missed = _missed(probes, level - 1, tolerance)
            if not len(missed):
                break
            candidates = dilated(missed, level - 1)
        samples = _sample(
            field, distance, DENSITY / spacing(level) ** 2, rng, check, candidates, level - 1
        )
        flagged = _missed(samples, level, tolerance)
        if not len(flagged):
            break
        nodes = dilated(flagged, level)
        rows = _rows(field, distance, samples, nodes, level, rng, check)
        field = field.plus({level: _solved(level, nodes, rows, check)})
    return field


def _solved(level: int, nodes: Cells, rows: Rows, check: Check) -> Level:
    """The coefficients of a level; rows that came out on the wrong side weigh more, and the nodes
    around them are solved once more."""
    found = solve_level(level, nodes, rows, check, ITERATIONS, DAMPED, LEFT_OUT)
    near = weigh_wrong_side(rows, level)
    if not len(near):
        return found
    reached = dilated(near, level)
    some = rows.where(among(linear(cells_of(rows.points, level), level), reached))
    again = solve_level(level, near[among(near, nodes)], some, check, ITERATIONS, DAMPED, LEFT_OUT)
    return Level.sum([found, again])


def weigh_wrong_side(rows: Rows, level: int) -> Cells:
    """Let rows that came out on the wrong side, or hardly on theirs, weigh more; the nodes (K,) of
    a level around them."""
    value = (rows.targets - rows.residuals) * np.sign(rows.targets)
    wrong = (np.abs(rows.targets) > ROW_REACH * spacing(level)) & (
        value < SIDE_CLEARANCE * spacing(level)
    )
    rows.weights[wrong] *= HEAVIER
    near = distinct(cells_of(rows.points[wrong], level), level)
    for _ in range(HEAVIER_RINGS if len(near) else 0):
        near = dilated(near, level)
    return near


def _sample(
    field: Field,
    distance: MeshDistance,
    density: float,
    rng: np.random.Generator,
    check: Check,
    cells: Cells | None = None,
    level: int = 0,
) -> _Samples:
    """Samples of the mesh and its films, `density` for each unit of area, in `cells` of `level` if
    given."""
    area = float(areas(distance.vertices[distance.faces]).sum())
    parts = int(density * area / BATCH) + 1
    found = []
    for _ in range(parts):
        check()
        surface = distance.surface(int(density * area / parts) + 1, rng, films=True)
        points, normals = surface.points.astype(np.float32), surface.normals.astype(np.float32)
        if cells is not None:
            inside = among(linear(cells_of(points, level), level), cells)
            points, normals = points[inside], normals[inside]
        if (most := MOST_SAMPLES // parts + 1) < len(points):
            chosen = np.linspace(0, len(points) - 1, most).astype(int)
            points, normals = points[chosen], normals[chosen]
        samples = _Samples(points, normals, *values_and_gradients(field, points))
        found.append(_facing_outward(samples, distance))
    return join(found)


def _facing_outward(samples: _Samples, distance: MeshDistance) -> _Samples:
    """The samples with flipped normals turned, without those that bound nothing.

    The field knows the outside but where it is far off the mesh: there winding numbers are asked.
    """
    doubtful = (_cosine(samples) < DOUBTED) | (np.abs(samples.value) > NO_BOUND)
    doubtful = np.flatnonzero(doubtful)
    if not len(doubtful):
        return samples
    facing = distance.facing(samples.points[doubtful], samples.normals[doubtful])
    samples.normals[doubtful] *= facing[:, None]
    kept = np.ones(len(samples.points), bool)
    kept[doubtful[facing == 0]] = False
    return samples.where(kept)


def _cosine(samples: _Samples) -> Array:
    slope = np.linalg.norm(samples.gradient, axis=1)
    return (samples.gradient * samples.normals).sum(axis=1) / np.maximum(slope, 1e-9)


def _missed(samples: _Samples, level: int, tolerance: FitTolerance) -> Cells:
    """The cells of a level in which too many of the samples miss the tolerance, rising."""
    missed = np.abs(samples.value) > tolerance.distance
    missed |= _cosine(samples) < np.cos(np.radians(tolerance.degrees))
    cells = linear(cells_of(samples.points, level), level)
    found, home, count = np.unique(cells, return_inverse=True, return_counts=True)
    return found[np.bincount(home, missed, len(found)) > MISSED_SHARE * count]


def _rows(
    field: Field,
    distance: MeshDistance,
    samples: _Samples,
    nodes: Cells,
    level: int,
    rng: np.random.Generator,
    check: Check,
) -> Rows:
    """The equations for the `nodes` of a level."""

    def evaluated(points: Array) -> Array:
        return in_pieces(lambda part: values(field, points[part]), len(points), check, size=AT_ONCE)

    h = spacing(level)
    reached = dilated(nodes, level)
    cells = linear(cells_of(samples.points, level), level)
    inside = among(cells, reached)
    on, cells = samples.where(inside), cells[inside]
    tangent = rng.standard_normal(on.points.shape, np.float32)
    tangent -= (tangent * on.normals).sum(axis=1, keepdims=True) * on.normals
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)

    chosen = rng.random(len(on.points)) < SIDE_DENSITY / DENSITY
    side = rng.uniform(SIDE_FROM, SIDE_TO, chosen.sum()) * rng.choice([-h, h], chosen.sum())
    beside = on.points[chosen] + side[:, None].astype(np.float32) * on.normals[chosen]
    value = evaluated(beside)
    doubted = np.abs(value - side) > MISS_SHARE * np.abs(side)
    puzzling = np.unique(linear(cells_of(beside[doubted], level), level))
    empty = np.concatenate([np.setdiff1d(reached, cells), np.repeat(puzzling, DOUBTED_SAMPLES)])
    apart = centres(places(empty, level), level)
    apart += rng.uniform(-h / 2, h / 2, apart.shape).astype(np.float32)

    off = np.concatenate([beside, apart])
    value = np.concatenate([value, evaluated(apart)])
    target = np.concatenate([side, value[len(side) :]])
    asked = np.concatenate([doubted, np.abs(value[len(side) :]) < BELIEVED * h])
    asked[len(asked) - DOUBTED_SAMPLES * len(puzzling) :] = True
    asked |= level == FIT_COARSEST
    target[asked] = distance(off[asked].astype(float), lambda *_: check()).value
    points = np.concatenate([on.points, off])
    residuals = np.concatenate([-on.value, target - value]).astype(np.float32)
    weights = np.repeat([1, SIDE_WEIGHT, EMPTY_WEIGHT], [len(on.points), len(beside), len(apart)])
    return Rows(
        points=points,
        targets=np.concatenate([np.zeros(len(on.points)), target]).astype(np.float32),
        residuals=residuals,
        weights=weights.astype(np.float32),
        at=np.arange(len(on.points)),
        along=tangent,
        slopes=-(on.gradient * tangent).sum(axis=1),
        steep=np.full(len(on.points), SLOPE_WEIGHT * h, np.float32),
    )


def among(cells: Cells, some: Cells) -> NDArray[np.bool_]:
    """Which of the cells (N,) are among `some`, which rise."""
    if not len(some):
        return np.zeros(len(cells), bool)
    place = np.searchsorted(some, cells)
    return some[np.minimum(place, len(some) - 1)] == cells
