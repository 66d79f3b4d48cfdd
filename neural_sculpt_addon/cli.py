# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: fit, apply, mesh, sample, consolidate and info, without Blender.

    python -m neural_sculpt_addon apply FIELD STROKES.json -o OUT.safetensors --mesh OUT.ply

Fields are `.safetensors` (ours) or `.pth` (the authors') files; strokes are JSON in model space.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .common.errors import Cancelled, SculptError

if TYPE_CHECKING:
    from .field.field import Field


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; 0 when it succeeded, 1 with one line on stderr when it did not."""
    options = _parser().parse_args(arguments)
    options.written = []
    try:
        options.run(options)
    except SculptError as error:
        return _end(options, str(error), 1)
    except MemoryError:
        return _end(options, "out of memory; try a lower resolution.", 1)
    except (Cancelled, KeyboardInterrupt):
        nothing = "" if options.written else " Nothing was written."
        return _end(options, f"cancelled.{nothing}", 130)
    return 0


def _end(options: argparse.Namespace, why: str, code: int) -> int:
    """Say on stderr why a command ended early, and what is there of its result; its exit code."""
    there = "".join(f" {path} is written." for path in options.written)
    sys.stderr.write(f"\rneural_sculpt_addon: {why}{there}\n")
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m neural_sculpt_addon", description="Sculpt neural fields with strokes."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    fit = commands.add_parser("fit", help="fit a field to a mesh")
    fit.add_argument("mesh", type=Path, help="triangle mesh: obj, ply, stl, glb, off")
    fit.add_argument("-o", "--output", type=Path, required=True, help=".safetensors or .pth")
    fit.add_argument("--method", choices=("distance", "paper"), default="distance")
    fit.add_argument("--preset", choices=("draft", "normal", "fine"), default="normal")
    fit.add_argument("--width", type=int, choices=(64, 128, 256), default=128)
    fit.add_argument(
        "--detail",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="or a network alone, 70 kB",
    )
    fit.add_argument(
        "--open",
        choices=("solid", "thickness"),
        help="open parts: openings closed by a film, or a shell (default: solid)",
    )
    fit.add_argument(
        "--thickness",
        type=float,
        help="of open parts, in units of the mesh; default: 2 %% of the longest side",
    )
    fit.add_argument("--seed", type=int, default=0)
    fit.add_argument("--report", type=Path, help="write the quality report as JSON")
    fit.set_defaults(run=_fit)

    apply = commands.add_parser("apply", help="apply strokes to a field")
    apply.add_argument("field", type=Path)
    apply.add_argument("strokes", type=Path, help="stroke file (JSON)")
    apply.add_argument("-o", "--output", type=Path, required=True, help=".safetensors or .pth")
    apply.add_argument("--mesh", type=Path, help="also write the proxy")
    apply.add_argument("--resolution", type=int, default=128, help="cells per axis of the proxy")
    apply.add_argument("--solver", default="local", help="or network, or paper")
    apply.add_argument("--epochs", type=int, help="of the paper's solver")
    apply.add_argument("--report", type=Path, help="write the measures of each stroke as JSON")
    apply.add_argument("--chamfer", action="store_true", help="report the Chamfer distance, too")
    apply.set_defaults(run=_apply)

    mesh = commands.add_parser("mesh", help="extract the surface of a field")
    mesh.add_argument("field", type=Path)
    mesh.add_argument("-o", "--output", type=Path, required=True, help="ply, obj, stl, glb or off")
    mesh.add_argument("--resolution", type=int, default=128, help="cells per axis")
    mesh.add_argument("--triangles", type=int, default=0, help="refine, to so many at most")
    mesh.set_defaults(run=_mesh)

    sample = commands.add_parser("sample", help="evaluate a field at points")
    sample.add_argument("field", type=Path)
    sample.add_argument("points", type=Path, help="NumPy array (N, 3) in model space (.npy)")
    sample.add_argument("-o", "--output", type=Path, required=True, help=".npz: f and gradient")
    sample.set_defaults(run=_sample)

    consolidate = commands.add_parser("consolidate", help="fit a plain network to a field")
    consolidate.add_argument("field", type=Path)
    consolidate.add_argument("--width", type=int, default=128, help="units of each of two layers")
    consolidate.add_argument("-o", "--output", type=Path, required=True, help="a field file")
    consolidate.add_argument("--seed", type=int, default=0)
    consolidate.add_argument("--report", type=Path, help="write what was lost as JSON")
    consolidate.set_defaults(run=_consolidate)

    info = commands.add_parser("info", help="describe a field as JSON")
    info.add_argument("field", type=Path)
    info.set_defaults(run=_info)
    return parser


def _fit(options: argparse.Namespace) -> None:
    from .field import checkpoint
    from .field.fit import fit
    from .field.mesh import mesh_file

    _check_output(options.output, checkpoint.SUFFIXES)
    _check_output(options.report)
    if options.detail and options.method == "distance":
        _check_detail(options.output, "--no-detail")
    if options.open == "solid" and options.thickness is not None:
        raise SculptError("--thickness goes with --open thickness: a film has none. Leave one out.")
    vertices, triangles = mesh_file.read(options.mesh)
    result = fit.fit_mesh(
        vertices,
        triangles,
        method=options.method,
        preset=options.preset,
        detail=options.detail,
        width=options.width,
        open_parts=options.open,
        thickness=options.thickness,
        seed=options.seed,
        progress=_show,
    )
    _save(result.field, options)
    _print_notes(result.report)
    report = {"scale": result.scale, "center": list(result.center), **result.report}
    _finish({"network": str(options.output), **report}, options.report, report)


def _apply(options: argparse.Namespace) -> None:
    from .field import checkpoint
    from .field.edit import edit
    from .field.mesh import mesh_file, proxy
    from .stroke.file import parse_strokes

    _check_output(options.output, checkpoint.SUFFIXES)
    _check_output(options.mesh, mesh_file.SUFFIXES)
    _check_output(options.report)
    proxy.check_cells(options.resolution)
    field = checkpoint.load(options.field)
    strokes = parse_strokes(_read_text(options.strokes))
    if strokes and options.solver == edit.Solver.LOCAL:
        _check_detail(options.output, "--solver network")
    field, reports = edit.edit(
        field,
        strokes,
        solver=options.solver,
        epochs=options.epochs,
        chamfer=options.chamfer,
        progress=_show,
    )
    _save(field, options)
    if options.mesh:
        mesh_file.write(options.mesh, proxy.extract(field, options.resolution))
        options.written.append(options.mesh)
    for stroke in reports:
        _print_notes(stroke)
    report = {"network": str(options.field), "strokes": list(reports)}
    _finish({"network": str(options.output), "strokes": len(strokes)}, options.report, report)


def _mesh(options: argparse.Namespace) -> None:
    from .field import checkpoint
    from .field.mesh import mesh_file, proxy
    from .field.mesh.refinement import refine

    _check_output(options.output, mesh_file.SUFFIXES)
    field = checkpoint.load(options.field)
    surface = proxy.extract(field, options.resolution, _show)
    if options.triangles:
        surface = refine.refine(field, surface, options.triangles, progress=_show)
    mesh_file.write(options.output, surface)
    triangles = len(surface.triangles)
    _finish({"mesh": str(options.output), "triangles": triangles}, None, None)


def _sample(options: argparse.Namespace) -> None:
    from .field import checkpoint, points_file

    _check_output(options.output, (".npz",))
    field = checkpoint.load(options.field)
    sampled = field.sample(points_file.read(options.points))
    points_file.write(options.output, sampled)
    _finish({"samples": str(options.output), "points": len(sampled.f)}, None, None)


def _consolidate(options: argparse.Namespace) -> None:
    from .field import checkpoint
    from .field.fit import consolidate

    _check_output(options.output, checkpoint.SUFFIXES)
    _check_output(options.report)
    field = checkpoint.load(options.field)
    result = consolidate.consolidate(field, options.width, seed=options.seed, progress=_show)
    _save(result.field, options)
    _finish({"network": str(options.output), **result.report}, options.report, result.report)


def _info(options: argparse.Namespace) -> None:
    from .field import checkpoint, detail
    from .field.mesh import pieces, proxy

    field = checkpoint.load(options.field)
    surface = proxy.extract(field)
    levels = [
        {"level": level, "spacing": detail.spacing(level), "coefficients": len(part.index)}
        for level, part in field.detail.coefficients.items()
    ]
    parameters = sum(tensor.numel() for tensor in field.network.parameters)
    description = {
        "widths": list(field.network.widths),
        "parameters": parameters,
        "omegas": list(field.network.omegas),
        "levels": levels,
        "coefficients": sum(level["coefficients"] for level in levels),
        "bytes": {
            "network": 4 * parameters,
            "detail": len(checkpoint.layer_to_bytes(field.detail.coefficients)) if levels else 0,
            "detail_in_memory": sum(4 * grid.bricks.numel() for grid in field.detail.grids),
        },
        "components": pieces.components(surface),
        "low": surface.vertices.min(axis=0).tolist(),
        "high": surface.vertices.max(axis=0).tolist(),
    }
    _finish(description, None, None)


def _check_output(path: Path | None, suffixes: Sequence[str] = ()) -> None:
    """Refuse a name that could not be written before minutes are spent on what goes into it."""
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise SculptError("{}: choose a name that ends in {}.", path.name, ", ".join(suffixes))
    if not path.parent.is_dir():
        raise SculptError("There is no folder {}; make it or choose another.", path.parent)


def _save(field: "Field", options: argparse.Namespace) -> None:
    """Write the field that a command makes; what comes after it may fail."""
    from .field import checkpoint

    checkpoint.save(field, options.output)
    options.written.append(options.output)


def _check_detail(path: Path, without: str) -> None:
    """Refuse a file that cannot hold the detail which is to come; what comes `without` it."""
    if path.suffix.lower() == ".pth":
        raise SculptError(
            "{}: the .pth format has no place for detail. Save as .safetensors, or add {}.",
            path.name,
            without,
        )


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise SculptError("{} cannot be read: {}.", path, error.strerror) from error
    except UnicodeDecodeError as error:
        raise SculptError("{} is no UTF-8 text file.", path.name) from error


def _show(fraction: float, message: str) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{fraction:4.0%} {message:<60.60}")
        sys.stderr.flush()


def _print_notes(report: Mapping[str, Any]) -> None:
    """What a report says in sentences."""
    for note in report.get("notes", ()):
        sys.stderr.write(f"\rneural_sculpt_addon: {note}\n")


def _finish(summary: dict[str, Any], report_path: Path | None, report: object) -> None:
    """Print the summary as one line of JSON, write the report where one is wanted."""
    if report_path:
        from .common.whole_file import write_whole

        write_whole(report_path, json.dumps(report, indent=1, allow_nan=False).encode())
    if sys.stderr.isatty():
        sys.stderr.write("\r" + " " * 66 + "\r")
    sys.stdout.write(json.dumps(summary) + "\n")
