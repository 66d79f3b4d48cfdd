# SPDX-License-Identifier: GPL-3.0-or-later
"""Gauss-Newton on the last hidden layer and the output: an edit in a fraction of a second.

Each step draws fresh rows, linearises the network there and solves a damped least squares problem;
Levenberg and Marquardt's rule keeps the damping. When samples that were not trained on say that
the network is too coarse for the stroke, it grows and goes on. In the end the proxy is searched for
pieces that nobody asked for, and those are removed. See rows (what is asked), layers (the unknowns)
and least_squares (the solution).
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

from ...stroke.progress import Progress, silent
from ..field import Field
from ..grow import grow
from ..network import Siren
from ..pieces import find_islands
from ..prepare import CELLS
from ..problem import Problem
from ..proxy import find
from ..threads import Team
from . import Refined
from .layers import Directions, Layers, View
from .least_squares import Memory, Solution, dot
from .least_squares import solve as solve_linear
from .rows import Mix, Rows, Sampler

TOLERANCE = 2e-3  # of the tube's p95 error, model space
SURE = 0.9 * TOLERANCE  # of samples as few as those held out, where one more stage costs little
FAR = 2 * TOLERANCE  # from here on a network grows to twice its width at once
USUAL = 128  # units of the first layer, in a network that has not grown
WIDTHS = 192, 256, 512  # what it grows to
MIRRORED = 256  # units at least for mirror images: on fewer, they differ by more than 1e-4
STAGES = 3  # of refining at most, each on a wider network while it can grow
FREQUENCY, FINEST = 1.2, 3.0  # of the units that it grows by; of the last ones
REPAIRS = 3  # how often at most islands are looked for and removed
REPAIR = 5  # the step of refining that this begins with
MOST = 300.0  # lambda
POOR, GOOD, FINE = 0.25, 0.75, 0.9  # part of the promised decrease that a step kept
FAILED = 0.15  # a step that kept less is done again with lambda times RAISE, so often at most:
MOST_FAILURES, RAISE = 4, 8.0
HALVINGS = 5  # of a step
SEEN = 0.4  # part of the rows that tell the directions of the unknowns


@dataclass(frozen=True)
class Course:
    """How long to solve, and on what.

    steps:    of Gauss-Newton: what each sees, as a share of `mix`, and iterations of conjugate
              gradients. The first ones need not be exact: they are far from the end
    averaged: how many of the last make the result
    rank:     of the last hidden layer's change, for each of its inputs
    output:   directions in which the output layer changes; more cost more than they bring
    split:    whether the directions of the unknowns tell rows near the stroke from others, see
              `Directions.of`
    damping:  lambda of the first step, and the least
    robust:   in how many of the last steps rows that are far off weigh less, see `Rows.tempered`;
              not before, where they all are
    """

    steps: tuple[tuple[float, int], ...]
    averaged: int
    rank: float
    output: int
    split: bool
    damping: float
    robust: int
    mix: Mix


FIRST = Course(
    steps=(
        *((0.2, 6), (0.2, 6), (0.25, 7), (0.3, 8), (0.4, 8)),
        *((0.6, 8), (0.8, 10), (1.0, 10), (1.0, 12)),
    ),
    averaged=2,
    rank=0.5625,
    output=32,
    split=False,
    damping=0.25,
    robust=0,
    mix=Mix(400, 150, preserve=2700, around=150, box=350, hold=1.45, steep=0.03, upright=0.0),
)
REFINE = Course(
    steps=((0.25, 12),) * 3 + ((0.45, 14),) * 5,
    averaged=4,
    rank=1.0,
    output=32,
    split=True,
    damping=0.03,
    robust=8,
    mix=Mix(1500, 800, preserve=9500, around=300, box=800, hold=2.5, steep=0.05, upright=0.65),
)
WIDER = replace(REFINE, steps=((0.3, 12),) * 3 + ((0.55, 14),) * 5, rank=2 / 3)
"""Of a network that has grown by a half."""
WIDEST = replace(
    REFINE,
    steps=((1.0, 14),) * 8,
    rank=0.75,
    robust=4,
    output=64,
    mix=Mix(2400, 1200, preserve=9750, around=450, box=1500, hold=2.2, steep=0.055, upright=0.0),
)
"""Of those that have grown more. With as few rows as others see, their finer waves would run
between them, and be seen as ripples of the untouched surface."""


def quick(problem: Problem, progress: Progress = silent) -> Siren:
    """What the artist sees first: a few steps, the network as wide as it is."""
    sampler = Sampler(problem, FIRST.mix, lambda: progress(0.0, "Sculpting"))
    return _improve(problem.field.network, sampler, FIRST, lambda part: progress(part, "Sculpting"))


def refine(problem: Problem, network: Siren, progress: Progress = silent) -> Refined:
    """Bring the result of `quick` within TOLERANCE, or as close as it comes, grown if need be, as
    it is for mirror images.

    Islands that will not go are worse than a stroke that is blurred: an earlier stage without them
    is the result then, that of `quick` if need be.
    """
    told = 0.0

    def share(fraction: float) -> None:  # repairs are not known beforehand; it never goes back
        nonlocal told
        told = max(told, fraction)
        progress(told, "Refining")

    course = _course(network)
    sampler = Sampler(problem, course.mix, lambda: share(0.0))
    least = MIRRORED if len(problem.laid) > 1 else 0
    error, earlier = sampler.error(Field(network)), list[Siren]()
    for done in range(STAGES):
        earlier.append(network)
        coarse = error > TOLERANCE or network.widths[0] < least
        if coarse and network.widths[0] < WIDTHS[-1]:
            network = _grown(network, error, least)
            before, course = course, _course(network)
            if course.mix != before.mix:
                sampler = Sampler(problem, course.mix, lambda: share(told))
        network = _improve(
            network, sampler, course, lambda part, done=done: share(0.3 * (done + part))
        )
        error = sampler.error(Field(network))
        if error < (SURE if course is WIDEST else TOLERANCE):
            break

    def seen(network: Siren) -> Refined:
        return Refined(network, find(Field(network), CELLS, lambda _, __: share(told)))

    repair = replace(course, steps=course.steps[REPAIR:])
    refined = seen(network)
    for _ in range(REPAIRS):
        islands = find_islands(refined.surface.mesh, sampler.asked)
        if not len(islands.points):
            return refined
        sampler.forbid(islands)
        refined = seen(_improve(refined.network, sampler, repair, lambda _: share(told)))
    for one in chain([refined], map(seen, reversed(earlier))):
        if not len(find_islands(one.surface.mesh, sampler.asked).points):
            return one
    return refined


def _course(network: Siren) -> Course:
    """Of refining a network of its width."""
    width = network.widths[0]
    return REFINE if width <= USUAL else WIDER if width <= WIDTHS[0] else WIDEST


def _grown(network: Siren, error: float, least: float) -> Siren:
    """With more units in its first layer, at least so many, and as many in the others."""
    least = max(least, network.widths[0] * (2 if error > FAR else 1.25))
    wider = next((width for width in WIDTHS if width >= least), WIDTHS[-1])
    frequency = FINEST if wider == WIDTHS[-1] else FREQUENCY
    return grow(network, (wider, *network.widths[1:]), frequency)


def _improve(
    network: Siren, sampler: Sampler, course: Course, share: Callable[[float], None]
) -> Siren:
    """Gauss-Newton steps with Levenberg and Marquardt's rule for the damping.

    Each step sees other rows and fits their chance, too: the mean of the last ones does not.
    """
    rows = sampler.draw(SEEN)
    with Team():
        directions = Directions.of(
            network, rows, course.rank, course.output, course.split, lambda: share(0.0)
        )
    with Team() as team:

        def tell(part: float) -> None:
            team.adapt()
            share(part / len(course.steps))

        return _take_steps(network, directions, sampler, course, tell)


def _take_steps(
    network: Siren,
    directions: Directions,
    sampler: Sampler,
    course: Course,
    tell: Callable[[float], None],
) -> Siren:
    layers, damping = Layers.of(network, directions), course.damping
    memory: Memory | None = None
    last: deque[Layers] = deque(maxlen=course.averaged)
    step = failures = 0
    while step < len(course.steps):
        part, iterations = course.steps[step]
        tell(step)
        rows = sampler.draw(part)
        view = layers.view(rows, partial(tell, step))
        tell(step)
        if len(course.steps) - step <= course.robust:
            rows = rows.tempered(layers.residual(rows, view))
        linear = layers.linearise(rows, view)
        tell(step)
        solution = solve_linear(
            linear, damping, iterations, memory, lambda done, before=step: tell(before + done)
        )
        now = float(dot(linear.residual, linear.residual))
        layers, left = _search_line(layers, solution, rows, view, now, partial(tell, step + 1))
        kept = (now - left) / solution.promised
        if kept < FAILED and failures < MOST_FAILURES:
            damping, failures = damping * RAISE, failures + 1
            continue
        step, memory = step + 1, solution.memory
        last.append(layers)
        damping *= 4.0 if kept < POOR else 0.2 if kept > FINE else 0.5 if kept > GOOD else 1.0
        damping = min(max(damping, course.damping), MOST)
    return Layers.mean(last).network()


def _search_line(
    layers: Layers,
    solution: Solution,
    rows: Rows,
    view: View,
    now: float,
    check: Callable[[], None],
) -> tuple[Layers, float]:
    """Take the step, or the best of its halves when it keeps little of what it promised.

    On a coarsely fitted network a first full step can lead far out of the linear range. The sum of
    squares is `now` before, and is returned as it is after.
    """
    best, least = layers, now
    for halving in range(HALVINGS + 1):
        check()
        change = 0.5**halving * solution.x
        tried = layers.moved(change)
        residual = tried.residual(rows, layers.view_after(change, view))
        left = float(dot(residual, residual))
        if left > least and best is not layers:
            break
        if left < least:
            best, least = tried, left
            if halving == 0 and now - left > POOR * solution.promised:
                break
    return best, least


def solve(problem: Problem, progress: Progress = silent) -> Siren:
    """One result."""
    return quick(problem, progress)
