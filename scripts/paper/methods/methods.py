# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that are compared, each behind one interface, and those of this project.

    stroke    the paper's solver on the paper's tube: Adam on all weights (docs/method.md, 11)
    network   ours on the network's weights: Gauss-Newton (10)
    local     ours with local detail (4)

Baselines of others: `three_dns` and `mesh_edit`. What depends on the unedited field alone is made
by `prepare` and not timed, for all methods alike: it happens while an artist draws.

The stroke method is the product's, which is kinder to the paper than the paper's own code: samples
are drawn and projected once and not every epoch, parts of a batch go to all cores, target normals
are right, and the loss is rounded at zero, so the last iterate drifts less (see `solve.paper`).
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from neural_sculpt_addon.field.checkpoint import to_bytes
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import Proxy
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import Preparation
from neural_sculpt_addon.field.problem.problem import Problem
from neural_sculpt_addon.field.problem.tube import COLUMNS, Tube
from neural_sculpt_addon.stroke.stroke import Stroke

from ..measures.surface import FieldSurface, Surface
from ..work import Row


@dataclass(frozen=True)
class Scene:
    """An unedited field and what methods start from.

    dense: its mesh, of which the ground truth is made
    """

    preparation: Preparation
    dense: Proxy

    @property
    def field(self) -> Field:
        """The unedited field."""
        return self.preparation.field


@dataclass(frozen=True)
class Result:
    """What a method made of a stroke; seconds from the stroke's end to the edited surface."""

    surface: Surface
    seconds: float


class Method(Protocol):
    """One of those that are compared."""

    @property
    def name(self) -> str:
        """In tables."""
        ...

    def prepare(self, scene: Scene) -> None:
        """What can be done before the stroke ends."""
        ...

    def edit(self, scene: Scene, stroke: Stroke) -> Result:
        """The edit of one stroke."""
        ...


@dataclass(frozen=True)
class Product:
    """A solver of the product, as `edit.sculpt` runs it, until the new field is there."""

    name: str
    solver: str
    epochs: int | None = None

    def prepare(self, scene: Scene) -> None:
        """Samples of the surface, which are drawn when they are first asked for."""
        _touch(scene.preparation)

    def edit(self, scene: Scene, stroke: Stroke) -> Result:
        """The edit of one stroke."""
        edit = sculpt(scene.preparation, stroke, solver=self.solver, epochs=self.epochs)
        size = len(to_bytes(edit.field))
        return Result(FieldSurface(edit.field, edit.proxy, size), edit.seconds)


@dataclass(frozen=True)
class RowsOfStroke:
    """The stroke method with as many rows of tube samples as the stroke has points.

    For tables 1 and 3, which ask what samples along the stroke cost and bring. The paper's other
    tables have 99 rows whatever the stroke.
    """

    name: str
    epochs: int

    def prepare(self, scene: Scene) -> None:
        """As of `Product`."""
        _touch(scene.preparation)

    def edit(self, scene: Scene, stroke: Stroke) -> Result:
        """The edit of one stroke."""
        from neural_sculpt_addon.field.mesh.proxy import extract
        from neural_sculpt_addon.field.problem.prepare import CELLS
        from neural_sculpt_addon.field.solve import paper

        started = time.perf_counter()
        problem = pose(scene.preparation, stroke)
        fewer = _Fewer(
            problem.preparation,
            problem.placed,
            problem.guide,
            problem.seed,
            rows=len(stroke.points),
        )
        field = Field(paper.solve(fewer, epochs=self.epochs))
        seconds = time.perf_counter() - started
        proxy = extract(field, CELLS)
        return Result(FieldSurface(field, proxy, len(to_bytes(field))), seconds)


@dataclass(frozen=True)
class _Fewer(Problem):
    """A problem whose tube has so many rows between the ends of the stroke."""

    rows: int = 0

    def tubes(
        self,
        rows: int = 0,
        columns: int = COLUMNS,
        jitter: np.random.Generator | None = None,
    ) -> list[Tube]:
        """As of `Problem`, with the rows of this one by default."""
        return super().tubes(rows or self.rows, columns, jitter)


def ours() -> list[Method]:
    """This project's methods."""
    return [Product("network", "network"), Product("local", "local")]


def each_alone(
    make: Callable[[Sequence[Method]], Row], compared: Sequence[Method]
) -> dict[str, Callable[[], Row]]:
    """The row that `make` makes of methods, of each of those `compared` alone."""
    return {method.name: partial(make, [method]) for method in compared}


def timed(
    methods: Sequence[Method], scene: Scene, stroke: Stroke, rounds: int
) -> dict[str, list[float]]:
    """Seconds of each method, as often as `rounds` say, one method after another in each."""
    seconds: dict[str, list[float]] = {method.name: [] for method in methods}
    for _ in range(rounds):
        for method in methods:
            method.prepare(scene)
            seconds[method.name].append(method.edit(scene, stroke).seconds)
    return seconds


def _touch(preparation: Preparation) -> None:
    """Have all samples drawn."""
    for made in ("surface", "shell", "box", "underestimation"):
        getattr(preparation, made)
