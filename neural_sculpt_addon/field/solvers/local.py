# SPDX-License-Identifier: GPL-3.0-or-later
"""The local solver: a stroke becomes coefficients near it, and nothing else of the field changes."""

import math

import numpy as np
from scipy.spatial import KDTree

from ...stroke.progress import Progress, silent
from ..detail import FINEST, Coefficients, cells_of, centres, linear, places, spacing
from ..evaluate import values, values_and_gradients
from ..problem import Problem
from ..projection import project
from ..surface import Samples
from ..threads import join
from .spline_system import Rows, solve_level

DENSITY = 8.0  # tube samples per h^2
BUDGET = 60_000
COARSEST = 5
MARGIN = 1.5  # cells
PRESERVE, AROUND, STEEP = 1.5, 0.3, 0.5


def feature(problem: Problem) -> float:
    brush = problem.laid[0].stroke.brush
    b = brush.profile(np.linspace(-1, 1, 257))
    sign = np.sign(np.diff(b))
    sign = sign[sign != 0]
    pieces = 1 + np.count_nonzero(np.diff(sign)) if len(sign) else 1
    return 2 * brush.radius / max(pieces, 2)


def finest_level(problem: Problem) -> int:
    area = 0.0
    for stroke, path in problem.laid:
        r = stroke.brush.radius * stroke.largest_factor
        area += 2 * r * path.length + math.pi * r * r
    level = round(math.log2(4 / feature(problem)))
    most = math.floor(math.log2(BUDGET / (DENSITY * max(area, 1e-9))) / 2)
    return max(min(level, most, FINEST), COARSEST)


def tubes_for(problem, h):
    spacing_ = h / DENSITY**0.5
    radius = problem.laid[0].stroke.brush.radius * problem.laid[0].stroke.largest_factor
    length = max(l.path.length for l in problem.laid)
    columns = max(math.ceil(2 * radius / spacing_), 7)
    rows = max(math.ceil((length or 2 * radius) / spacing_), 3)
    return problem.tubes(rows, columns, np.random.default_rng(problem.seed))


def solve(problem: Problem, progress: Progress = silent) -> Coefficients:
    field = problem.field
    random = np.random.default_rng(problem.seed)
    finest = finest_level(problem)
    h = spacing(finest)
    tubes = tubes_for(problem, h)
    surface, target = (join([getattr(t, n) for t in tubes]) for n in ("surface", "target"))
    amount = np.concatenate([t.displacement.amount for t in tubes])
    out = {}
    cells = active_cells(surface, target, finest, h)
    reach = dilated(cells, finest)
    kept = preserve(problem, reach, finest, random)
    around = column(field, target, kept, cells, finest, random)
    pick = random.random(len(target.points)) < 0.5
    at = target.points[pick]
    e = random.normal(size=at.shape).astype(np.float32)
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    points = np.concatenate([target.points, kept.points, around[0]])
    want = np.concatenate([np.zeros(len(target.points)), values(field, kept.points), around[1]])
    w = np.concatenate(
        [
            np.ones(len(target.points)),
            np.full(len(kept.points), PRESERVE),
            np.full(len(around[0]), AROUND),
        ]
    )
    g = values_and_gradients(field, at)[1]
    rows = Rows(
        points.astype(np.float32),
        (want - values(field, points)).astype(np.float32),
        w.astype(np.float32),
        at,
        e,
        ((target.normals[pick] - g) * e).sum(1).astype(np.float32),
        np.full(len(at), STEEP * h, np.float32),
    )
    for level in (finest - 1, finest):
        c = cells if level == finest else np.unique(cells // 2 + (0 if True else 0), axis=0)
        if level != finest:
            c = np.unique(linear(cells_of(centres(places(cells, finest), finest), level), level))
        out[level] = solve_level(level, c.astype(np.int32), rows, problem.check)
    solve.info = dict(
        finest=finest,
        tube=len(target.points),
        kept=len(kept.points),
        around=len(around[0]),
        nodes=[len(l.index) for l in out.values()],
        res=float(np.abs(rows.residuals[: len(target.points)]).mean()),
    )
    return out


def active_cells(surface, target, level, h):
    way = target.points - surface.points
    length = np.linalg.norm(way, axis=1)
    steps = max(int(math.ceil(length.max() / (0.7 * h))), 1) if len(length) else 1
    pts = [surface.points + t * way for t in np.linspace(0, 1, steps + 1)]
    for s in (surface, target):
        for t in (-MARGIN, -MARGIN / 2, MARGIN / 2, MARGIN):
            pts.append(s.points + t * h * s.normals)
    pts = np.concatenate(pts)
    return np.unique(linear(cells_of(pts, level), level))


def dilated(index, level):
    c = places(index, level)
    steps = np.array(
        [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)], np.int32
    )
    return np.unique(linear((c[:, None] + steps).reshape(-1, 3), level))


def preserve(problem: Problem, reach, level, random) -> Samples:
    h = spacing(level)
    mid = centres(places(reach, level), level)
    v = values(problem.field, mid)
    near = mid[np.abs(v) < 2.0 * h]
    near = np.repeat(near, 3, axis=0)
    near = near + random.uniform(-h / 2, h / 2, near.shape).astype(np.float32)
    found = project(problem.field, near, tolerance=1e-4)
    ok = found.distance < 1e-3
    pts, nrm = found.points[ok], found.normals[ok]
    inside = np.isin(linear(cells_of(pts, level), level), reach)
    s = Samples(pts[inside], nrm[inside])
    return s.where(problem.untouched(s))


def column(field, target, kept, cells, level, random):
    h = spacing(level)
    mid = centres(places(cells, level), level)
    pts = (mid + random.uniform(-h / 2, h / 2, mid.shape)).astype(np.float32)
    cloud = join([target, kept])
    nearest = KDTree(cloud.points).query(pts)[1]
    d = ((pts - cloud.points[nearest]) * cloud.normals[nearest]).sum(1)
    keep = nearest < len(target.points)
    f0 = values(field, pts)
    return pts, np.where(keep, d, f0)
