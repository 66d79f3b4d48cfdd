# SPDX-License-Identifier: GPL-3.0-or-later
"""Gauss-Newton on the last hidden layer and the output: an edit in a fraction of a second.

Each step draws fresh rows, linearises the network there and solves a damped least squares problem;
Levenberg and Marquardt's rule keeps the damping. In the end the proxy is searched for pieces that
nobody asked for, and those are removed. See rows (what is asked), layers (the unknowns) and
least_squares (the solution).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from ...stroke.progress import Progress, silent
from ..network import Siren
from ..pieces import find_islands
from ..prepare import CELLS
from ..problem import Problem
from ..proxy import extract
from . import least_squares
from .layers import Layers
from .rows import Counts, Sampler

DAMPING = 1.0  # lambda of the first step
LEAST, MOST = 0.03, 30.0  # lambda
REPAIR_STEPS = 3
POOR, GOOD = 0.25, 0.75  # part of the promised decrease that a step kept: raise or lower lambda


@dataclass(frozen=True)
class Setting:
    """How much work is done.

    steps, iterations: Gauss-Newton steps, and conjugate gradient iterations in each
    counts:  rows in each step
    repairs: how often at most islands are looked for and removed
    """

    steps: int
    iterations: int
    counts: Counts
    repairs: int = 0


QUICK = Setting(5, 12, Counts(tube=1000, slope=700, preserve=2500, around=300, box=300))
FINAL = Setting(8, 20, Counts(tube=1800, slope=1500, preserve=5000, around=600, box=500), repairs=3)


def solve(problem: Problem, progress: Progress = silent, setting: Setting = FINAL) -> Siren:
    """The network that solves `problem` as well as `setting` allows."""
    sampler = Sampler(problem, setting.counts)
    total = setting.steps + setting.repairs * REPAIR_STEPS

    def share(done: float) -> None:
        progress(done / total, "Sculpting")

    layers, damping = _improve(Layers.of(problem.network), sampler, setting, DAMPING, share)
    for repair in range(setting.repairs):
        done = setting.steps + repair * REPAIR_STEPS
        proxy = extract(layers.network(), CELLS, lambda _, __, done=done: share(done))
        islands = find_islands(proxy, sampler.asked)
        if not len(islands.points):
            break
        sampler.forbid(islands)
        again = replace(setting, steps=REPAIR_STEPS)
        layers, damping = _improve(
            layers, sampler, again, damping, lambda part, done=done: share(done + part)
        )
    return layers.network()


def _improve(
    layers: Layers,
    sampler: Sampler,
    setting: Setting,
    damping: float,
    share: Callable[[float], None],
) -> tuple[Layers, float]:
    """Gauss-Newton steps with Levenberg and Marquardt's rule for the damping, which goes on."""
    for step in range(setting.steps):
        rows = sampler.draw()
        linear = layers.linearise(rows)
        delta, promised = least_squares.solve(
            linear, damping, setting.iterations, lambda part, done=step: share(done + part)
        )
        tried = layers.moved(delta)
        decrease = linear.residual.square().sum() - tried.residual(rows).square().sum()
        kept = float(decrease) / promised
        if kept > 0:
            layers = tried
        damping *= 4.0 if kept < POOR else 0.5 if kept > GOOD else 1.0
        damping = min(max(damping, LEAST), MOST)
    return layers, damping
