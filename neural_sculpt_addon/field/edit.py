# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits: strokes in, a new network and a report of each stroke out."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from ..stroke.stroke import Stroke
from . import metrics
from .network import Siren
from .prepare import Preparation, prepare
from .problem import pose
from .solvers import Solve, gauss_newton, paper
from .solvers.gauss_newton import TOLERANCE

SOLVERS: dict[str, Solve] = {
    "gauss_newton": gauss_newton.solve,
    "quick": gauss_newton.quick,
    "paper": paper.solve,
}


@dataclass(frozen=True)
class Edit:
    """The network after all strokes, and a report of each, ready for JSON.

    A report has the measures of `metrics`, the seconds from the stroke's end to the weights,
    whether the tolerance was met, and the network's widths, which may have grown.
    """

    network: Siren
    reports: tuple[dict[str, Any], ...]


def edit(
    network: Siren,
    strokes: Sequence[Stroke],
    *,
    solver: str = "gauss_newton",
    epochs: int | None = None,
    preparation: Preparation | None = None,
    chamfer: bool = False,
    progress: Progress = silent,
) -> Edit:
    """Apply `strokes` one after another.

    preparation: of `network`, when it was made before
    solver:      one of SOLVERS
    epochs:      of the paper's solver; its own default when None
    chamfer:     report the paper's Chamfer distance, too (seconds)

    SculptError when a stroke does not lie on the surface or cannot be solved; Cancelled as soon as
    `progress` raises it. `network` itself is never changed.
    """
    solve = _solver(solver, epochs)
    reports = []
    for number, stroke in enumerate(strokes):

        def share(fraction: float, message: str, done: int = number) -> None:
            progress((done + fraction) / len(strokes), message)

        if preparation is None:
            share(0.0, "Preparing")
            preparation = prepare(network, progress=lambda _, message: share(0.0, message))
        started = time.perf_counter()
        problem = pose(preparation, stroke)
        network = solve(problem, lambda fraction, message: share(0.95 * fraction, message))
        seconds = time.perf_counter() - started
        share(0.95, "Measuring")
        measures = metrics.measure(problem, network)
        if chamfer:
            measures |= metrics.chamfer(problem, network)
        report = {"stroke": stroke.name, "solver": solver, "seconds": seconds, **measures}
        reports.append(
            {
                **report,
                "tolerance_met": measures["tube_p95"] < TOLERANCE,
                "widths": list(network.widths),
            }
        )
        preparation = None
    return Edit(network, tuple(reports))


def _solver(name: str, epochs: int | None) -> Solve:
    if name not in SOLVERS:
        raise SculptError(f"There is no solver {name!r}; choose one of {', '.join(SOLVERS)}.")
    if epochs is None:
        return SOLVERS[name]
    if name != "paper" or epochs < 1:
        raise SculptError("Only the paper's solver has epochs, and it needs at least one.")
    return partial(paper.solve, epochs=epochs)
