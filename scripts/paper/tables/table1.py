# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 1: the time of one edit against the points of the stroke.

A row of work is one shape and one number of points; in each round all methods take their turns,
and the median of the rounds counts, so what else the machine does falls on all of them alike. The
stroke method has as many rows of tube samples as the stroke has points.
"""

import statistics
from collections.abc import Callable, Mapping
from pathlib import Path

from ..edits import random_edit
from ..methods.mesh_edit import Coarse
from ..methods.methods import Method, RowsOfStroke, Scene, ours, timed
from ..methods.three_dns import ThreeDns
from ..settings import Settings
from ..work import Row, Task
from .table import Cell, Table

PAPER = {8: (0.468, 0.553), 16: (0.473, 1.083), 32: (0.464, 1.985), 64: (0.482, 3.767)}
PAPER[128] = 0.517, 7.755  # seconds on an RTX 4070: stroke method, 3DNS

SECONDS = 0.07, 0.09, 0.005  # of an epoch: the stroke method, 3DNS, and 3DNS for each further point


def methods(settings: Settings) -> list[Method]:
    """Those that are compared, baselines first."""
    return [
        RowsOfStroke("stroke", settings.speed),
        ThreeDns("3DNS", settings.speed),
        ThreeDns("3DNS union", settings.speed, union=True),
        Coarse(),
        *ours(),
    ]


def tasks(settings: Settings, scene: Callable[[str], Scene], _folder: Path) -> list[Task]:
    """One for each shape and number of points."""
    compared = methods(settings)

    def task(shape: str, points: int) -> Task:
        def make() -> Row:
            here = scene(shape)
            stroke = random_edit(here.preparation, 0, settings.seed, points)
            seconds = timed(compared, here, stroke, settings.rounds)
            return {"shape": shape, "points": points, "seconds": seconds}

        stroke, dns, more = SECONDS
        epoch = stroke + dns + 1.5 * more * points + dns
        return Task(f"table1-{shape}-{points}", settings.rounds * settings.speed * epoch + 6, make)

    return [task(shape, n) for shape in settings.timed_shapes for n in settings.points]


def tables(rows: Mapping[str, Row]) -> list[Table]:
    """Seconds and ratios."""
    some = [row for key, row in rows.items() if key.startswith("table1-")]
    if not some:
        return []
    names = list(some[0]["seconds"])
    lines: list[tuple[Cell, ...]] = []
    for row in some:
        median = {name: statistics.median(row["seconds"][name]) for name in names}
        local = median["local"]
        theirs = PAPER.get(row["points"])
        lines.append(
            (
                row["shape"],
                row["points"],
                theirs[1] / theirs[0] if theirs else None,
                *median.values(),
                median["3DNS"] / median["stroke"],
                median["stroke"] / local,
                median["3DNS"] / local,
                median["3DNS union"] / local,
            )
        )
    return [
        Table(
            "table-1",
            "Table 1: seconds for one edit, by points along the stroke",
            (
                *("shape", "points", "paper: 3DNS / stroke", *names, "3DNS / stroke"),
                *("stroke / local", "3DNS / local", "3DNS union / local"),
            ),
            tuple(lines),
            "Medians of rounds in which all methods take turns, from the stroke's end to the new"
            " field or mesh; what depends on the unedited field alone is made before.",
        )
    ]
