# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits: strokes in, a new network and a report of each stroke out."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from ..stroke.stroke import Stroke
from . import metrics
from .network import Siren
from .prepare import Preparation, prepare
from .problem import lay_copies, pose
from .solvers import paper

SOLVERS: dict[str, Callable[..., Siren]] = {"paper": paper.solve}


@dataclass(frozen=True)
class Edit:
    """The network after all strokes, and a report of each, ready for JSON (see metrics)."""

    network: Siren
    reports: tuple[dict[str, Any], ...]


def edit(
    network: Siren,
    strokes: Sequence[Stroke],
    *,
    solver: str = "paper",
    epochs: int | None = None,
    preparation: Preparation | None = None,
    chamfer: bool = False,
    progress: Progress = silent,
) -> Edit:
    """Apply `strokes` one after another.

    preparation: of `network`, when it was made before
    epochs:      of the paper's solver; its own default when None
    chamfer:     report the paper's Chamfer distance, too (seconds)

    SculptError when a stroke does not lie on the surface or cannot be solved; Cancelled as soon as
    `progress` raises it. `network` itself is never changed.
    """
    if solver not in SOLVERS:
        raise SculptError(f"There is no solver {solver!r}; choose one of {', '.join(SOLVERS)}.")
    solve = SOLVERS[solver] if epochs is None else partial(SOLVERS[solver], epochs=epochs)
    reports = []
    for number, stroke in enumerate(strokes):

        def share(fraction: float, message: str, done: int = number) -> None:
            progress((done + fraction) / len(strokes), message)

        if preparation is None:
            share(0.0, "Preparing")
            preparation = prepare(network, progress=lambda _, message: share(0.0, message))
        started = time.perf_counter()
        laid = lay_copies(network, stroke)
        problem = pose(preparation, stroke, laid)
        network = solve(problem, lambda fraction, message: share(0.95 * fraction, message))
        seconds = time.perf_counter() - started
        share(0.95, "Measuring")
        measures = metrics.measure(preparation, network, laid, stroke.seed)
        if chamfer:
            measures |= metrics.chamfer(preparation, network, laid, stroke.seed)
        reports.append({"stroke": stroke.name, "solver": solver, "seconds": seconds, **measures})
        preparation = None
    return Edit(network, tuple(reports))
