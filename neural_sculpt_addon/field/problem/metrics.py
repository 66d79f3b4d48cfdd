# SPDX-License-Identifier: GPL-3.0-or-later
"""How well an edit did what the stroke asked, and what else it changed (docs/method.md, section 9).

All lengths are in model space, absolute, and refer to these regions of the unedited surface, by
distance from the path in radii (the nearest copy of a mirrored stroke counts):

core   <= 1 and beside the path; what lies around an end is the cap, reported apart
rim    1 to 1.4; and what lies within two of the solver's finest cells of the displaced surface,
       where that meets another part: such cells round the crease between both
far    the rest of > 1.4, and the other sheet of thin parts

What the displaced surface covers or carves away where it runs through itself, as the far side of a
thin part, is in none of them: it is no surface any more.

Definitions
tube     distance of displaced surface samples p + d n of the core from the edited zero set. The
         samples are fresh: a jittered grid, not the one that was trained on
cap      the same around round ends and dabs
reverse  distance of the edited proxy under the stroke from the displaced surface: triangles between
         the same samples, bent as the normals there say; where the displaced surface runs through
         itself, also between the proxy's own vertices (see `reverse`)
height   largest |d| of the samples
gain     share of the asked displacement that was reached: sum t d / sum d^2 with t, the
         displacement along n that was
outside  share of the samples that shall be out of the box, where the field ends
rim      distance of unedited samples of the rim from the edited zero set
drift    the same for far samples
untouched_normal  angle between the normals of far samples before and after, degrees: root mean
         square, and most, with the place where
normal   angle between grad f at the tube samples, brought to the edited zero set, and the normal
         of the displaced surface, degrees
gradient mean | |grad f| - 1 | over the tube samples, after the edit
components  connected pieces of the proxy before and after
tolerance_met  tube_p95 and reverse_p95 below `tolerance`, gain at least GAIN, nothing outside,
         untouched_normal_rms at most TURNED, no piece more or less
chamfer  mean distance of 100,000 samples of either surface to the nearest sample of the other, both
         directions added (paper, table 2), and the same between two samplings of the target: the
         noise floor, below which nothing can be told

The distance of a point from the zero set is the way that projection moves it; where projection has
not arrived, it is at least the first-order estimate |f| / |grad f|.
"""

from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.progress import Progress, silent
from ..evaluate import values_and_gradients
from ..field import Field
from ..geometry import angles
from ..levels import SUPPORT, cells_of, linear
from ..mesh.pieces import components
from ..mesh.proxy import Proxy
from ..mesh.surface import Samples, sample_surface
from ..projection import find_surface
from ..threads import in_pieces, join
from .fold import SweptVolume
from .problem import Problem
from .reverse import displaced_distance, reverse_distance
from .tube import COLUMNS, ROWS, Tube

FAR = 1.4  # radii
CREASE = 2.0  # cells of the finest level; from there on a spline is as good as zero
FLOOR = 0.05  # cells of the finest level: how close a layer can come at best
TOLERANCE = 1e-3  # model units, of both p95
OF_HEIGHT = 0.1  # the same, as a share of the stroke's height
GAIN, TURNED = 0.97, 0.3
ALL_BUT_PARALLEL = 0.2  # |grad f . n|, below which the edited surface is all but parallel to n
MEASURING = "Measuring"
FRESH = 1  # a stream of random numbers of its own
CHAMFER_SAMPLES = 100_000  # as in the paper; the noise floor falls with their square root

Array = NDArray[np.floating[Any]]


class Goal(NamedTuple):
    """What a stroke that reshapes asks for: samples (N,) of the surface that it moves."""

    before: Samples
    after: Samples


def measure(
    problem: Problem,
    edited: Field,
    proxy: Proxy,
    reached: NDArray[np.int32] | None = None,
    cell: float = 0.0,
    progress: Progress = silent,
) -> dict[str, Any]:
    """All measures of one edit but the Chamfer distance, ready for JSON.

    proxy:   of `edited`, at CELLS cells per axis
    reached: (S,) cells as of `levels.support` outside of which the field is what it was; None when
             all of it may have changed
    cell:    edge of the solver's finest cells, 0 if it has none: no smaller tolerance is asked than
             these can hold

    A measure over an empty region (a closed stroke has no cap) is None.
    """
    progress(0.0, MEASURING)
    share = len(problem.placed) ** -0.5  # of rows and columns: as many samples for all copies
    random = np.random.default_rng((problem.seed, FRESH))
    tubes, swept = problem.displaced_tubes(round(share * ROWS), round(share * COLUMNS), random)
    surface, target, displacement = (
        join([getattr(tube, name) for tube in tubes])
        for name in ("surface", "target", "displacement")
    )
    core, cap, height = displacement.core, displacement.beyond, np.abs(displacement.amount).max()
    progress(0.3, MEASURING)
    found = in_pieces(
        lambda part: find_surface(edited, target.points[part]), len(core), problem.check
    )
    turned = angles(found.normals[core], target.normals[core])
    progress(0.4, MEASURING)
    regions = _regions(problem, (tubes, swept), cell)
    elsewhere = _elsewhere(problem, edited, proxy, reached, regions)
    progress(0.8, MEASURING)
    reverse = reverse_distance(problem, tubes, swept, edited, proxy)
    measures = {
        **_summary("tube", found.distance[core], mean="mean", p95=95, max="max"),
        **_summary("cap", found.distance[cap], mean="mean", p95=95, max="max"),
        **_summary("reverse", reverse, mean="mean", p95=95, max="max"),
        "height": float(height),
        "gain": _gain(edited, surface.normals, target.points, displacement.amount),
        "outside": float((np.abs(target.points) > 1).any(axis=1).mean()),
        **elsewhere,
        "normal_deg": float(turned.mean()),
        "gradient": float(np.abs(found.slope[core] - 1).mean()),
        "tolerance": max(min(TOLERANCE, OF_HEIGHT * float(height)), FLOOR * cell),
    }
    return {**measures, "tolerance_met": _is_met(measures)}


def measure_goal(
    problem: Problem,
    edited: Field,
    proxy: Proxy,
    reached: NDArray[np.int32] | None,
    cell: float,
    goal: Goal,
    progress: Progress = silent,
) -> dict[str, Any]:
    """The measures of a stroke that reshapes what is there; the tube is what its `goal` asks for,
    and the height the longest way there. Others as of `measure`."""
    progress(0.0, MEASURING)
    before, after = goal
    way = after.points - before.points
    height = float(np.linalg.norm(way, axis=1).max())
    found = in_pieces(
        lambda part: find_surface(edited, after.points[part]), len(way), problem.check
    )
    progress(0.4, MEASURING)
    measures = {
        **_summary("tube", found.distance, mean="mean", p95=95, max="max"),
        "height": height,
        "gain": _gain(edited, after.normals, after.points, (way * after.normals).sum(axis=1)),
        **_elsewhere(problem, edited, proxy, reached, _regions(problem)),
        "normal_deg": float(angles(found.normals, after.normals).mean()),
        "gradient": float(np.abs(found.slope - 1).mean()),
        "tolerance": max(min(TOLERANCE, OF_HEIGHT * height), FLOOR * cell),
    }
    return {**measures, "tolerance_met": _is_met({**measures, "reverse_p95": None, "outside": 0.0})}


def _regions(
    problem: Problem,
    displaced: tuple[list[Tube], SweptVolume | None] = ([], None),
    cell: float = 0.0,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which samples of the unedited surface are of the rim and far.

    displaced: as of `Problem.displaced_tubes`
    """
    surface = problem.preparation.surface
    near = problem.copies.relative_distance(surface)
    rim, far = (near > 1) & (near <= FAR), near > FAR
    tubes, swept = displaced
    if swept is not None:
        left = ~swept.swallows(surface.points)
        crease = far & (displaced_distance(problem, tubes, surface.points) < CREASE * cell)
        rim, far = left & (rim | crease), left & far & ~crease
    return rim, far


def _elsewhere(
    problem: Problem,
    edited: Field,
    proxy: Proxy,
    reached: NDArray[np.int32] | None,
    regions: tuple[NDArray[np.bool_], NDArray[np.bool_]],
) -> dict[str, Any]:
    """What has changed in the `regions` beside the stroke, and the pieces."""
    before = problem.preparation
    rim, far = regions
    moved, turned = _moved(problem, edited, reached)
    worst = int(np.argmax(np.where(far, turned, 0)))
    return {
        **_summary("rim", moved[rim], mean="mean"),
        **_summary("drift", moved[far], mean="mean", p99=99, max="max"),
        "untouched_normal_rms": float(np.sqrt((turned[far] ** 2).mean())) if far.any() else 0.0,
        "untouched_normal_max": float(turned[worst]) if far.any() else 0.0,
        "untouched_worst": before.surface.points[worst].tolist(),
        "components_before": components(before.proxy),
        "components_after": components(proxy),
    }


def _is_met(measures: dict[str, Any]) -> bool:
    return (
        all((measures[name] or 0.0) < measures["tolerance"] for name in ("tube_p95", "reverse_p95"))
        and measures["gain"] >= GAIN
        and measures["outside"] == 0
        and measures["untouched_normal_rms"] <= TURNED
        and measures["components_before"] == measures["components_after"]
    )


def _moved(
    problem: Problem, edited: Field, reached: NDArray[np.int32] | None
) -> tuple[Array, Array]:
    """How far the samples of the unedited surface are from the edited one (N,), and by how many
    degrees its normals have turned there (N,)."""
    surface = problem.preparation.surface
    distance, turned = np.zeros((2, len(surface.points)))
    some = np.arange(len(surface.points))
    if reached is not None:
        some = np.flatnonzero(np.isin(linear(cells_of(surface.points, SUPPORT), SUPPORT), reached))
    points = surface.points[some]
    found = in_pieces(lambda part: find_surface(edited, points[part]), len(some), problem.check)
    distance[some] = found.distance
    turned[some] = angles(found.normals, surface.normals[some])
    return distance, turned


def _gain(
    edited: Field, along: NDArray[np.float32], target: NDArray[np.float32], amount: Array
) -> float:
    """Share that the edited field reached of the displacement `amount` (N,) of surface samples to
    their `target` (N, 3); all of none. Both are measured `along` unit vectors (N, 3).

    What is missing along n is f / |grad f| at the target, by the cosine of both normals.
    """
    value, gradient = values_and_gradients(edited, target)
    slope = np.einsum("ij,ij->i", gradient, along)
    missing = value / np.where(np.abs(slope) < ALL_BUT_PARALLEL, ALL_BUT_PARALLEL, slope)
    reached = amount - np.clip(missing, -np.abs(amount), np.abs(amount))
    asked = float((amount**2).sum())
    return float((reached * amount).sum()) / asked if asked else 1.0


def chamfer(problem: Problem, edited: Field, proxy: Proxy) -> dict[str, float]:
    """The paper's Chamfer distance of edited and displaced surface, and its noise floor."""
    before, seed = problem.preparation.proxy, problem.seed
    moved, _ = problem.displaced(Samples(before.vertices, before.normals))
    mesh = trimesh.Trimesh(moved.points, before.triangles, process=False)
    first = trimesh.sample.sample_surface(mesh, CHAMFER_SAMPLES, seed=seed)[0]
    second = trimesh.sample.sample_surface(mesh, CHAMFER_SAMPLES, seed=seed + 1)[0]
    surface = sample_surface(edited, proxy, CHAMFER_SAMPLES, seed + 2)
    return {
        "chamfer": _both_ways(first, surface.points),
        "chamfer_floor": _both_ways(first, second),
    }


def _both_ways(a: Array, b: Array) -> float:
    return float(KDTree(a).query(b)[0].mean() + KDTree(b).query(a)[0].mean())


def _summary(word: str, values: Array, **measures: str | int) -> dict[str, float | None]:
    """Mean, maximum and percentiles of `values`, named `word_measure`; None of nothing."""
    compute = {"mean": np.mean, "max": np.max}
    return {
        f"{word}_{name}": None
        if not len(values)
        else float(
            compute[measure](values) if isinstance(measure, str) else np.percentile(values, measure)
        )
        for name, measure in measures.items()
    }
