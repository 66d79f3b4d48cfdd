# SPDX-License-Identifier: GPL-3.0-or-later
"""The edit benchmark: the paper's solver, quick and final on every scored case, in one run.

Others instead: --hard, strokes that are hard to solve; --points, the cost of a stroke against its
control points; --sequence N, what N strokes after each other leave of the surface asked for.
Lengths are in model space; preparing is not timed, because it happens while the artist draws.
"""

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import benchmark_strokes
import read_cases

if TYPE_CHECKING:
    from neural_sculpt_addon.field.prepare import Preparation
    from neural_sculpt_addon.field.solvers import Solve
    from neural_sculpt_addon.stroke.stroke import Stroke

    Case = tuple[str, Preparation, Stroke]

COLUMNS = (
    *("seconds", "tube_mean", "tube_p95", "tube_max", "drift_mean", "drift_p99", "drift_max"),
    *("rim_mean", "normal_deg", "gradient", "components_before", "components_after"),
    "tolerance_met",
)
SEQUENCE_COLUMNS = ("drift_mean", "drift_p99", "gradient", "components_after", "width")
THOUSANDTHS = ("tube", "drift", "rim")  # lengths, which the table shows in 1e-3 of model space
METHODS = ("paper50", "paper100", "quick", "final")


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py edit`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    parser.add_argument("--cases", type=Path, default=read_cases.CASES, help="default: %(default)s")
    parser.add_argument("--hard", action="store_true", help="hard strokes")
    parser.add_argument("--points", action="store_true", help="one stroke of 8 to 512 points")
    parser.add_argument("--sequence", type=int, metavar="N", help="N strokes one after another")
    parser.add_argument("--methods", default=",".join(METHODS), help="default: %(default)s")


def run(options: argparse.Namespace) -> None:
    """Print the table, and write the rows where `--json` says."""
    if unknown := set(options.methods.split(",")) - set(METHODS):
        sys.exit(
            f"There is no method {', '.join(sorted(unknown))}; choose of {', '.join(METHODS)}."
        )
    rows = _print_sequences(options.sequence) if options.sequence else _print_methods(options)
    if options.json:
        options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def _print_methods(options: argparse.Namespace) -> list[dict[str, Any]]:
    if options.hard:
        cases = _hard()
    elif options.points:
        cases = _more_points()
    elif options.cases.is_file():
        cases = _scored(options.cases)
    else:
        sys.exit(f"There are no cases at {options.cases}; name a file with --cases.")
    print("lengths in 1e-3 of model space\n" + _line("case", "method", COLUMNS))
    rows = []
    for row in _rows(cases, options.methods.split(",")):
        rows.append(row)
        print(_line(row["case"], row["method"], [_short(row, column) for column in COLUMNS]))
    for word, summary in (("median", statistics.median), ("worst", max)):
        for method in options.methods.split(","):
            chosen = [row for row in rows if row["method"] == method]
            whole = {c: summary([float(row[c]) for row in chosen]) for c in COLUMNS}
            print(_line(word, method, [_short(whole, column) for column in COLUMNS]))
    return rows


def _scored(path: Path) -> "Iterator[Case]":
    from neural_sculpt_addon.field.checkpoint import load
    from neural_sculpt_addon.field.prepare import prepare
    from neural_sculpt_addon.stroke.stroke import Stroke

    networks = path.parent.parent / "networks"
    for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        preparation = prepare(load(networks / f"{case['model']}.pth"))
        yield case["id"], preparation, Stroke.from_json(read_cases.read_case(case))


def _hard() -> "Iterator[Case]":
    from neural_sculpt_addon.field.prepare import prepare

    for model, network in benchmark_strokes.networks():
        preparation = prepare(network)
        for name in benchmark_strokes.HARD:
            stroke = benchmark_strokes.hard(network, preparation.surface, name)
            yield f"{model}-{name}", preparation, stroke


def _more_points() -> "Iterator[Case]":
    import numpy as np

    from neural_sculpt_addon.field.prepare import prepare
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.stroke import Stroke

    preparation = prepare(primitive("sphere"))
    for count in (8, 16, 32, 64, 128, 256, 512):
        turn = np.linspace(0, 1, count)
        points = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        yield f"{count} points", preparation, Stroke(points, Brush(0.08, 0.06))


def _rows(cases: "Iterable[Case]", methods: list[str]) -> Iterator[dict[str, Any]]:
    """Every case by every method."""
    from neural_sculpt_addon.field import metrics
    from neural_sculpt_addon.field.problem import pose
    from neural_sculpt_addon.field.proxy import extract
    from neural_sculpt_addon.field.solvers.gauss_newton import TOLERANCE

    for case, preparation, stroke in cases:
        for method in methods:
            start = time.perf_counter()
            problem = pose(preparation, stroke)
            network = _solver(method)(problem, lambda _, __: None)
            seconds = time.perf_counter() - start
            measures = metrics.measure(problem, network, extract(network))
            met = measures["tube_p95"] < TOLERANCE
            row = {"case": case, "method": method, "seconds": seconds, "tolerance_met": met}
            yield row | {name: measures[name] for name in COLUMNS if name in measures}


def _print_sequences(count: int) -> list[dict[str, Any]]:
    """What is left after each of `count` random strokes on every model."""
    import numpy as np

    from neural_sculpt_addon.field.edit import edit
    from neural_sculpt_addon.field.pieces import components
    from neural_sculpt_addon.field.prepare import prepare
    from neural_sculpt_addon.field.projection import find_surface

    rows = []
    print("drift in 1e-3 of model space\n" + _line("model", "strokes", SEQUENCE_COLUMNS))
    for model, network in benchmark_strokes.networks():
        preparation, random = prepare(network), np.random.default_rng(1)
        for number in range(1, count + 1):
            stroke = benchmark_strokes.random(preparation.network, preparation.surface, random)
            preparation = edit(preparation.network, [stroke], preparation=preparation).preparation
            found = find_surface(preparation.network, preparation.surface.points)
            row = {
                "case": model,
                "strokes": number,
                "drift_mean": float(found.distance.mean()),
                "drift_p99": float(np.percentile(found.distance, 99)),
                "gradient": float(np.abs(found.slope - 1).mean()),
                "components_after": components(preparation.proxy),
                "width": preparation.network.widths[0],
            }
            rows.append(row)
            print(_line(model, str(number), [_short(row, column) for column in SEQUENCE_COLUMNS]))
    return rows


def _solver(method: str) -> "Solve":
    from neural_sculpt_addon.field.solvers import gauss_newton, paper

    solvers: dict[str, Callable[..., Any]] = {
        "paper50": partial(paper.solve, epochs=50),
        "paper100": partial(paper.solve, epochs=100),
        "quick": gauss_newton.quick,
        "final": lambda problem, progress: (
            gauss_newton.refine(problem, gauss_newton.quick(problem, progress), progress).network
        ),
    }
    return solvers[method]


def _line(case: str, method: str, cells: Any) -> str:
    return f"{case:<14}{method:<9}" + " ".join(f"{cell[:9]:>9}" for cell in cells)


def _short(row: dict[str, Any], column: str) -> str:
    scale = 1e3 if column.startswith(THOUSANDTHS) else 1.0
    return f"{scale * float(row[column]):.3g}"
