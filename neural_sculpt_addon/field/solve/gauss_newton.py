# SPDX-License-Identifier: GPL-3.0-or-later
"""The solver "network": Gauss-Newton on the last hidden layer and the output.

Each step linearises the network at fixed samples and solves a damped least squares problem;
Levenberg and Marquardt's rule keeps the damping. See residuals (the equations), layers (the
unknowns) and least_squares (the linear solution). How samples are divided among threads depends on
their number alone, so any number of cores gives the same bits. See docs/method.md, section 10.
"""

from collections.abc import Sequence
from functools import partial

from ...common.progress import Check, Progress, silent
from ..network import Siren
from ..problem.problem import Problem
from ..threads import one_thread, parallel
from .least_squares import Memory, Solution
from .least_squares import solve as solve_linear
from .residuals import draw
from .unknowns import Activations, Directions, Layers

STEPS, ITERATIONS = 12, 7  # of Gauss-Newton, and of conjugate gradients in each
LEAST_DAMPING, MOST_DAMPING = 0.25, 300.0  # lambda; the diagonal of J^T J is nearly 1
STEP_HALVINGS = 5  # of a step
BLOCK = 1024  # residuals of a task for one thread: its matrices fit the cache
PROGRESS_TEXT = "Sculpting"


def solve(problem: Problem, progress: Progress = silent) -> Siren:
    """The network after the stroke."""
    with one_thread():
        progress(0.0, PROGRESS_TEXT)
        network = problem.field.network
        kinds = draw(problem)
        size = BLOCK if network.device.type == "cpu" else max(len(kind.points) for kind in kinds)
        blocks = [block for kind in kinds for block in kind.split(size)]
        activations = parallel(partial(Activations.of, network), blocks)
        layers = Layers.of(network)
        directions = layers.directions(activations)
        damping, memory = LEAST_DAMPING, None
        for step in range(STEPS):
            check = partial(progress, step / STEPS, PROGRESS_TEXT)
            layers, memory, ratio = _step(layers, directions, activations, damping, memory, check)
            damping *= 4.0 if ratio < 0.25 else 0.2 if ratio > 0.9 else 0.5 if ratio > 0.75 else 1.0
            damping = min(max(damping, LEAST_DAMPING), MOST_DAMPING)
        return layers.changed()


def _step(
    layers: Layers,
    directions: Directions,
    activations: Sequence[Activations],
    damping: float,
    memory: Memory | None,
    check: Check,
) -> tuple[Layers, Memory, float]:
    """One Gauss-Newton step: the unknowns after it, and its gain ratio."""
    check()
    system = parallel(lambda at: layers.linearise(at, directions), activations)
    solution = solve_linear(system, damping, ITERATIONS, memory, check)
    before = sum(float(part.residual @ part.residual) for part in system)
    layers, after = _search_line(layers, directions, activations, solution, before, check)
    return layers, solution.memory, (before - after) / max(solution.predicted, 1e-30)


def _search_line(
    layers: Layers,
    directions: Directions,
    activations: Sequence[Activations],
    solution: Solution,
    before: float,
    check: Check,
) -> tuple[Layers, float]:
    """The unknowns after the step, or the best of its halves when its gain ratio is poor, and the
    sum of squares there; `before` is that of `layers`, which are kept when nothing is better.

    On a coarsely fitted network a first full step can lead far out of the linear range.
    """
    best, least = layers, before
    for halving in range(STEP_HALVINGS + 1):
        check()
        tried = layers.moved(0.5**halving * solution.x, directions)
        residuals = parallel(tried.residual, activations)
        left = sum(float(residual @ residual) for residual in residuals)
        if left > least and best is not layers:
            break
        if left < least:
            best, least = tried, left
            if halving == 0 and before - left > 0.25 * solution.predicted:
                break
    return best, least
