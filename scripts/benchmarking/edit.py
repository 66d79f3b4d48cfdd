# SPDX-License-Identifier: GPL-3.0-or-later
"""The edit benchmark: the paper's solver, the network's and the local one on every scored case.

Others instead: --hard, strokes that are hard to solve; --points, the cost of a stroke against its
control points. Lengths are in model space. Seconds are from the stroke's end to the new field, the
fewer of two runs; preparing is not timed, because it happens while the artist draws.
"""

import argparse
import json
import statistics
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import random_strokes, scored_cases

if TYPE_CHECKING:
    from neural_sculpt_addon.field.edit.edit import Edit
    from neural_sculpt_addon.field.problem.prepare import Preparation
    from neural_sculpt_addon.stroke.stroke import Stroke

    Case = tuple[str, Preparation, Stroke]

COLUMNS = (
    *("seconds", "tube_mean", "tube_p95", "tube_max", "reverse_p95", "gain"),
    *("drift_mean", "drift_p99", "drift_max", "untouched_normal_rms", "rim_mean", "normal_deg"),
    *("gradient", "components_before", "components_after", "tolerance", "tolerance_met"),
)
THOUSANDTHS = ("tube", "reverse", "drift", "rim", "tolerance")
"""Beginnings of the names of lengths, which the table shows in 1e-3 of model space."""

GOOD = ("gain", "tolerance", "tolerance_met")  # whose worst is the least
METHODS: dict[str, dict[str, Any]] = {
    "paper50": {"solver": "paper", "epochs": 50},
    "paper100": {"solver": "paper", "epochs": 100},
    "network": {"solver": "network"},
    "local": {"solver": "local"},
}
BASELINE = "paper50"
ROUNDS = 2


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py edit`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    scored_cases.add_option(parser)
    parser.add_argument("--hard", action="store_true", help="hard strokes")
    parser.add_argument("--points", action="store_true", help="one stroke of 8 to 512 points")
    parser.add_argument("--methods", default=",".join(METHODS), help="default: %(default)s")
    parser.add_argument("--device", default="cpu", help="of PyTorch, as cuda (default: cpu)")


def run(options: argparse.Namespace) -> None:
    """Print the table, and write the rows where `--json` says."""
    methods = options.methods.split(",")
    if unknown := set(methods) - set(METHODS):
        sys.exit(
            f"There is no method {', '.join(sorted(unknown))}; choose of {', '.join(METHODS)}."
        )
    print("lengths in 1e-3 of model space\n" + _line("case", "method", COLUMNS))
    rows = []
    for row in _rows(_cases(options), methods):
        rows.append(row)
        cells = [] if "refused" in row else [_short(row, column) for column in COLUMNS]
        print(_line(row["case"], row["method"], cells) + row.get("refused", ""), flush=True)
    _print_summary(rows, methods)
    if options.json:
        options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def _cases(options: argparse.Namespace) -> "Iterator[Case]":
    if options.hard:
        return _hard(options.device)
    if options.points:
        return _more_points(options.device)
    if not options.cases.is_file():
        sys.exit(f"There are no cases at {options.cases}; name a file with --cases.")
    return _scored(options.cases, options.device)


def _scored(path: Path, device: str) -> "Iterator[Case]":
    from neural_sculpt_addon.field.checkpoint import load
    from neural_sculpt_addon.field.problem.prepare import prepare
    from neural_sculpt_addon.stroke.stroke import Stroke

    networks = path.parent.parent / "networks"
    for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        preparation = prepare(load(networks / f"{case['model']}.pth").to(device))
        yield case["id"], preparation, Stroke.from_json(scored_cases.read_case(case))


def _hard(device: str) -> "Iterator[Case]":
    from neural_sculpt_addon.field.problem.prepare import prepare

    for model, field in random_strokes.fields():
        preparation = prepare(field.to(device))
        for name in random_strokes.HARD:
            stroke = random_strokes.hard(field, preparation.surface, name)
            yield f"{model}-{name}", preparation, stroke


def _more_points(device: str) -> "Iterator[Case]":
    import numpy as np

    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.field.problem.prepare import prepare
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.stroke import Stroke

    preparation = prepare(primitive("sphere").to(device))
    for count in (8, 16, 32, 64, 128, 256, 512):
        turn = np.linspace(0, 1, count)
        points = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        yield f"{count} points", preparation, Stroke(points, Brush(0.08, 0.06))


def _rows(cases: "Iterable[Case]", methods: list[str]) -> Iterator[dict[str, Any]]:
    """Every case by every method."""
    from neural_sculpt_addon.common.errors import SculptError

    for case, preparation, stroke in cases:
        for method in methods:
            row: dict[str, Any] = {"case": case, "method": method}
            try:
                edit, seconds = _best(preparation, stroke, method)
            except SculptError as error:
                yield row | {"refused": str(error)}
            else:
                report = edit.report()
                row |= {"seconds": seconds, "levels": report["levels"]}
                yield row | {name: report[name] for name in COLUMNS[1:]}


def _best(preparation: "Preparation", stroke: "Stroke", method: str) -> "tuple[Edit, float]":
    """The edit, and the fewest seconds of so many rounds. What is drawn of the unedited field when
    it is first asked for is there from the first one."""
    from neural_sculpt_addon.field.edit.edit import sculpt

    edits = [sculpt(preparation, stroke, **METHODS[method]) for _ in range(ROUNDS)]
    return edits[-1], min(edit.seconds for edit in edits)


def _print_summary(rows: list[dict[str, Any]], methods: list[str]) -> None:
    """Medians and worst of each method, and how much faster than the paper's it is."""
    solved = {
        method: [row for row in rows if row["method"] == method and "refused" not in row]
        for method in methods
    }
    for word in ("median", "worst"):
        for method, chosen in solved.items():
            if chosen:
                whole = {column: _whole(word, column, chosen) for column in COLUMNS}
                print(_line(word, method, [_short(whole, column) for column in COLUMNS]))
    for method, chosen in solved.items():
        met = sum(row["tolerance_met"] for row in chosen)
        print(f"{method}: tolerance met by {met} of {len(chosen)}", end="")
        times = {row["case"]: row["seconds"] for row in chosen}
        slow = {row["case"]: row["seconds"] for row in solved.get(BASELINE, ())}
        if method != BASELINE and (both := times.keys() & slow.keys()):
            ratio = statistics.median(slow[case] for case in both) / statistics.median(
                times[case] for case in both
            )
            print(f", {ratio:.1f} times as fast as {BASELINE}", end="")
        print()


def _whole(word: str, column: str, rows: list[dict[str, Any]]) -> float:
    summary = statistics.median if word == "median" else min if column in GOOD else max
    return summary([float(row[column]) for row in rows])


def _line(case: str, method: str, cells: Any) -> str:
    widths = (max(7, len(column)) for column in COLUMNS)
    return f"{case:<17}{method:<9}" + " ".join(
        f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=False)
    )


def _short(row: dict[str, Any], column: str) -> str:
    if column == "tolerance_met":
        return f"{row[column]:.0f}"
    scale = 1e3 if column.startswith(THOUSANDTHS) else 1.0
    return f"{scale * float(row[column]):.3g}"
