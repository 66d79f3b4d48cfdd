# SPDX-License-Identifier: GPL-3.0-or-later
"""Halve and double each constant of the local solver and measure what changes.

    python3 scripts/sensitivity.py [--only NAME ...] [--strokes N] [--seed N] [--table FILE]

Mixed strokes, drawn by walking over a lumpy ball, a gear and a star (tests/field/packed), which no
benchmark uses; every second of them is carved so deep that many fold. Each value solves the
same strokes, and the constants as they are measure what came. A measure is told as the geometric
mean over the strokes of its ratio to that of the constants as they are. "Other samples" solves the
strokes as they are with other random samples, three times: what is within their range is noise.
"Changed" counts strokes whose layer has other bits at all: a constant that changes few of them
guards a rare case. Seconds are of the processor, of all threads; lengths are in 1e-3 of model
space.
"""

import argparse
import hashlib
import importlib
import math
import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarking import random_strokes
from workshop import ROOT, environment

if TYPE_CHECKING:
    from neural_sculpt_addon.field.levels import Coefficients
    from neural_sculpt_addon.field.problem.prepare import Preparation
    from neural_sculpt_addon.stroke.stroke import Stroke

    Case = tuple[Preparation, Stroke]

SHAPES = ("blob", "gear", "star")
FOLDED, DEEP = 2, 0.25  # every which stroke is carved how deep, model units
REPEATED = 3  # times with other samples

MODULES = {
    "solve.resolution": ("CELLS_PER_FEATURE", "LEAST_FINEST", "DENSITY", "LAYERS"),
    "solve.local": (
        *("FEWEST", "ACTIVE_MARGIN", "GAP", "HIGH", "STRIDE", "REPAIRS", "CHANGED", "HEAVIER"),
        *("MISSED", "TILTED", "SHARE", "FAMILY", "FINER_NODES", "FINER", "COMPANY"),
        *("FINER_ITERATIONS", "CLEARING", "CLEAR", "CERTAIN"),
    ),
    "solve.edit_rows": (
        *(
            "PRESERVE_WEIGHT",
            "AROUND_WEIGHT",
            "SLOPE_WEIGHT",
            "NORMAL_BIAS",
            "NEAR",
            "STEEPEST",
            "TRIES",
        ),
        *("MORE", "BEYOND", "CREASED", "NEAREST_SAMPLES"),
    ),
    "solve.spline_system": ("DAMPING", "LEAST_TOUCHED", "ITERATIONS", "CONVERGED"),
    "projection": ("ARRIVED", "ON_SURFACE"),
    "problem.pose": ("GUIDED",),
    "problem.problem": ("THINNED", "INNER", "MOST_STRETCH"),
    "problem.copies": ("STEP", "BEND"),
    "problem.fold": ("WRONG_SIDE", "CLOSE", "BESIDE", "NEAR_CROSSING", "CLIFF", "ACCURACY_SCALE"),
    "problem.folded": ("FINE_EDGE", "CUT", "SHORTEST", "MOST_VERTICES", "MOST_CUT"),
    "mesh.pieces": ("MATCHED", "LEAST", "CRUMB"),
    "edit.edit": ("REPAIRS",),
}
"""The constants of each module of the field."""

ALSO = {
    "solve.resolution.DENSITY": ("solve.local",),
    "solve.edit_rows.AROUND_WEIGHT": ("solve.local",),
    "solve.spline_system.ITERATIONS": ("solve.local",),
    "projection.ARRIVED": (
        *("problem.copies", "problem.tube", "problem.folded", "solve.edit_rows"),
    ),
    "projection.ON_SURFACE": ("problem.copies", "problem.tube", "solve.edit_rows"),
}
"""Modules that import a constant by its name."""

PARAMETERS = {
    "solve.spline_system.LEAST_TOUCHED": "damped",
    "solve.spline_system.ITERATIONS": "iterations",
    "solve.spline_system.CONVERGED": "settled",
}
"""What is the default of a parameter of `solve_level`."""

NAMES = [f"{module}.{name}" for module, names in MODULES.items() for name in names]

RATIOS = ("seconds", "tube_mean", "tube_p95", "reverse_p95", "normal_deg", "rim_mean")
HEADINGS = (*RATIOS, "worst tube_p95", "met", "pieces changed", "refused", "changed")
LEAST = 1e-9  # of a measure that is part of a ratio


@dataclass
class Outcome:
    """What came of the strokes, by their number; some may have been refused."""

    rows: dict[int, dict[str, Any]]
    refused: int

    def cells(self, usual: "Outcome") -> list[str]:
        """A line of the table."""
        both = [(row, usual.rows[k]) for k, row in self.rows.items() if k in usual.rows]
        pieces = sum(row["components_after"] != row["components_before"] for row, _ in both)
        return [
            *(f"{_mean_ratio(name, both):.2f}" for name in RATIOS),
            f"{1e3 * max(row['tube_p95'] for row in self.rows.values()):.2f}",
            str(sum(row["tolerance_met"] for row in self.rows.values())),
            str(pieces),
            str(self.refused),
            str(sum(row["layer"] != other["layer"] for row, other in both)),
        ]


def main() -> None:
    """Measure, and print the table line by line."""
    parser = argparse.ArgumentParser(description="Measure what the solver's constants change.")
    parser.add_argument(
        "--only", nargs="+", choices=NAMES, metavar="NAME", help="as solve.local.GAP"
    )
    parser.add_argument("--strokes", type=int, default=24, help="default: %(default)s")
    parser.add_argument("--seed", type=int, default=2, help="of the strokes")
    parser.add_argument("--table", type=Path, help="write the table as Markdown")
    options = parser.parse_args()
    environment.enter("worker")
    cases = list(_cases(options.strokes, options.seed))
    _solve(cases[: len(SHAPES)])  # what is drawn of each field once is drawn now
    usual = _solve(cases)
    lines = [f"| constant | value | {' | '.join(HEADINGS)} |", "|---" * (2 + len(HEADINGS)) + "|"]
    print("\n".join(lines), flush=True)
    for name, value, outcome in _outcomes(cases, options.only or NAMES, usual):
        lines.append(f"| {name} | {value} | {' | '.join(outcome.cells(usual))} |")
        print(lines[-1], flush=True)
        if options.table:
            options.table.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _outcomes(
    cases: "list[Case]", names: Sequence[str], usual: Outcome
) -> Iterator[tuple[str, str, Outcome]]:
    """Of the constants as they are, of other samples, of each halved and doubled."""
    yield "as it is", "", usual
    for more in range(1, REPEATED + 1):
        others = [(on, replace(stroke, seed=stroke.seed + more)) for on, stroke in cases]
        yield "other samples", "", _solve(others)
    for name in names:
        value = getattr(_holders(name)[0], name.rpartition(".")[2])
        for other in _others(value):
            yield name, f"{value:g} -> {other:g}", _solve(cases, name, other, usual)


def _others(value: float) -> Iterator[float]:
    """Half of a value and twice, of whole numbers whole ones."""
    for other in (value / 2, value * 2):
        whole = round(other) if isinstance(value, int) else other
        if whole != value:
            yield whole


def _holders(name: str) -> list[Any]:
    """The modules in which a constant stands."""
    module, _, _ = name.rpartition(".")
    modules = (module, *ALSO.get(name, ()))
    return [importlib.import_module(f"neural_sculpt_addon.field.{one}") for one in modules]


@contextmanager
def _set(name: str, value: float) -> Iterator[None]:
    """Another value of a constant, until the block ends."""
    from neural_sculpt_addon.field.solve.spline_system import solve_level

    holders, attribute = _holders(name), name.rpartition(".")[2]
    usual, defaults = getattr(holders[0], attribute), solve_level.__defaults__ or ()
    for module in holders:
        setattr(module, attribute, value)
    if name in PARAMETERS:
        names = solve_level.__code__.co_varnames[: solve_level.__code__.co_argcount]
        given = dict(zip(names[-len(defaults) :], defaults, strict=True))
        solve_level.__defaults__ = tuple({**given, PARAMETERS[name]: value}.values())
    try:
        yield
    finally:
        solve_level.__defaults__ = defaults
        for module in holders:
            setattr(module, attribute, usual)


def _cases(count: int, seed: int) -> "Iterator[Case]":
    """Strokes, each on an unedited field."""
    import numpy as np

    from neural_sculpt_addon.field.checkpoint import load
    from neural_sculpt_addon.field.problem.prepare import prepare

    folder = ROOT / "tests" / "field" / "packed"
    ready = [prepare(load(folder / f"{shape}.pth")) for shape in SHAPES]
    for number in range(count):
        on = ready[number % len(ready)]
        random = np.random.default_rng([seed, number])
        stroke = random_strokes.mixed(on.field, on.surface, random)
        if number % FOLDED == FOLDED - 1:
            brush = replace(stroke.brush, intensity=-DEEP)
            stroke = replace(stroke, brush=brush)
        yield on, stroke


def _solve(
    cases: "list[Case]", name: str = "", value: float = 0.0, usual: Outcome | None = None
) -> Outcome:
    """Solve the strokes, with another value of a constant, and measure them with its usual one.

    usual: what comes of that, so that a layer with the same bits is not measured again
    """
    from neural_sculpt_addon.common.errors import SculptError
    from neural_sculpt_addon.field.edit.edit import sculpt

    rows, refused = dict[int, dict[str, Any]](), 0
    for number, (on, stroke) in enumerate(cases):
        started = time.process_time()
        try:
            with _set(name, value) if name else nullcontext():
                edit = sculpt(on, stroke)
        except SculptError:
            refused += 1
            continue
        seconds, layer = time.process_time() - started, _digest(edit.layer or {})
        known = usual.rows.get(number) if usual else None
        row = known if known and known["layer"] == layer else edit.report()
        rows[number] = {**row, "seconds": seconds, "layer": layer}
    return Outcome(rows, refused)


def _digest(layer: "Coefficients") -> str:
    """What tells layers with other bits apart."""
    total = hashlib.sha256()
    for number, level in sorted(layer.items()):
        total.update(bytes([number]) + level.index.tobytes() + level.values.tobytes())
    return total.hexdigest()


def _mean_ratio(name: str, both: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> float:
    """The geometric mean of a measure's ratio to the usual one."""
    return math.exp(
        statistics.fmean(
            math.log(max(row[name], LEAST) / max(usual[name], LEAST)) for row, usual in both
        )
    )


if __name__ == "__main__":
    main()
