# SPDX-License-Identifier: GPL-3.0-or-later
"""Halve and double each constant of the local solver and measure what changes.

    python3 scripts/sensitivity.py [--only NAME ...] [--strokes N] [--seed N] [--table FILE]

Mixed strokes, drawn by walking over a lumpy ball, a gear and a star (tests/field/packed), which no
benchmark uses. Each value solves the same strokes. "Other samples" solves them as they are with
other random samples: what is not farther from 1 than that is noise. Seconds are of the processor,
of all threads; lengths are in 1e-3 of model space.
"""

import argparse
import importlib
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import benchmark_strokes
import environment

if TYPE_CHECKING:
    from neural_sculpt_addon.field.problem.prepare import Preparation
    from neural_sculpt_addon.stroke.stroke import Stroke

    Case = tuple[Preparation, Stroke]

SHAPES = ("blob", "gear", "star")
LOCAL, ROWS = (
    "neural_sculpt_addon.field.solve.local",
    "neural_sculpt_addon.field.solve.edit_rows",
)
SYSTEM, PROBLEM = (
    "neural_sculpt_addon.field.solve.spline_system",
    "neural_sculpt_addon.field.problem.problem",
)
FOLD = "neural_sculpt_addon.field.problem.fold"
CONSTANTS: dict[str, tuple[str, ...]] = {
    "CELLS_PER_FEATURE": (LOCAL,),
    "DENSITY": (LOCAL,),
    "LAYERS": (LOCAL,),
    "FEWEST": (LOCAL,),
    "MARGIN": (LOCAL,),
    "GAP": (LOCAL,),
    "HIGH": (LOCAL,),
    "STRIDE": (LOCAL,),
    "HEAVIER": (LOCAL,),
    "MISSED": (LOCAL,),
    "TILTED": (LOCAL,),
    "SHARE": (LOCAL,),
    "FAMILY": (LOCAL,),
    "FINER": (LOCAL,),
    "PRESERVE": (ROWS,),
    "AROUND": (ROWS, LOCAL),
    "STEEP": (ROWS,),
    "UPRIGHT": (ROWS,),
    "TRIES": (ROWS,),
    "MORE": (ROWS,),
    "BURIED": ("neural_sculpt_addon.field.problem.folded",),
    "DAMPING": (SYSTEM,),
    "LEAST_TOUCHED": (SYSTEM,),
    "ITERATIONS": (SYSTEM,),
    "SETTLED": (SYSTEM,),
    "GUIDED": (PROBLEM,),
    "FINE_EDGE": ("neural_sculpt_addon.field.problem.folded",),
    "WRONG_SIDE": (FOLD,),
    "BESIDE": (FOLD,),
    "NEAR": (FOLD,),
}
"""Names, and the modules that hold them."""

RATIOS = ("seconds", "tube_mean", "tube_p95", "reverse_p95", "normal_deg", "rim_mean")
"""Medians over the strokes, as ratios to those of the constants as they are."""

HEADINGS = (*RATIOS, "worst tube_p95", "met", "pieces changed", "refused")


@dataclass
class Outcome:
    """What came of the strokes, some of which may have been refused."""

    rows: list[dict[str, Any]]
    refused: int

    def median(self, name: str) -> float:
        """Of a measure over the strokes."""
        return statistics.median(row[name] for row in self.rows)

    def cells(self, usual: "Outcome") -> list[str]:
        """A line of the table."""
        changed = sum(row["components_after"] != row["components_before"] for row in self.rows)
        return [
            *(f"{self.median(name) / usual.median(name):.2f}" for name in RATIOS),
            f"{1e3 * max(row['tube_p95'] for row in self.rows):.2f}",
            str(sum(row["tolerance_met"] for row in self.rows)),
            str(changed),
            str(self.refused),
        ]


def main() -> None:
    """Measure, and print the table line by line."""
    parser = argparse.ArgumentParser(description="Measure what the solver's constants change.")
    parser.add_argument("--only", nargs="+", choices=CONSTANTS, metavar="NAME")
    parser.add_argument("--strokes", type=int, default=24, help="default: %(default)s")
    parser.add_argument("--seed", type=int, default=1, help="of the strokes")
    parser.add_argument("--table", type=Path, help="write the table as Markdown")
    options = parser.parse_args()
    environment.enter("worker")
    cases = list(_cases(options.strokes, options.seed))
    _solve(cases[: len(SHAPES)])  # what is drawn of each field once is drawn now
    usual = _solve(cases)
    lines = ["| constant | value | " + " | ".join(HEADINGS) + " |", "|---" * 12 + "|"]
    print("\n".join(lines), flush=True)
    for name, value, outcome in _outcomes(cases, options.only or CONSTANTS, usual):
        lines.append(f"| {name} | {value} | " + " | ".join(outcome.cells(usual)) + " |")
        print(lines[-1], flush=True)
    if options.table:
        options.table.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _outcomes(
    cases: "list[Case]", names: Any, usual: Outcome
) -> Iterator[tuple[str, str, Outcome]]:
    """Of the constants as they are, of other samples, of each halved and doubled."""
    yield "as it is", "", usual
    yield "other samples", "", _solve([(on, replace(it, seed=it.seed + 1)) for on, it in cases])
    for name in names:
        value = getattr(importlib.import_module(CONSTANTS[name][0]), name)
        others = (value / 2, value * 2)
        for other in map(round, others) if isinstance(value, int) else others:
            if other != value:
                with _set(name, other):
                    yield name, f"{value:g} -> {other:g}", _solve(cases)


@contextmanager
def _set(name: str, value: float) -> Iterator[None]:
    """Another value of a constant, until the block ends."""
    modules = [importlib.import_module(module) for module in CONSTANTS[name]]
    usual = getattr(modules[0], name)
    for module in modules:
        setattr(module, name, value)
    try:
        yield
    finally:
        for module in modules:
            setattr(module, name, usual)


def _cases(count: int, seed: int) -> "Iterator[Case]":
    """Strokes, each on an unedited field."""
    import numpy as np

    from neural_sculpt_addon.field.checkpoint import load
    from neural_sculpt_addon.field.problem.prepare import prepare

    folder = environment.ROOT / "tests" / "field" / "packed"
    ready = [prepare(load(folder / f"{shape}.pth")) for shape in SHAPES]
    for number in range(count):
        on = ready[number % len(ready)]
        random = np.random.default_rng([seed, number])
        yield on, benchmark_strokes.mixed(on.field, on.surface, random)


def _solve(cases: "list[Case]") -> Outcome:
    from neural_sculpt_addon.common.errors import SculptError
    from neural_sculpt_addon.field.edit.edit import sculpt

    rows, refused = [], 0
    for on, stroke in cases:
        started = time.process_time()
        try:
            edit = sculpt(on, stroke)
        except SculptError:
            refused += 1
            continue
        rows.append({"seconds": time.process_time() - started, **edit.report()})
    return Outcome(rows, refused)


if __name__ == "__main__":
    main()
