# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 2: how far random edits are from what they ask for, on every shape.

A row of work is one edit on one shape by all methods. Lengths are shown in 1e-3 of model space,
means over the edits.
"""

import statistics
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from neural_sculpt_addon.field.problem.pose import pose

from ..edits import random_edit
from ..measures.chamfer import Chamfer, tube_of
from ..measures.ground import displaced_mesh
from ..measures.measures import measure
from ..measures.surface import MeshSurface
from ..methods.mesh_edit import Coarse
from ..methods.methods import Method, Product, Scene, each_alone, ours
from ..methods.three_dns import ThreeDns
from ..settings import Settings
from ..work import Row, Task
from .table import Cell, Table

PAPER = {  # Chamfer distance x 1e3: stroke method, 3DNS, coarse mesh; whole surface and tube
    "sphere": ((7.279, 7.394, 7.329), (9.932, 28.099, 17.532)),
    "bunny": ((9.175, 9.190, 9.815), (14.661, 29.130, 21.240)),
    "bust": ((7.363, 7.555, 7.617), (12.711, 29.164, 19.998)),
    "pumpkin": ((8.470, 8.690, 9.445), (9.672, 28.446, 20.301)),
    "torus": ((5.969, 6.098, 6.208), (11.850, 23.368, 15.307)),
    "frog": ((8.099, 8.357, 9.091), (8.785, 28.262, 22.886)),
}
LENGTHS = ("asked", "asked_p95", "back", "drift", "drift_p99")
CLEAN = (*LENGTHS, "normal", "turned")
SECONDS_OF_EPOCH = 0.08 + 2 * 0.17  # the stroke method's, and two kinds of 3DNS
SECONDS_OF_MEASURES = 25.0  # of 100,000 samples


def methods(settings: Settings) -> list[Method]:
    """Those that are compared, baselines first."""
    return [
        Product("stroke", "paper", settings.quality),
        ThreeDns("3DNS", settings.quality),
        ThreeDns("3DNS union", settings.quality, union=True),
        Coarse(),
        *ours(),
    ]


def tasks(settings: Settings, scene: Callable[[str], Scene], _folder: Path) -> list[Task]:
    """One for each edit on each shape; an edit of every shape comes before the next of any."""
    compared = methods(settings)
    seconds = SECONDS_OF_EPOCH * settings.quality
    seconds += SECONDS_OF_MEASURES * settings.samples / 100_000 + 3

    def task(shape: str, number: int) -> Task:
        def make(methods: Sequence[Method] = compared) -> Row:
            return row(methods, scene(shape), shape, number, settings)

        return Task(f"table2-{shape}-{number}", seconds, make, each_alone(make, compared))

    return [task(shape, number) for number in range(settings.edits) for shape in settings.shapes]


def row(
    compared: Sequence[Method], scene: Scene, shape: str, number: int, settings: Settings
) -> Row:
    """One edit by all methods."""
    stroke = random_edit(scene.preparation, number, settings.seed)
    problem = pose(scene.preparation, stroke)
    truth, tube = displaced_mesh(problem, scene.dense), tube_of(problem)
    chamfer = Chamfer(truth, tube, settings.samples, number)
    found: Row = {"shape": shape, "edit": number, **chamfer.floor, "methods": {}}
    found["truth_bytes"] = truth.bytes
    for method in compared:
        method.prepare(scene)
        surface = method.edit(scene, stroke).surface
        found["methods"][method.name] = {
            "bytes": surface.bytes,
            "triangles": len(surface.triangles) if isinstance(surface, MeshSurface) else None,
            **chamfer.of(surface),
            **measure(problem, surface, truth, tube, settings.samples // 5),
        }
    return found


def tables(rows: Mapping[str, Row]) -> list[Table]:
    """The Chamfer distances, and the clean measures."""
    some = [row for key, row in rows.items() if key.startswith("table2-")]
    if not some:
        return []
    shapes = list(dict.fromkeys(row["shape"] for row in some))
    names = list(some[0]["methods"])
    return [
        _chamfer_table(some, shapes, names, "whole", "2a", "the whole surface", 0),
        _chamfer_table(some, shapes, names, "tube", "2b", "the tube", 1),
        _clean_table(some, shapes, names),
    ]


def counts(rows: Sequence[Row]) -> str:
    """How many edits there are of each shape."""
    shapes = [row["shape"] for row in rows]
    return ", ".join(f"{shape} {shapes.count(shape)}" for shape in dict.fromkeys(shapes))


def _mean(rows: Sequence[Row], shape: str, method: str, measure: str) -> float:
    chosen = [row["methods"][method][measure] for row in rows if row["shape"] == shape]
    return statistics.fmean(chosen)


def _chamfer_table(
    rows: Sequence[Row],
    shapes: Sequence[str],
    names: Sequence[str],
    region: str,
    number: str,
    words: str,
    place: int,
) -> Table:
    lines: list[tuple[Cell, ...]] = []
    for shape in shapes:
        theirs = PAPER.get(shape)
        floors = [row[f"{region}_floor"] for row in rows if row["shape"] == shape]
        found = [1e3 * _mean(rows, shape, name, region) for name in names]
        told = " / ".join(f"{value:.2f}" for value in theirs[place]) if theirs else None
        lines.append((shape, told, 1e3 * statistics.fmean(floors), *found))
    return Table(
        f"table-{number}",
        f"Table {number}: Chamfer distance over {words}",
        ("shape", "paper: stroke / 3DNS / coarse", "noise floor", *names),
        tuple(lines),
        f"1e-3 of model space; means over random edits ({counts(rows)}). The noise floor is that of"
        " two samplings of the ground truth.",
    )


def _clean_table(rows: Sequence[Row], shapes: Sequence[str], names: Sequence[str]) -> Table:
    lines: list[tuple[Cell, ...]] = []
    for shape in shapes:
        for name in names:
            scales = [1e3 if measure in LENGTHS else 1.0 for measure in CLEAN]
            found = [
                scale * _mean(rows, shape, name, measure)
                for scale, measure in zip(scales, CLEAN, strict=True)
            ]
            size = _mean(rows, shape, name, "bytes") / 1e3
            lines.append((shape, name, *found, size))
    return Table(
        "table-2c",
        "Table 2c: distances without sampling noise, and sizes",
        (
            *("shape", "method", "asked", "asked p95", "back", "drift", "drift p99"),
            *("normals, °", "untouched normals, °", "kB"),
        ),
        tuple(lines),
        f"1e-3 of model space; means over random edits ({counts(rows)}). Asked: displaced samples"
        " from the result. Back: the result in the tube from the ground truth's mesh. Drift:"
        " untouched surface from the result.",
    )
