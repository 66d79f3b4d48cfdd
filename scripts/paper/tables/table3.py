# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 3: what samples along the stroke bring, on one edit of the sphere.

The same way with 8 to 512 points; the ground truth is that of the most. The stroke method has as
many rows of tube samples as there are points, 3DNS so many brushes. Ours choose their samples by
themselves, so their rows tell what control points alone do.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from neural_sculpt_addon.field.problem.pose import pose

from ..edits import random_edit
from ..measures.chamfer import Chamfer, tube_of
from ..measures.ground import displaced_mesh
from ..measures.measures import measure
from ..methods.methods import Method, RowsOfStroke, Scene, each_alone, ours
from ..methods.three_dns import ThreeDns
from ..settings import Settings
from ..work import Row, Task
from .table import Cell, Table

SHAPE = "sphere"
PAPER = {8: 12.52, 16: 11.49, 32: 9.67, 64: 6.74, 128: 6.54, 512: 6.42}  # Chamfer x 1e3
SECONDS = 0.08, 0.1, 0.005  # of an epoch: the stroke method, 3DNS, 3DNS for each further point
SECONDS_OF_MEASURES = 20.0  # of 100,000 samples


def methods(settings: Settings) -> list[Method]:
    """Those that are compared, baselines first."""
    return [
        RowsOfStroke("stroke", settings.quality),
        ThreeDns("3DNS", settings.quality),
        ThreeDns("3DNS union", settings.quality, union=True),
        *ours(),
    ]


def tasks(settings: Settings, scene: Callable[[str], Scene], _folder: Path) -> list[Task]:
    """One for each number of points."""
    compared, most = methods(settings), max(settings.along)

    def task(points: int) -> Task:
        def make(methods: Sequence[Method] = compared) -> Row:
            here = scene(SHAPE)
            reference = random_edit(here.preparation, 0, settings.seed, most)
            problem = pose(here.preparation, reference)
            truth, tube = displaced_mesh(problem, here.dense), tube_of(problem)
            chamfer = Chamfer(truth, tube, settings.samples, points)
            row: Row = {"points": points, **chamfer.floor, "methods": {}}
            stroke = random_edit(here.preparation, 0, settings.seed, points)
            for method in methods:
                method.prepare(here)
                surface = method.edit(here, stroke).surface
                row["methods"][method.name] = {
                    **chamfer.of(surface),
                    **measure(problem, surface, truth, tube, settings.samples // 5),
                }
            return row

        stroke, dns, more = SECONDS
        epoch = stroke + dns + 1.5 * more * points + dns
        measures = SECONDS_OF_MEASURES * settings.samples / 100_000
        seconds = settings.quality * epoch + measures + 5
        return Task(f"table3-{points}", seconds, make, each_alone(make, compared))

    return [task(points) for points in settings.along]


def tables(rows: Mapping[str, Row]) -> list[Table]:
    """Chamfer distances of the whole surface as in the paper, and the clean measure."""
    some = [row for key, row in rows.items() if key.startswith("table3-")]
    if not some:
        return []
    names = list(some[0]["methods"])
    lines: list[tuple[Cell, ...]] = []
    for row in some:
        by = row["methods"]
        lines.append(
            (
                row["points"],
                PAPER.get(row["points"]),
                1e3 * row["whole_floor"],
                *(1e3 * by[name]["whole"] for name in names),
                *(1e3 * by[name]["asked"] for name in names),
            )
        )
    return [
        Table(
            "table-3",
            "Table 3: one edit of the sphere, by points along the stroke",
            (
                *("points", "paper: stroke", "noise floor"),
                *(f"Chamfer: {name}" for name in names),
                *(f"asked: {name}" for name in names),
            ),
            tuple(lines),
            "1e-3 of model space. Chamfer distances over the whole surface, as in the paper, and"
            " the mean distance of displaced samples from the result.",
        )
    ]
