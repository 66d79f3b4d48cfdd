# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit benchmark: meshes become fields, in our way and in the paper's, in one run.

Lengths are in model space, where the longest side is 1.7 and half the box is 1; seconds are those
of the wall, and of the processor, for all from cleaning the mesh to the quality report. The ratios
are the paper's figure by ours in the same preset; the JSON has our rows alone. `--damaged` fits one
mesh after doing to it what bad files do: `true_mean` is then the distance of the unharmed mesh from
the field, where the damage leaves a shape that should be found again, and `peak_mb` the memory that
the process has had so far. `--awkward` fits what `awkward_meshes` generates, and compares what came
with what is expected: nothing may be wrong without a sentence.
"""

import argparse
import json
import resource
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workshop import ROOT

if TYPE_CHECKING:
    from neural_sculpt_addon.field.fit.fit import Fit

    from .awkward_meshes import Awkward
    from .damaged_meshes import Mesh

MESHES = ROOT.parent / "shared" / "data" / "meshes"
MEASURES = ("error_mean", "error_p95", "error_max", "normal_deg", "sign_errors", "components")
COMPARED = ("cavities", "mesh_components", "mesh_cavities", "lost", "beyond", "thin", "thin_off")
RATIOS = ("seconds_ratio", "error_ratio")
DAMAGED = "stanford-bunny.obj"
OURS, THEIRS = "distance", "paper"  # methods


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py fit`."""
    parser.add_argument("meshes", nargs="*", type=Path, help=f"default: all of {MESHES}")
    parser.add_argument("--preset", choices=("draft", "normal", "fine"), default="normal")
    parser.add_argument("--json", type=Path, help="write one object per row")
    parser.add_argument("--no-paper", action="store_true", help="our way alone, without ratios")
    parser.add_argument("--damaged", action="store_true", help="what is wrong with bad files")
    parser.add_argument(
        "--awkward", action="store_true", help="generated meshes; names choose some"
    )


def run(options: argparse.Namespace) -> None:
    """Print the table, and write the rows where `--json` says."""
    if options.awkward:
        _run_awkward([str(name) for name in options.meshes], options.preset, options.json)
        return
    if options.damaged:
        paths = options.meshes or [MESHES / DAMAGED]
        columns = ("seconds", *MEASURES, "true_mean", "peak_mb")
        found = _damaged_rows(_existing(paths), options.preset)
    else:
        columns = ("seconds", "cpu_seconds", *MEASURES, *(() if options.no_paper else RATIOS))
        paths = options.meshes or sorted(MESHES.glob("*.obj")) or [MESHES]
        found = _rows(_existing(paths), options.preset, not options.no_paper)
    print("lengths in 1e-3 of model space\n" + _line("mesh", "method", columns))
    rows = []
    for row in found:
        if row["method"] == OURS:
            rows.append(row)
        cells = [_short(row, column) for column in columns] if "message" not in row else []
        print(_line(row["mesh"], row["method"], cells) + row.get("message", ""), flush=True)
    _write(rows, options.json)


def _write(rows: list[dict[str, Any]], path: Path | None) -> None:
    if path:
        path.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def _run_awkward(chosen: list[str], preset: str, path: Path | None) -> None:
    """Print what is expected and what came, and how many are wrong without a sentence."""
    from .awkward_meshes import AWKWARD

    rows = []
    for name, mesh in AWKWARD.items():
        if not chosen or name in chosen:
            row = _awkward_row(name, mesh, preset)
            rows.append(row)
            print(f"{row['outcome']:<7}{name:<20}{mesh.expected:<38}{row['came']}", flush=True)
    wrong = sum(row["outcome"] == "WRONG" for row in rows)
    print(f"{len(rows)} meshes, {wrong} wrong")
    _write(rows, path)


def _awkward_row(name: str, mesh: "Awkward", preset: str) -> dict[str, Any]:
    """What came of one mesh: as expected, said, or wrong."""
    from neural_sculpt_addon.common.errors import SculptError
    from neural_sculpt_addon.field.fit.fit import fit_mesh

    row: dict[str, Any] = {"mesh": name, "preset": preset, "expected": mesh.expected}
    try:
        report = fit_mesh(*mesh.make(), preset=preset, **mesh.options).report
    except SculptError as error:
        right = bool(mesh.refused) and mesh.refused in str(error)
        return {**row, "outcome": "refused" if right else "WRONG", "came": str(error)}
    notes = report.get("notes", [])
    wrong = [text for text in mesh.says if not any(text in note for note in notes)]
    if mesh.refused:
        wrong.append("it was not refused")
    if mesh.pieces is not None:
        wrong += [note for note in notes if "where the mesh has none" in note]
    for key, wanted in (("cavities", mesh.cavities), ("components", _sum(mesh))):
        if wanted is not None and report[key] != wanted:
            wrong.append(f"{report[key]} {key}, not {wanted}")
    if not notes:
        wrong += [key for key, most in mesh.silent().items() if report[key] > most]
        if report["components"] != report["mesh_components"]:
            wrong.append("pieces without a word")
    came = (
        f"{report['components'] - report['cavities']} pieces, {report['cavities']} cavities, mean"
        f" error {1e3 * report['error_mean']:.2f}e-3. {' '.join(notes)}"
    )
    measures = {key: report[key] for key in (*MEASURES, *COMPARED)}
    outcome = "WRONG" if wrong else "told" if notes else "right"
    return {**row, "outcome": outcome, "came": "; ".join([*wrong, came]), **measures}


def _sum(mesh: "Awkward") -> int | None:
    return None if mesh.pieces is None or mesh.cavities is None else mesh.pieces + mesh.cavities


def _existing(paths: list[Path]) -> list[Path]:
    for path in paths:
        if not path.is_file():
            sys.exit(f"There is no mesh {path}; name files of your own.")
    return paths


def _rows(paths: list[Path], preset: str, paper: bool) -> Iterator[dict[str, Any]]:
    """Every mesh in the paper's way, if wanted, and in ours."""
    from neural_sculpt_addon.field.mesh.mesh_file import read

    for path in paths:
        mesh = read(path)
        theirs = _fit(path.stem, THEIRS, mesh, preset)[0] if paper else None
        ours = _fit(path.stem, OURS, mesh, preset)[0]
        if theirs:
            yield theirs
            ours["seconds_ratio"] = theirs["seconds"] / ours["seconds"]
            ours["error_ratio"] = theirs["error_mean"] / ours["error_mean"]
        yield ours


def _damaged_rows(paths: list[Path], preset: str) -> Iterator[dict[str, Any]]:
    """What becomes of a mesh after each damage, and of what is no solid at all."""
    import numpy as np

    from neural_sculpt_addon.common.errors import SculptError
    from neural_sculpt_addon.field.fit.mesh_cleanup import clean
    from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
    from neural_sculpt_addon.field.mesh.mesh_file import read
    from neural_sculpt_addon.field.projection import project

    from .damaged_meshes import DAMAGES, HOPELESS, IN_PLACE, sheet

    yield _fit("sheet, thick", OURS, sheet(), preset, thickness=0.1)[0]
    for name, mesh in HOPELESS.items():
        try:
            yield _fit(name, OURS, mesh, preset)[0]
        except SculptError as error:
            yield {"mesh": name, "method": OURS, "preset": preset, "message": str(error)}
    for path in paths:
        vertices, faces = read(path)
        good = clean(vertices, faces)
        points = MeshDistance(good, np.random.default_rng(0)).surface(
            8192, np.random.default_rng(1)
        )
        points = good.scale * points.points + good.center
        for name, damage in DAMAGES.items():
            mesh = damage(vertices, faces, np.random.default_rng(0))
            row, fit = _fit(name, OURS, mesh, preset)
            if name in IN_PLACE:
                start = (points - fit.center) / fit.scale
                gap = np.linalg.norm(project(fit.field, start).points - start, axis=1)
                row["true_mean"] = float(gap.mean())
            yield {**row, "source": path.stem}


def _fit(
    name: str, method: str, mesh: "Mesh", preset: str, thickness: float | None = None
) -> "tuple[dict[str, Any], Fit]":
    from neural_sculpt_addon.field.fit.fit import fit_mesh

    start, spent = time.perf_counter(), time.process_time()
    fit = fit_mesh(*mesh, method=method, preset=preset, thickness=thickness)
    seconds, spent = time.perf_counter() - start, time.process_time() - spent
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # kB on Linux
    row = {"mesh": name, "method": method, "preset": preset, "faces": len(mesh[1])}
    measures = {column: fit.report[column] for column in MEASURES}
    return {**row, "seconds": seconds, "cpu_seconds": spent, **measures, "peak_mb": peak}, fit


def _line(mesh: str, method: str, cells: Any) -> str:
    return f"{mesh:<16}{method:<9}" + " ".join(f"{cell[:13]:>13}" for cell in cells)


def _short(row: dict[str, Any], column: str) -> str:
    if column not in row:
        return "-"
    scale = 1e3 if column.startswith(("error_m", "error_p", "true")) else 1.0
    return f"{scale * row[column]:.3g}"
