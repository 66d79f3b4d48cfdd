# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits: a stroke in, another field out.

    pose on the surface -> solve -> proxy        and, when the artist sees it,  -> measure

The local solver adds detail, the other two change the network's weights.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

from ...common.errors import SculptError
from ...common.progress import Progress, rising, silent, sub_progress
from ...common.text import Text
from ...stroke.stroke import Kind, Stroke
from ..field import Field
from ..levels import Coefficients, spacing, support
from ..mesh.pieces import Asked, find_islands
from ..mesh.proxy import Proxy, extract, update
from ..problem import metrics
from ..problem.pose import pose
from ..problem.prepare import CELLS, Preparation, prepare
from ..problem.problem import Problem
from ..solve import gauss_newton, paper
from ..solve.local import LocalEdit
from ..solve.resolution import resolution
from .reshape import reshape

REPAIRS = 8
"""How often at most islands are looked for and solved away."""


LEAVES_BOX = Text(
    "The stroke leaves the box of the field and is cut off there. Lower it, or make a new field of"
    " the proxy (Neural Field from Mesh), which has room around it."
)


class Solver(StrEnum):
    """How a stroke changes a field."""

    LOCAL = "local"
    NETWORK = "network"
    PAPER = "paper"


@dataclass(frozen=True)
class Edit:
    """What one stroke made of a field.

    layer:   the detail that it added; None of a solver that changes the network
    goal:    what was asked for, of a stroke that reshapes what is there
    seconds: from the stroke's end to the new field, without its proxy
    """

    problem: Problem
    solver: Solver
    field: Field
    layer: Coefficients | None
    proxy: Proxy
    seconds: float
    goal: metrics.Goal | None = None

    @cached_property
    def preparation(self) -> Preparation:
        """For the next stroke."""
        return Preparation(self.field, self.proxy)

    def report(self, chamfer: bool = False, progress: Progress = silent) -> dict[str, Any]:
        """How close the field came, ready for JSON: see `metrics`.

        `limited` says that the stroke is finer than the budget of one edit can hold.

        chamfer: measure the paper's Chamfer distance, too (seconds)
        """
        reached, cell = None, 0.0
        if self.layer is not None:
            reached, cell = support(self.layer), spacing(max(self.layer))
        tell = rising(progress)
        problem = replace(self.problem, check=lambda: tell(0.0, metrics.MEASURING))
        if self.goal is None:
            measures = metrics.measure(problem, self.field, self.proxy, reached, cell, tell)
        else:
            measures = metrics.measure_goal(
                problem, self.field, self.proxy, reached, cell, self.goal, tell
            )
        if chamfer and self.goal is None:
            measures |= metrics.chamfer(problem, self.field, self.proxy)
        notes = [LEAVES_BOX] if measures.get("outside") else []
        return {
            "stroke": problem.stroke.name,
            "solver": self.solver.value,
            "seconds": self.seconds,
            "levels": sorted(self.layer or ()),
            "limited": self._is_limited,
            "widths": list(self.field.network.widths),
            **measures,
            **({"notes": notes} if notes else {}),
        }

    @property
    def _is_limited(self) -> bool:
        if self.layer is None or self.goal is not None:
            return False
        return resolution(self.problem).is_limited


def sculpt(
    preparation: Preparation,
    stroke: Stroke,
    *,
    solver: str = Solver.LOCAL,
    epochs: int | None = None,
    progress: Progress = silent,
) -> Edit:
    """Apply one stroke.

    solver: a `Solver`
    epochs: of the paper's solver; its own default when None

    SculptError when the stroke does not lie on the surface or cannot be solved; Cancelled as soon
    as `progress` raises it.
    """
    chosen = _solver(solver, epochs)
    started = time.perf_counter()
    progress = rising(progress)
    problem = pose(preparation, stroke, lambda: progress(0.0, "Sculpting"))
    if stroke.kind is not Kind.DRAW:
        return _reshape(problem, chosen, started, sub_progress(progress, 0.1, 1.0))
    if chosen is Solver.LOCAL:
        return _sculpt_detail(problem, started, sub_progress(progress, 0.1, 1.0))
    share = sub_progress(progress, 0.1, 0.8)
    field = preparation.field
    refuse_detail(field)
    if chosen is Solver.NETWORK:
        network = gauss_newton.solve(problem, share)
    else:
        network = paper.solve(problem, share, **({} if epochs is None else {"epochs": epochs}))
    seconds = time.perf_counter() - started
    proxy = extract(Field(network), CELLS, sub_progress(progress, 0.8, 1.0))
    return Edit(problem, chosen, Field(network), None, proxy, seconds)


def _reshape(problem: Problem, solver: Solver, started: float, progress: Progress) -> Edit:
    """The edit of a stroke that reshapes what is there."""
    if solver is not Solver.LOCAL:
        raise SculptError(
            "A stroke that is to {} adds detail, which the solver {} does not. Use the solver"
            " local; in Blender, choose Detail for the field.",
            problem.stroke.kind,
            solver,
        )
    (preparation, layer, *_), goal = reshape(problem, progress)
    seconds = time.perf_counter() - started
    field, proxy = preparation.field, preparation.proxy
    return Edit(problem, solver, field, layer, proxy, seconds, goal)


def _sculpt_detail(problem: Problem, started: float, progress: Progress) -> Edit:
    """The edit by the local solver; pieces of surface that nobody asked for are solved away."""
    before = problem.preparation
    edit, repairs = LocalEdit.solved(problem, progress), 0
    while True:
        seconds, field, layer = time.perf_counter() - started, edit.field, edit.layer
        proxy = update(before.proxy, field, support(layer), sub_progress(progress, 0.8, 1.0))
        done = Edit(problem, Solver.LOCAL, field, layer, proxy, seconds)
        if repairs == REPAIRS or proxy.components.total == before.proxy.components.total:
            return done
        held = problem.held.points
        islands = find_islands(proxy, Asked(edit.targets, held, before.proxy))
        if not len(islands.points):
            return done
        edit.forbid(islands)
        repairs += 1


def edit(
    field: Field,
    strokes: Sequence[Stroke],
    *,
    solver: str = Solver.LOCAL,
    epochs: int | None = None,
    chamfer: bool = False,
    progress: Progress = silent,
) -> tuple[Field, tuple[dict[str, Any], ...]]:
    """Apply `strokes` one after another and measure each: the field after all, and the reports.

    Arguments and errors as of `sculpt` and `Edit.report`.
    """
    _solver(solver, epochs)
    preparation = prepare(field, progress=lambda _, message: progress(0.0, message))
    reports = []
    for number, stroke in enumerate(strokes):
        share = sub_progress(progress, number / len(strokes), (number + 1) / len(strokes))
        done = sculpt(
            preparation,
            stroke,
            solver=solver,
            epochs=epochs,
            progress=sub_progress(share, 0.0, 0.8),
        )
        reports.append(done.report(chamfer, sub_progress(share, 0.8, 1.0)))
        preparation = done.preparation
    return preparation.field, tuple(reports)


def refuse_detail(field: Field) -> None:
    """SculptError when a field is more than its network."""
    if field.detail.coefficients:  # layers that were taken away leave levels without any
        raise SculptError(
            "This field has detail, which only the solver local can sculpt. Consolidate it into a"
            " network first, or choose that solver."
        )


def _solver(name: str, epochs: int | None) -> Solver:
    if name not in list(Solver):
        raise SculptError(
            "There is no solver {}; choose one of {}.", f"{name!r:.60}", ", ".join(Solver)
        )
    if epochs is not None and (name != Solver.PAPER or epochs < 1):
        raise SculptError("Only the paper's solver has epochs, and it needs at least one.")
    return Solver(name)
