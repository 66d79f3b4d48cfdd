# SPDX-License-Identifier: GPL-3.0-or-later
"""The equations that a Gauss-Newton step solves, drawn anew for each step.

tube      f(p') = 0               on the displaced surface
slope     grad f(p') . e = n' . e along a random direction e there
preserve  f(p) = 0                on the untouched surface, a quarter of them beside the stroke
          f(p) = f0(p)            in a shell around it: the field stays as it was
around    f(p) = signed distance  above and below the displaced surface: nothing else may appear
box       f(p) = f0(p)            far from the stroke
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import KDTree
from torch import Tensor

from ..evaluate import values
from ..network import Siren
from ..pieces import Islands
from ..problem import Problem
from ..projection import find_surface
from ..surface import Samples

RIM_REACH = 2.2  # radii
RIM_SHARE = 0.25  # of the preserve rows
SHELL_FROM = 1.1  # radii; nearer to the stroke the shell no longer knows the surface
BOX_FROM = 2.0  # radii
BOX_POOL = 3000  # points
BOX_SAFE = 0.03  # of |f|, at which a point is half as likely to be chosen
SLOPE_LENGTH = 0.04  # what one unit of slope weighs, in units of length
HELD_OUT = 40  # rows and columns of the tube that is never trained on
CLEAR = 0.05  # |f| asked for where an island was
COLUMN = 0.04  # how far the `around` rows reach beyond both surfaces
PRESERVE_WEIGHT = 1.2  # of residuals; its square is the weight in the sum
AROUND_WEIGHT = BOX_WEIGHT = 0.3


class Counts(NamedTuple):
    """Rows of each kind in one step."""

    tube: int
    slope: int
    preserve: int
    around: int
    box: int


class Rows(NamedTuple):
    """The equations of one step; n value rows first, then m derivative rows."""

    points: Tensor  # (n + m, 3)
    directions: Tensor  # (m, 3), unit
    targets: Tensor  # (n + m,)
    weights: Tensor  # (n + m,), of the residuals, before they are squared

    @property
    def values(self) -> int:
        """n."""
        return len(self.points) - len(self.directions)


class Sampler:
    """Pools of equations of one edit, and the draws from them."""

    def __init__(
        self, problem: Problem, counts: Counts, check: Callable[[], None] = lambda: None
    ) -> None:
        """`check` is called between the parts of the work and may raise."""
        check()
        random = np.random.default_rng(problem.seed)
        side = int(np.sqrt(3 * max(counts.tube, counts.slope)))
        tubes = problem.tubes(side, side, random)
        moved = [tube.target for tube in tubes]
        target = Samples(*(np.concatenate(part) for part in zip(*moved, strict=True)))
        amount = np.concatenate([tube.displacement.amount for tube in tubes])
        check()
        rim = problem.rim(RIM_REACH, int(2 * RIM_SHARE * counts.preserve), random)
        self._problem = problem
        self._counts = counts
        self._device = problem.network.device
        self._generator = torch.Generator().manual_seed(problem.seed)
        self._target = [torch.from_numpy(array) for array in target]
        self._rim = torch.from_numpy(rim.points)
        check()
        self._preserve = self._pool(*_preserve(problem))
        check()
        self._around = self._pool(*_around(problem, target, amount, rim, 3 * counts.around, random))
        check()
        box = problem.preparation.box
        far = np.flatnonzero(problem.distance(box.points) > BOX_FROM)
        risk = 1 / (np.abs(box.values[far]) + BOX_SAFE)  # where f is small, an edit tears it first
        far = random.choice(far, min(len(far), BOX_POOL), replace=False, p=risk / risk.sum())
        self._box = self._pool(box.points[far], box.values[far])
        self._forbidden = self._box[:0]
        surface = problem.preparation.surface
        untouched = surface.points[problem.untouched(surface)]
        self.asked = np.concatenate([target.points[:: len(tubes)], untouched])
        """Samples (M, 3) of the whole surface that is asked for."""

    def error(self, network: Siren) -> float:
        """The 95th percentile of the distance of fresh targets from the zero set of `network`.

        Caps are left out, as in the tube's measures; a dab is all cap.
        """
        random = np.random.default_rng((self._problem.seed, HELD_OUT))
        tubes = self._problem.tubes(HELD_OUT, HELD_OUT, random)
        beyond = np.concatenate([tube.displacement.beyond for tube in tubes])
        core = ~beyond if not beyond.all() else beyond
        targets = np.concatenate([tube.target.points for tube in tubes])[core]
        return float(np.percentile(find_surface(network, targets).distance, 95))

    def forbid(self, islands: Islands) -> None:
        """Ask from now on that there be no surface where `islands` are."""
        more = self._pool(islands.points, np.clip(islands.distance, -CLEAR, CLEAR))
        self._forbidden = torch.cat([self._forbidden, more])

    def draw(self) -> Rows:
        """Fresh rows for one step."""
        counts = self._counts
        points, normals = self._target
        on = self._choose(points, counts.tube)
        rim = self._choose(self._rim, int(RIM_SHARE * counts.preserve))
        preserve = self._choose(self._preserve, counts.preserve - len(rim))
        around = self._choose(self._around, counts.around)
        box = self._choose(self._box, counts.box)
        slope = self._choose(points, counts.slope)
        directions = torch.randn(len(slope), 3, generator=self._generator)
        directions /= directions.norm(dim=1, keepdim=True)
        forbidden = self._choose(self._forbidden, counts.around)
        known = torch.cat(
            [
                self._preserve[preserve],
                self._around[around],
                self._box[box],
                self._forbidden[forbidden],
            ]
        )  # (., 4)
        zeros = torch.zeros(len(on) + len(rim))
        rows = Rows(
            torch.cat([points[on], self._rim[rim], known[:, :3], points[slope]]),
            directions,
            torch.cat([zeros, known[:, 3], (normals[slope] * directions).sum(1)]),
            torch.cat(
                [
                    torch.ones(len(on)),
                    torch.full((len(rim) + len(preserve),), PRESERVE_WEIGHT),
                    torch.full((len(around),), AROUND_WEIGHT),
                    torch.full((len(box),), BOX_WEIGHT),
                    torch.ones(len(forbidden)),
                    torch.full((len(slope),), SLOPE_LENGTH),
                ]
            ),
        )
        return Rows(*(tensor.to(self._device) for tensor in rows))

    def _choose(self, pool: Tensor, count: int) -> Tensor:
        """`count` indices into a pool, without repetition where it is large enough."""
        if len(pool) <= count:
            return torch.arange(len(pool))
        return torch.randperm(len(pool), generator=self._generator)[:count]

    @staticmethod
    def _pool(points: NDArray[np.float32], targets: NDArray[np.floating]) -> Tensor:
        """Points and targets side by side (N, 4)."""
        return torch.from_numpy(np.column_stack([points, targets]).astype(np.float32))


def _preserve(problem: Problem) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Points of the untouched surface and of its shell, and the values to keep there."""
    surface, shell = problem.preparation.surface, problem.preparation.shell
    far = problem.nearness(surface) > SHELL_FROM
    on = surface.points[problem.untouched(surface)][::2]
    points = np.concatenate([on, shell.points[far][1::2]])
    return points, np.concatenate([np.zeros(len(on), np.float32), shell.values[far][1::2]])


def _around(
    problem: Problem,
    target: Samples,
    amount: NDArray[np.float64],
    rim: Samples,
    count: int,
    random: np.random.Generator,
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Points on normals of the displaced surface, from below the lower of both surfaces to above
    the upper one, and their signed distance from the displaced surface.

    Points that leave a thin part on its other side are dropped: the sign of f0 betrays them.
    """
    chosen = random.integers(len(target.points), size=count)
    points, normals, moved = target.points[chosen], target.normals[chosen], amount[chosen]
    low, high = np.minimum(-moved, 0) - COLUMN, np.maximum(-moved, 0) + COLUMN
    along = random.uniform(low, high)
    points = (points + along[:, None] * normals).astype(np.float32)
    cloud = KDTree(np.concatenate([target.points, rim.points]))
    distance = np.sign(along) * cloud.query(points)[0]
    before = values(problem.network, points)
    below, above = along < np.minimum(-moved, 0), along > np.maximum(-moved, 0)
    sound = ~(below & (before > 0) | above & (before < 0))
    return points[sound], distance[sound]
