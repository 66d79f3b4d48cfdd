# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 4: the time of each stage, of one epoch of the paper's method and of one edit of ours.

The paper's method as published draws and projects its samples in every epoch (see `published`); its
epoch of median length is shown, and drawn over time. Of ours the edit of median length is: what the
stroke costs in all, not a hundredth of it.
"""

import statistics
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pictures.sheet import Picture

from neural_sculpt_addon.field.edit import edit
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.problem import Problem
from neural_sculpt_addon.field.solve import gauss_newton, local
from neural_sculpt_addon.field.solve.edit_rows import EditedSurface

from ..edits import random_edit
from ..figures.gantt import gantt
from ..measures.stages import Span, Stopwatch, watching
from ..methods.methods import Scene, ours
from ..methods.published import PAPER, Published
from ..settings import Settings
from ..work import Row, Task
from .table import Cell, Table

SHAPE = "sphere"
FIRST, OURS = "published", ("network", "local")
STAGES: dict[tuple[Any, str], str] = {
    (edit, "pose"): "lay on the surface",
    (Problem, "displaced_surface"): "displaced surface",
    (EditedSurface, "__init__"): "untouched surface, rows",
    (EditedSurface, "finer"): "finer rows",
    (local, "solve_levels"): "assemble and solve",
    (local, "solve_level"): "assemble and solve",
    (gauss_newton, "draw"): "draw residuals",
    (gauss_newton, "solve_linear"): "conjugate gradients",
    (edit, "update"): "proxy",
    (edit, "extract"): "proxy",
}


def tasks(settings: Settings, scene: Callable[[str], Scene], _folder: Path) -> list[Task]:
    """The paper's method, and each of ours."""

    def published() -> Row:
        problem = pose(scene(SHAPE).preparation, _stroke(scene, settings))
        method, epochs = Published(problem), []
        for _ in range(settings.stages + 1):
            watch = Stopwatch()
            method.epoch(watch)
            epochs.append(watch.spans)
        return _median(epochs[1:])

    def mine(name: str) -> Callable[[], Row]:
        method = next(one for one in ours() if one.name == name)

        def make() -> Row:
            here, edits = scene(SHAPE), []
            method.prepare(here)
            for _ in range(settings.rounds + 1):
                with watching(STAGES) as watch:
                    method.edit(here, _stroke(scene, settings))
                edits.append(watch.spans)
            return _median(edits[1:])

        return make

    first = Task(f"table4-{FIRST}", 0.3 * settings.stages + 5, published)
    return [first, *(Task(f"table4-{name}", settings.rounds + 5, mine(name)) for name in OURS)]


def tables(rows: Mapping[str, Row]) -> list[Table]:
    """Milliseconds of each stage, of the paper and here."""
    found = []
    if row := rows.get(f"table4-{FIRST}"):
        here = _totals(row)
        lines: list[tuple[Cell, ...]] = [
            (stage, theirs, 1e3 * here[stage]) for stage, theirs in PAPER.items()
        ]
        lines.append(("sum", sum(PAPER.values()), 1e3 * sum(here.values())))
        about = "ms; the epoch of median length. The paper's are on an RTX 4070."
        found.append(
            Table(
                "table-4a",
                "Table 4a: one epoch of the paper's method as published",
                ("stage", "paper", "here"),
                tuple(lines),
                about,
            )
        )
    for place, name in enumerate(OURS):
        if row := rows.get(f"table4-{name}"):
            here = _totals(row)
            whole = row["spans"][-1][2] - row["spans"][0][1]
            lines = [(stage, 1e3 * seconds) for stage, seconds in here.items()]
            lines.append(("everything between them", 1e3 * (whole - sum(here.values()))))
            lines.append(("all", 1e3 * whole))
            letter = "bc"[place]
            title = f"Table 4{letter}: one whole edit by {name}"
            about = "ms; the edit of median length. The proxy is shown after the field is there."
            found.append(Table(f"table-4{letter}", title, ("stage", "here"), tuple(lines), about))
    return found


def figures(rows: Mapping[str, Row]) -> dict[str, tuple[Picture, str]]:
    """Pictures and what they show, by the names of their files."""
    titles = {FIRST: "One epoch of the paper's method as published"}
    titles |= {name: f"One whole edit by {name}" for name in OURS}
    return {
        f"stages-{name}.png": (
            gantt(title, [Span(*s) for s in row["spans"]]),
            f"{title}: its stages",
        )
        for name, title in titles.items()
        if (row := rows.get(f"table4-{name}"))
    }


def _stroke(scene: Callable[[str], Scene], settings: Settings) -> Any:
    return random_edit(scene(SHAPE).preparation, 0, settings.seed)


def _totals(row: Row) -> dict[str, float]:
    return Stopwatch([Span(*span) for span in row["spans"]]).totals()


def _median(runs: list[list[Span]]) -> Row:
    """The run of median length."""
    lengths = [spans[-1].end - spans[0].start for spans in runs]
    middle = lengths.index(statistics.median_low(lengths))
    return {"spans": [list(span) for span in runs[middle]]}
