# SPDX-License-Identifier: GPL-3.0-or-later
"""Gauss-Newton on the last hidden layer and the output: an edit in a fraction of a second.

Each step draws fresh rows, linearises the network there and solves a damped least squares problem;
Levenberg and Marquardt's rule keeps the damping. When samples that were not trained on say that
the network is too coarse for the stroke, it grows and goes on. In the end the proxy is searched for
pieces that nobody asked for, and those are removed. See rows (what is asked), layers (the unknowns)
and least_squares (the solution).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from ...stroke.progress import Progress, silent
from ..grow import grow
from ..network import Siren
from ..pieces import find_islands
from ..prepare import CELLS
from ..problem import Problem
from ..proxy import extract
from . import least_squares
from .layers import Layers
from .least_squares import Delta
from .rows import Counts, Rows, Sampler

TOLERANCE = 2e-3  # of the tube's p95 error, model space
WIDEST = 512  # units of the first layer
REPAIR_STEPS = 3
DAMPING = 1.0  # lambda of the first step
LEAST, MOST = 0.03, 300.0  # lambda
POOR, GOOD, FINE = 0.25, 0.75, 0.9  # part of the promised decrease that a step kept
FAILED = 0.15  # a step that kept less is done again with lambda times RAISE, so often at most:
MOST_FAILURES, RAISE = 4, 8.0
HALVINGS = 5  # of a step


@dataclass(frozen=True)
class Setting:
    """How much work is done.

    steps, iterations: Gauss-Newton steps, and conjugate gradient iterations in each
    counts:  rows in each step
    growths: how often at most the first layer is doubled, to meet the tolerance
    repairs: how often at most islands are looked for and removed
    """

    steps: int
    iterations: int
    counts: Counts
    growths: int = 0
    repairs: int = 0


QUICK = Setting(5, 12, Counts(tube=1000, slope=700, preserve=2500, around=300, box=300))
FINAL = Setting(
    8, 20, Counts(tube=1800, slope=1500, preserve=5000, around=600, box=500), growths=2, repairs=3
)


def solve(problem: Problem, progress: Progress = silent, setting: Setting = FINAL) -> Siren:
    """The network that solves `problem` as well as `setting` allows."""
    sampler = Sampler(problem, setting.counts)
    network = problem.network
    rounds = setting.growths + 2  # the repairs count as one
    told = 0.0

    def share(fraction: float) -> None:  # the way is not known beforehand: it never goes back
        nonlocal told
        told = max(told, fraction)
        progress(told, "Sculpting")

    for growth in range(setting.growths + 1):
        if growth:
            if network.widths[0] >= WIDEST or sampler.error(network) <= TOLERANCE:
                break
            network = grow(network, (2 * network.widths[0], *network.widths[1:]))
        network = _improve(
            network, sampler, setting, lambda part, done=growth: share((done + part) / rounds)
        )
    for _ in range(setting.repairs):
        proxy = extract(network, CELLS, lambda _, __: share(told))
        islands = find_islands(proxy, sampler.asked)
        if not len(islands.points):
            break
        sampler.forbid(islands)
        again = replace(setting, steps=REPAIR_STEPS)
        network = _improve(network, sampler, again, lambda _: share(told))
    return network


def _improve(
    network: Siren, sampler: Sampler, setting: Setting, share: Callable[[float], None]
) -> Siren:
    """Gauss-Newton steps with Levenberg and Marquardt's rule for the damping."""
    layers, damping = Layers.of(network), DAMPING
    step = failures = 0
    while step < setting.steps:
        rows = sampler.draw()
        linear = layers.linearise(rows)
        delta, promised = least_squares.solve(
            linear,
            damping,
            setting.iterations,
            lambda part, done=step: share((done + part) / setting.steps),
        )
        now = float(linear.residual.square().sum())
        layers, left = _search_line(layers, delta, rows, now)
        kept = (now - left) / promised
        if kept < FAILED and failures < MOST_FAILURES:
            damping, failures = damping * RAISE, failures + 1
            continue
        step += 1
        damping *= 4.0 if kept < POOR else 0.2 if kept > FINE else 0.5 if kept > GOOD else 1.0
        damping = min(max(damping, LEAST), MOST)
    return layers.network()


def _search_line(layers: Layers, delta: Delta, rows: Rows, now: float) -> tuple[Layers, float]:
    """Take the step, or the best of its halves when that leaves less of the sum of squares `now`.

    On a coarsely fitted network a first full step can lead far out of the linear range.
    """
    best, least = layers, now
    for halving in range(HALVINGS + 1):
        tried = layers.moved(delta.times(0.5**halving))
        left = float(tried.residual(rows).square().sum())
        if left > least and best is not layers:
            break
        if left < least:
            best, least = tried, left
            if halving == 0 and left < 0.5 * now:
                break
    return best, least
