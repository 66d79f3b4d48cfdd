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
from functools import partial

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
GROWTHS = 2  # how often at most the first layer is doubled
REPAIRS = 3  # how often at most islands are looked for and removed
DAMPING = 1.0  # lambda of the first step
LEAST, MOST = 0.03, 300.0  # lambda
POOR, GOOD, FINE = 0.25, 0.75, 0.9  # part of the promised decrease that a step kept
FAILED = 0.15  # a step that kept less is done again with lambda times RAISE, so often at most:
MOST_FAILURES, RAISE = 4, 8.0
HALVINGS = 5  # of a step


@dataclass(frozen=True)
class Course:
    """Gauss-Newton steps, conjugate gradient iterations in each, and rows in each."""

    steps: int
    iterations: int
    counts: Counts


FIRST = Course(6, 10, Counts(tube=600, slope=400, preserve=2600, around=250, box=250))
REFINE = Course(5, 20, Counts(tube=1800, slope=900, preserve=9000, around=400, box=400))
REPAIR = replace(REFINE, steps=3)


def quick(problem: Problem, progress: Progress = silent) -> Siren:
    """What the artist sees first: a few steps, the network as wide as it is."""
    sampler = Sampler(problem, FIRST.counts, lambda: progress(0.0, "Sculpting"))
    return _improve(problem.network, sampler, FIRST, lambda part: progress(part, "Sculpting"))


def refine(problem: Problem, network: Siren, progress: Progress = silent) -> Siren:
    """Bring the result of `quick` within TOLERANCE, grown if need be, or as close as it comes."""
    told = 0.0

    def share(fraction: float) -> None:  # repairs are not known beforehand; it never goes back
        nonlocal told
        told = max(told, fraction)
        progress(told, "Refining")

    sampler = Sampler(problem, REFINE.counts, lambda: share(0.0))
    for growth in range(GROWTHS + 1):
        network = _improve(
            network, sampler, REFINE, lambda part, done=growth: share(0.3 * (done + part))
        )
        if sampler.error(network) < TOLERANCE or network.widths[0] >= WIDEST:
            break
        if growth < GROWTHS:
            network = grow(network, (2 * network.widths[0], *network.widths[1:]))
    for _ in range(REPAIRS):
        proxy = extract(network, CELLS, lambda _, __: share(told))
        islands = find_islands(proxy, sampler.asked)
        if not len(islands.points):
            break
        sampler.forbid(islands)
        network = _improve(network, sampler, REPAIR, lambda _: share(told))
    return network


def _improve(
    network: Siren, sampler: Sampler, course: Course, share: Callable[[float], None]
) -> Siren:
    """Gauss-Newton steps with Levenberg and Marquardt's rule for the damping."""
    layers, damping = Layers.of(network), DAMPING
    step = failures = 0
    while step < course.steps:
        share(step / course.steps)
        rows = sampler.draw()
        linear = layers.linearise(rows)
        delta, promised = least_squares.solve(
            linear,
            damping,
            course.iterations,
            lambda part, done=step: share((done + part) / course.steps),
        )
        now = float(linear.residual.square().sum())
        check = partial(share, (step + 1) / course.steps)
        layers, left = _search_line(layers, delta, rows, now, check)
        kept = (now - left) / promised
        if kept < FAILED and failures < MOST_FAILURES:
            damping, failures = damping * RAISE, failures + 1
            continue
        step += 1
        damping *= 4.0 if kept < POOR else 0.2 if kept > FINE else 0.5 if kept > GOOD else 1.0
        damping = min(max(damping, LEAST), MOST)
    return layers.network()


def _search_line(
    layers: Layers, delta: Delta, rows: Rows, now: float, check: Callable[[], None]
) -> tuple[Layers, float]:
    """Take the step, or the best of its halves when that leaves less of the sum of squares `now`.

    On a coarsely fitted network a first full step can lead far out of the linear range.
    """
    best, least = layers, now
    for halving in range(HALVINGS + 1):
        check()
        tried = layers.moved(delta.times(0.5**halving))
        left = float(tried.residual(rows).square().sum())
        if left > least and best is not layers:
            break
        if left < least:
            best, least = tried, left
            if halving == 0 and left < 0.5 * now:
                break
    return best, least
