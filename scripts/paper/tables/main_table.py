# SPDX-License-Identifier: GPL-3.0-or-later
"""The table that the README shows: all methods in one line each, out of tables 1 and 2.

It stands between two markers of the README, and a full run writes it anew.
"""

import statistics
from collections.abc import Mapping, Sequence

from neural_sculpt_addon.common.errors import SculptError

from ..work import Row
from . import table2
from .table import Cell, Table

BEGIN, END = "<!-- scripts/paper.py writes this table -->", "<!-- until here -->"
NAMES = {  # of methods, for those who have not read the paper
    "stroke": "the paper's stroke method",
    "3DNS": "3DNS",
    "3DNS union": "3DNS, one target for all points",
    "coarse mesh": "mesh of the network's size",
    "network": "ours, *Network*",
    "local": "ours, *Detail*",
}


def main_table(rows: Mapping[str, Row]) -> list[Table]:
    """It, of the rows that there are; none without a random edit."""
    timed = [row for key, row in rows.items() if key.startswith("table1-")]
    edits = [row for key, row in rows.items() if key.startswith("table2-")]
    if not edits:
        return []
    shapes = list(dict.fromkeys(row["shape"] for row in edits))
    points = sorted({row["points"] for row in timed})
    ends = points[:1] + points[1:][-1:]
    lines: list[tuple[Cell, ...]] = []
    for name in edits[0]["methods"]:
        of_method = [row["methods"][name] for row in edits]
        chamfer = [row["methods"][name]["tube"] / row["tube_floor"] for row in edits]
        times = [[r["seconds"][name] for r in timed if r["points"] == count] for count in ends]
        lines.append(
            (
                NAMES.get(name, name),
                *(statistics.median(t for row in some for t in row) for some in times),
                *(1e3 * _mean(of_method, measure) for measure in ("asked", "drift")),
                *(_mean(of_method, measure) for measure in ("normal", "turned")),
                statistics.fmean(chamfer),
                round(_mean(of_method, "bytes") / 1e3),
            )
        )
    counted = f"Means over {len(edits)} random edits ({table2.counts(edits)})"
    about = (
        f"{counted} of radius 0.08 and intensity 0.06; lengths are 1e-3 of a box two units wide."
        " Error: displaced samples from the result. Drift and turned normals: of the surface that"
        " the stroke does not reach. Chamfer: in the tube, by the distance of two samplings of the"
        " ground truth, its noise floor."
    )
    if timed:
        about += " Seconds: medians of table 1's rounds, by the points along the stroke."
    columns = (
        *("method", *(f"seconds, {count} points" for count in ends), "error", "drift"),
        *("normals, °", "untouched normals, °", "Chamfer / floor", "kB"),
    )
    title = f"All methods, on {_listed(shapes)}"
    return [Table("table-main", title, columns, tuple(lines), about)]


def replaced(text: str, tables: Sequence[Table], note: str = "") -> str:
    """The README's `text` with table and note between its markers. SculptError without these."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise SculptError("README.md has no place for the paper's table.")
    told = "\n".join(f"{table.grid()}\n\n{table.about} {note}".rstrip() for table in tables)
    return f"{before}{begin}\n\n{told}\n\n{end}{after}"


def _mean(found: Sequence[Mapping[str, float]], measure: str) -> float:
    return statistics.fmean(one[measure] for one in found)


def _listed(words: Sequence[object]) -> str:
    *most, last = map(str, words)
    return f"{', '.join(most)} and {last}" if most else last
