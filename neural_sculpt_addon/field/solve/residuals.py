# SPDX-License-Identifier: GPL-3.0-or-later
"""The equations of a Gauss-Newton edit, drawn once (docs/method.md, section 10). Model space.

tube      f(p') = 0               on the displaced surface
slope     grad f(p') . e = n' . e along a random direction e there
preserve  f(p) = 0                on the untouched surface, a quarter of them beside the stroke
          f(p) = f0(p)            in a shell around it: the field stays as it was
around    f(p) = signed distance  above and below the displaced surface: nothing else may appear
box       f(p) = f0(p)            far from the stroke

Candidates are in spatial order and draws are stratified along it: they leave no gaps where the
surface could give way unseen, as independent draws do.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree
from torch import Tensor

from ..evaluate import values
from ..mesh.surface import Samples, spatial_order
from ..problem.problem import Problem
from ..threads import join

TUBE, SLOPE, COPIES = 1200, 400, 8  # of each of as many copies of the stroke; more share them
PRESERVE_ROWS, AROUND_ROWS, BOX_ROWS = 4800, 250, 600  # with fewer the surface drifts
PRESERVE_WEIGHT, AROUND_WEIGHT, BOX_WEIGHT = 1.7, 0.3, 0.3  # where one of the tube weighs 1
SLOPE_WEIGHT = 0.03  # what one unit of slope weighs, in units of length
RIM_SHARE = 0.25  # of the preserve residuals
RIM_REACH = 2.2  # radii
SHELL_FROM = 1.1  # radii; nearer to the stroke the shell no longer knows the surface
BOX_FROM = 2.0  # radii
COLUMN = 0.04  # how far the `around` points reach beyond both surfaces


class Residuals(NamedTuple):
    """Residuals weight (target - f(point)), or weight (target - grad f(point) . direction)."""

    points: Tensor  # (N, 3)
    targets: Tensor  # (N,)
    weights: Tensor  # (N,), before residuals are squared
    directions: Tensor | None = None  # (N, 3), unit; None of values

    def split(self, size: int) -> "Iterator[Residuals]":
        """The same residuals, at most `size` at a time."""
        points, targets, weights, directions = self
        for start in range(0, len(points), size):
            part = slice(start, start + size)
            along = None if directions is None else directions[part]
            yield Residuals(points[part], targets[part], weights[part], along)


def draw(problem: Problem) -> tuple[Residuals, Residuals]:
    """All residuals of an edit: those of values and those of derivatives."""
    problem.check()
    random = np.random.default_rng(problem.seed)
    share = min(1, COPIES / len(problem.placed))
    side = round((share * TUBE) ** 0.5)
    tubes = problem.tubes(side, side, random)
    target = join([tube.target for tube in tubes])
    order = spatial_order(target.points)
    target = target.where(order)
    amount = join([tube.displacement.amount for tube in tubes])[order]
    known = problem.preparation
    rim = _rim(problem, int(RIM_SHARE * PRESERVE_ROWS), random)
    held = (PRESERVE_ROWS - len(rim.points)) // 2
    on = known.surface.points[problem.known_untouched]
    shell = known.shell.where(problem.known_relative_distance > SHELL_FROM)
    problem.check()
    around = signed_distances(problem, target, amount, rim, AROUND_ROWS, random)
    problem.check()
    box = known.box.where(_box(problem, random))
    on = on[_stratified(len(on), held, random)]
    shell = shell.where(_stratified(len(shell.points), held, random))
    parts = [
        _residuals(target.points, 0.0, 1.0),
        _residuals(rim.points, 0.0, PRESERVE_WEIGHT),
        _residuals(on, 0.0, PRESERVE_WEIGHT),
        _residuals(*shell, PRESERVE_WEIGHT),
        _residuals(*around, AROUND_WEIGHT),
        _residuals(*box, BOX_WEIGHT),
    ]
    chosen = target.where(_stratified(len(order), round(share * SLOPE * len(tubes)), random))
    directions = random.normal(size=chosen.points.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    slopes = np.einsum("ij,ij->i", chosen.normals, directions)
    device = problem.field.device
    on_values = Residuals(*(torch.cat(arrays).to(device) for arrays in zip(*parts, strict=True)))
    on_slopes = (*_residuals(chosen.points, slopes, SLOPE_WEIGHT), _tensor(directions))
    return on_values, Residuals(*(array.to(device) for array in on_slopes))


def signed_distances(
    problem: Problem,
    target: Samples,
    amount: NDArray[np.float64],
    rim: Samples,
    count: int,
    random: np.random.Generator,
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """At most `count` points (N, 3) on normals of the displaced surface, from below the lower of
    both surfaces to above the upper one, and their signed distance (N,) from the displaced surface.

    The distance is that from the plane of the nearest sample of `target` and `rim`, because a
    normal may run on through the next ridge. Points that leave a thin part on its other side are
    dropped: the sign of f0 betrays them.
    """
    chosen = random.integers(len(target.points), size=count)
    points, normals, moved = target.points[chosen], target.normals[chosen], amount[chosen]
    low, high = np.minimum(-moved, 0) - COLUMN, np.maximum(-moved, 0) + COLUMN
    along = random.uniform(low, high)
    points = (points + along[:, None] * normals).astype(np.float32)
    cloud = join([target, rim])
    nearest = KDTree(cloud.points).query(points)[1]
    distance = ((points - cloud.points[nearest]) * cloud.normals[nearest]).sum(axis=1)
    before = values(problem.field, points)
    below, above = along < np.minimum(-moved, 0), along > np.maximum(-moved, 0)
    sound = ~(below & (before > 0) | above & (before < 0))
    return points[sound], distance[sound]


def _rim(problem: Problem, count: int, random: np.random.Generator) -> Samples:
    """At most `count` samples of the untouched surface beside the stroke: known ones and, where
    these are too few, more of the field's."""
    beside = problem.known_untouched & (problem.known_relative_distance < RIM_REACH)
    rim = problem.preparation.surface.where(beside)
    missing = count - len(rim.points)
    if missing > 0:
        rim = join([rim, problem.rim(RIM_REACH, missing, random)])
        rim = rim.where(spatial_order(rim.points))
    return rim.where(_stratified(len(rim.points), count, random))


def _box(problem: Problem, random: np.random.Generator) -> NDArray[np.intp]:
    """Which box points are used: mostly those where a small change of f could make a surface."""
    far = np.flatnonzero(problem.copies.distance(problem.preparation.box.points) > BOX_FROM)
    weight = problem.preparation.underestimation[far].astype(float) ** 2
    count = min(BOX_ROWS, len(far))
    return random.choice(far, count, replace=False, p=weight / weight.sum()) if count else far


def _stratified(size: int, count: int, random: np.random.Generator) -> NDArray[np.intp]:
    """`count` of `size` indices, one out of each of as many equal stretches; all if these are
    fewer."""
    if size <= count:
        return np.arange(size)
    return ((np.arange(count) + random.random(count)) * (size / count)).astype(np.intp)


def _residuals(points: ArrayLike, targets: ArrayLike, weight: float) -> tuple[Tensor, ...]:
    """Points (N, 3), targets (N,) and weights (N,), given one target or all."""
    at = _tensor(points)
    return at, _tensor(np.broadcast_to(targets, len(at))), torch.full((len(at),), weight)


def _tensor(array: ArrayLike) -> Tensor:
    return torch.from_numpy(np.array(array, np.float32))
