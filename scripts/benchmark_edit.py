# SPDX-License-Identifier: GPL-3.0-or-later
"""The edit benchmark: the paper's solver, quick and final on every scored case, in one run.

Lengths are in model space; preparing is not timed, because it happens while the artist draws.
"""

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import read_cases

if TYPE_CHECKING:
    from neural_sculpt_addon.field.solvers import Solve

COLUMNS = (
    *("seconds", "tube_mean", "tube_p95", "tube_max", "drift_mean", "drift_p99", "drift_max"),
    *("rim_mean", "normal_deg", "gradient", "components_before", "components_after"),
    "tolerance_met",
)
THOUSANDTHS = ("tube", "drift", "rim")  # lengths, which the table shows in 1e-3 of model space
METHODS = ("paper50", "paper100", "quick", "final")


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py edit`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    parser.add_argument("--cases", type=Path, default=read_cases.CASES, help="default: %(default)s")
    parser.add_argument("--methods", default=",".join(METHODS), help="default: %(default)s")


def run(options: argparse.Namespace) -> None:
    """Print the table, and write the rows where `--json` says."""
    if unknown := set(options.methods.split(",")) - set(METHODS):
        sys.exit(
            f"There is no method {', '.join(sorted(unknown))}; choose of {', '.join(METHODS)}."
        )
    if not options.cases.is_file():
        sys.exit(f"There are no cases at {options.cases}; name a file with --cases.")
    print("lengths in 1e-3 of model space\n" + _line("case", "method", COLUMNS))
    rows = []
    for row in _rows(options.cases, options.methods.split(",")):
        rows.append(row)
        print(_line(row["case"], row["method"], [_short(row, column) for column in COLUMNS]))
    for word, summary in (("median", statistics.median), ("worst", max)):
        for method in options.methods.split(","):
            chosen = [row for row in rows if row["method"] == method]
            whole = {c: summary([float(row[c]) for row in chosen]) for c in COLUMNS}
            print(_line(word, method, [_short(whole, column) for column in COLUMNS]))
    if options.json:
        options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def _rows(path: Path, methods: list[str]) -> Iterator[dict[str, Any]]:
    """Every case by every method."""
    import torch

    from neural_sculpt_addon.field import checkpoint, metrics
    from neural_sculpt_addon.field.prepare import prepare
    from neural_sculpt_addon.field.problem import pose
    from neural_sculpt_addon.field.proxy import extract
    from neural_sculpt_addon.field.solvers.gauss_newton import TOLERANCE
    from neural_sculpt_addon.stroke.stroke import Stroke

    torch.set_num_threads(1)  # as in the worker
    networks = path.parent.parent / "networks"
    for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        preparation = prepare(checkpoint.load(networks / f"{case['model']}.pth"))
        stroke = Stroke.from_json(read_cases.read_case(case))
        for method in methods:
            start = time.perf_counter()
            problem = pose(preparation, stroke)
            network = _solver(method)(problem, lambda _, __: None)
            seconds = time.perf_counter() - start
            measures = metrics.measure(problem, network, extract(network))
            met = measures["tube_p95"] < TOLERANCE
            row = {"case": case["id"], "method": method, "seconds": seconds, "tolerance_met": met}
            yield row | {name: measures[name] for name in COLUMNS if name in measures}


def _solver(method: str) -> "Solve":
    from neural_sculpt_addon.field.solvers import gauss_newton, paper

    solvers: dict[str, Callable[..., Any]] = {
        "paper50": partial(paper.solve, epochs=50),
        "paper100": partial(paper.solve, epochs=100),
        "quick": gauss_newton.quick,
        "final": lambda problem, progress: gauss_newton.refine(
            problem, gauss_newton.quick(problem, progress), progress
        ),
    }
    return solvers[method]


def _line(case: str, method: str, cells: Any) -> str:
    return f"{case:<14}{method:<9}" + " ".join(f"{cell[:9]:>9}" for cell in cells)


def _short(row: dict[str, Any], column: str) -> str:
    scale = 1e3 if column.startswith(THOUSANDTHS) else 1.0
    return f"{scale * float(row[column]):.3g}"
