# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits: strokes in, a new network and a report of each stroke out.

Each stroke is posed on what is known of the network before it, which carries the memory of the
surface that the strokes so far asked for (see `memory`).
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from ..stroke.stroke import Stroke
from . import metrics
from .memory import follow
from .network import Siren
from .prepare import CELLS, Preparation, prepare
from .problem import Problem, pose
from .proxy import Proxy, extract, finish, update
from .solvers import Refine, Solve, gauss_newton, paper
from .solvers.gauss_newton import TOLERANCE


@dataclass(frozen=True)
class Solver:
    """How to solve a problem, and how to go on when its result has been shown."""

    solve: Solve
    refine: Refine | None = None


SOLVERS = {
    "gauss_newton": Solver(gauss_newton.quick, gauss_newton.refine),
    "quick": Solver(gauss_newton.quick),
    "paper": Solver(paper.solve),
}


@dataclass(frozen=True)
class Edit:
    """What is known of the network after all strokes, and a report of each, ready for JSON.

    A report has the measures of `metrics`, the seconds from the stroke's end to the weights,
    whether the tolerance was met, and the network's widths, which may have grown.
    """

    preparation: Preparation
    reports: tuple[dict[str, Any], ...]

    @property
    def network(self) -> Siren:
        """The network after all strokes."""
        return self.preparation.network

    def then(self, report: dict[str, Any], preparation: Preparation) -> "Edit":
        """This edit followed by one more stroke."""
        return Edit(preparation, (*self.reports, report))


@dataclass(frozen=True)
class Quick:
    """What an edit looks like before its last stroke is refined.

    remember: makes the preparation of `network`, for strokes that will be drawn on it; as it takes
              a tenth of a second, or seconds where a stroke lies many times upon itself, show the
              rest first. After a cancel it can be called again
    """

    network: Siren
    proxy: Proxy
    reports: tuple[dict[str, Any], ...]
    remember: Callable[[Progress], Preparation]


def edit(
    network: Siren,
    strokes: Sequence[Stroke],
    *,
    solver: str = "gauss_newton",
    epochs: int | None = None,
    preparation: Preparation | None = None,
    chamfer: bool = False,
    quick: Callable[[Quick], None] | None = None,
    progress: Progress = silent,
) -> Edit:
    """Apply `strokes` one after another.

    preparation: of `network`, when it is known already
    solver:      one of SOLVERS
    epochs:      of the paper's solver; its own default when None
    chamfer:     report the paper's Chamfer distance, too (seconds)
    quick:       called once before the last stroke is refined, which is not measured then; not
                 called by solvers that do not refine

    SculptError when a stroke does not lie on the surface or cannot be solved; Cancelled as soon as
    `progress` raises it. `network` itself is never changed.
    """
    chosen = _solver(solver, epochs)
    if preparation is None:
        preparation = prepare(network, progress=lambda _, message: progress(0.0, message))
    result = Edit(preparation, ())
    told = 0.0, "Sculpting"

    for number, stroke in enumerate(strokes):

        def share(part: float, message: str, done: int = number) -> None:
            nonlocal told
            told = (done + part) / len(strokes), message
            progress(*told)

        started = time.perf_counter()
        problem = pose(result.preparation, stroke, lambda: progress(*told))
        network = chosen.solve(problem, _part(share, 0.0, 0.3 if chosen.refine else 0.9))
        seconds = time.perf_counter() - started
        report = {"stroke": stroke.name, "solver": solver, "seconds": seconds}
        if chosen.refine is not None:
            if quick is not None and number == len(strokes) - 1:
                known = result.preparation.proxy
                proxy = update(known, network, lambda _, __: share(0.3, "Sculpting"))
                shown = *result.reports, report | {"solver": "quick"}
                quick(Quick(network, proxy, shown, partial(_remember, problem, network, proxy)))
            started = time.perf_counter()
            network, surface = chosen.refine(problem, network, _part(share, 0.3, 0.9))
            report["seconds"] += time.perf_counter() - started
            proxy = finish(surface, network, lambda _, __: share(0.9, "Measuring"))
        else:
            proxy = extract(network, CELLS, lambda _, __: share(0.9, "Measuring"))
        report |= _measure(problem, network, proxy, chamfer, _part(share, 0.95, 1.0))
        result = result.then(report, follow(problem, network, proxy))
    return result


def _remember(problem: Problem, network: Siren, proxy: Proxy, progress: Progress) -> Preparation:
    problem = replace(problem, check=lambda: progress(0.0, "Preparing"))
    return follow(problem, network, proxy)


def _measure(
    problem: Problem, network: Siren, proxy: Proxy, chamfer: bool, progress: Progress
) -> dict[str, Any]:
    """How close the network came, and what it is now."""
    measures = metrics.measure(problem, network, proxy, progress)
    if chamfer:
        measures |= metrics.chamfer(problem, network, proxy)
    return {
        **measures,
        "tolerance_met": measures["tube_p95"] < TOLERANCE,
        "widths": list(network.widths),
    }


def _part(share: Progress, start: float, end: float) -> Progress:
    """Progress of the part from `start` to `end` of the whole."""
    return lambda part, message: share(start + (end - start) * part, message)


def _solver(name: str, epochs: int | None) -> Solver:
    if name not in SOLVERS:
        raise SculptError(f"There is no solver {name!r}; choose one of {', '.join(SOLVERS)}.")
    if epochs is None:
        return SOLVERS[name]
    if name != "paper" or epochs < 1:
        raise SculptError("Only the paper's solver has epochs, and it needs at least one.")
    return Solver(partial(paper.solve, epochs=epochs))
