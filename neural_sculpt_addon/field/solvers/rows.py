# SPDX-License-Identifier: GPL-3.0-or-later
"""The equations that a Gauss-Newton step solves, drawn anew for each step.

tube      f(p') = 0               on the displaced surface
slope     grad f(p') . e = n' . e along a random direction e there, which may lean towards n'
preserve  f(p) = 0                on the untouched surface, a quarter of them beside the stroke
          f(p) = f0(p)            in a shell around it: the field stays as it was
around    f(p) = signed distance  above and below the displaced surface: nothing else may appear
box       f(p) = f0(p)            far from the stroke

Pools are in spatial order and draws are stratified along it: they leave no gaps where the surface
could give way unseen, as independent draws do.
"""

import math
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree
from torch import Tensor

from ...stroke.progress import Check, go_on
from ..evaluate import values
from ..field import Field
from ..pieces import Asked, Islands
from ..problem import Problem
from ..projection import find_surface
from ..surface import Samples, spatial_order
from ..threads import join

RIM_REACH = 2.2  # radii
RIM_SHARE = 0.25  # of the preserve rows
RIM_POOL = 0.67  # of as many points; steps that draw more draw some twice
SHELL_FROM = 1.1  # radii; nearer to the stroke the shell no longer knows the surface
BOX_FROM = 2.0  # radii
BOX_POOL = 4000  # points
SPARE = 1.6  # times as many points as a whole step draws are sampled of the tube
HELD_OUT = 5  # every so many-th of them, but for caps, is never drawn
CLEAR = 0.05  # |f| asked for where an island was
COLUMN = 0.04  # how far the `around` rows reach beyond both surfaces
OUTLYING, STEEP_OUTLYING = 1e-3, 3e-3  # weighted residuals that count as large; of slopes
AROUND_WEIGHT, BOX_WEIGHT = 0.3, 0.3  # of residuals; squared in the sum


class Mix(NamedTuple):
    """How many rows of each kind a whole step draws, and what they weigh.

    hold:    of a preserve row, where one of the tube weighs 1
    steep:   of a slope row: what one unit of slope weighs, in units of length
    upright: how much the directions of slope rows lean towards the normal, along which the length
             of the gradient shows; 0 is not at all
    """

    tube: int
    slope: int
    preserve: int
    around: int
    box: int
    hold: float
    steep: float
    upright: float


class Rows(NamedTuple):
    """The equations of one step; n value rows first, then m derivative rows."""

    points: Tensor  # (n + m, 3)
    directions: Tensor  # (m, 3), unit
    targets: Tensor  # (n + m,)
    weights: Tensor  # (n + m,), of the residuals, before they are squared
    outlying: Tensor  # (n + m,), weighted residuals that count as large
    near: int
    """So many of the first value rows lie in the tube or beside it, as all derivative rows do."""

    @property
    def values(self) -> int:
        """n."""
        return len(self.points) - len(self.directions)

    def tempered(self, residual: Tensor) -> "Rows":
        """Rows that weigh less the farther off they are: `residual` (n + m,), weighted, is what is
        left of each.

        What a field is too coarse for, the creases of a profile, shall not bend all around it.
        In steps of Gauss-Newton this is a pseudo-Huber loss (by iteratively reweighted least
        squares: Charbonnier, Blanc-Feraud, Aubert and Barlaud, "Deterministic Edge-Preserving
        Regularization in Computed Imaging", 1997).
        """
        return self._replace(weights=self.weights * (1 + (residual / self.outlying) ** 2) ** -0.25)


class Pool(NamedTuple):
    """Value rows of one kind, how many of them a step draws, what each weighs, and the weighted
    residual that counts as large."""

    rows: Tensor  # (N, 4), points and targets, in spatial order
    share: int
    weight: float
    outlying: float

    @staticmethod
    def of(
        points: NDArray[np.float32],
        targets: ArrayLike,
        share: int,
        weight: float,
        outlying: float = math.inf,
    ) -> "Pool":
        """A pool of `points` (N, 3) and their `targets` (N,) or one for all."""
        targets = np.broadcast_to(np.asarray(targets, np.float32), len(points))
        return Pool(torch.from_numpy(np.column_stack([points, targets])), share, weight, outlying)

    def draw(self, part: float, generator: torch.Generator) -> Tensor:
        """That part of its share of the rows."""
        chosen = choose(len(self.rows), round(part * self.share), generator)
        return self.rows.index_select(0, chosen)


class Sampler:
    """Pools of equations of one edit, and the draws from them."""

    def __init__(
        self,
        problem: Problem,
        mix: Mix,
        check: Check = go_on,
    ) -> None:
        """`check` is called between the parts of the work and may raise."""
        check()
        random = np.random.default_rng(problem.seed)
        side = int(np.sqrt(SPARE * max(mix.tube, mix.slope)))
        tubes = problem.tubes(side, side, random)
        target = join([tube.target for tube in tubes])
        order = spatial_order(target.points)
        displacement = join([tube.displacement for tube in tubes]).where(order)
        target = target.where(order)
        held_out = np.flatnonzero(displacement.core)[::HELD_OUT]
        trained = target.where(np.delete(np.arange(len(order)), held_out))
        self._held_out = target.points[held_out]
        check()
        beside = int(RIM_SHARE * mix.preserve)
        rim = _rim(problem, int(RIM_POOL * beside), random)
        known = problem.preparation
        on = known.surface.points[problem.known_untouched]
        shell = known.shell.where(problem.known_nearness > SHELL_FROM)
        check()
        around = _around(problem, target, displacement.amount, rim, 3 * mix.around, random)
        check()
        far = np.flatnonzero(problem.distance(known.box.points) > BOX_FROM)
        if len(far) > BOX_POOL:
            doubt = known.underestimation[far] ** 2
            far = np.sort(random.choice(far, BOX_POOL, replace=False, p=doubt / doubt.sum()))
        box = known.box.where(far)
        held = (mix.preserve - (beside if len(rim.points) else 0)) // 2
        self._pools = [
            Pool.of(trained.points, 0.0, mix.tube, 1.0, OUTLYING),
            Pool.of(rim.points, 0.0, beside, mix.hold, OUTLYING),
            Pool.of(on, 0.0, held, mix.hold, OUTLYING),
            Pool.of(*shell, held, mix.hold, OUTLYING),
            Pool.of(*around, mix.around, AROUND_WEIGHT),
            Pool.of(*box, mix.box, BOX_WEIGHT),
        ]
        self._trained = [torch.from_numpy(array) for array in trained]
        self._problem = problem
        self._mix = mix
        self._generator = torch.Generator().manual_seed(problem.seed)
        self.asked = Asked(target.points[:: len(tubes)], on, known.proxy)
        """The whole surface that is asked for."""

    def error(self, field: Field) -> float:
        """The 95th percentile of the distance of targets that are never drawn from the zero set of
        `field`.

        Caps are left out, as in the tube's measures; a dab is all cap.
        """
        return float(np.percentile(find_surface(field, self._held_out).distance, 95))

    def forbid(self, islands: Islands) -> None:
        """Ask from now on that there be no surface where `islands` are."""
        order = spatial_order(islands.points)
        points, targets = islands.points[order], np.clip(islands.distance[order], -CLEAR, CLEAR)
        self._pools.append(Pool.of(points, targets, self._mix.around, 1.0))

    def draw(self, part: float) -> Rows:
        """Fresh rows for one step: that part of the mix."""
        points, normals = self._trained
        values = [pool.draw(part, self._generator) for pool in self._pools]
        counts = torch.tensor([len(drawn) for drawn in values])
        kinds = torch.tensor([(pool.weight, pool.outlying) for pool in self._pools])
        weights, outlying = kinds.repeat_interleave(counts, 0).T  # (n,)
        slope = choose(len(points), round(part * self._mix.slope), self._generator)
        directions = torch.randn(len(slope), 3, generator=self._generator)
        directions += self._mix.upright * normals[slope]
        directions /= directions.norm(dim=1, keepdim=True)
        known = torch.cat(values)  # (n, 4)
        device = self._problem.field.device
        return Rows(
            torch.cat([known[:, :3], points[slope]]).to(device),
            directions.to(device),
            torch.cat([known[:, 3], (normals[slope] * directions).sum(1)]).to(device),
            torch.cat([weights, torch.full((len(slope),), self._mix.steep)]).to(device),
            torch.cat([outlying, torch.full((len(slope),), STEEP_OUTLYING)]).to(device),
            near=len(values[0]) + len(values[1]),
        )


def choose(size: int, count: int, generator: torch.Generator) -> Tensor:
    """`count` of `size` indices, one out of each of as many stretches; of fewer some come twice,
    because products of matrices are compiled for their shapes, which so are always the same."""
    if not size:
        return torch.empty(0, dtype=torch.int64)
    within = torch.rand(count, generator=generator, dtype=torch.float64)
    return ((torch.arange(count) + within) * (size / count)).long()


def _rim(problem: Problem, count: int, random: np.random.Generator) -> Samples:
    """Samples of the untouched surface beside the stroke: those that are known there, and as many
    more of the field's as are missing to `count`."""
    beside = problem.known_untouched & (problem.known_nearness < RIM_REACH)
    rim = problem.preparation.surface.where(beside)
    missing = count - len(rim.points)
    if missing > 0:
        rim = join([rim, problem.rim(RIM_REACH, missing, random)])
    return rim.where(spatial_order(rim.points))


def _around(
    problem: Problem,
    target: Samples,
    amount: NDArray[np.float64],
    rim: Samples,
    count: int,
    random: np.random.Generator,
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Points on normals of the displaced surface, from below the lower of both surfaces to above
    the upper one, and their signed distance from the displaced surface: that from the plane of its
    nearest sample, because a normal may run on through the next ridge.

    Points that leave a thin part on its other side are dropped: the sign of f0 betrays them.
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
    order = spatial_order(points[sound])
    return points[sound][order], distance[sound][order]
