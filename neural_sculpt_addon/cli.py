# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: fit, apply, mesh and info, without Blender.

    python -m neural_sculpt_addon apply NETWORK STROKES.json -o OUT.safetensors --mesh OUT.ply

Networks are `.safetensors` (ours) or `.pth` (the authors') files; strokes are JSON in model space.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .stroke.errors import Cancelled, SculptError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; 0 when it succeeded, 1 with one line on stderr when it did not."""
    options = _parser().parse_args(arguments)
    try:
        options.run(options)
    except SculptError as error:
        sys.stderr.write(f"\rneural_sculpt_addon: {error}\n")
        return 1
    except (Cancelled, KeyboardInterrupt):
        sys.stderr.write("\rneural_sculpt_addon: cancelled; nothing was written.\n")
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m neural_sculpt_addon", description="Sculpt neural fields with strokes."
    )
    commands = parser.add_subparsers(required=True, metavar="{fit,apply,mesh,info}")

    fit = commands.add_parser("fit", help="fit a field to a mesh")
    fit.add_argument("mesh", type=Path, help="triangle mesh: obj, ply, stl, glb, off")
    fit.add_argument("-o", "--output", type=Path, required=True, help=".safetensors or .pth")
    fit.add_argument("--method", choices=("distance", "paper"), default="distance")
    fit.add_argument("--preset", choices=("draft", "normal", "fine"), default="normal")
    fit.add_argument("--width", type=int, choices=(64, 128, 256), help="units of each layer")
    fit.add_argument("--thickness", type=float, help="of open pieces, in units of the mesh")
    fit.add_argument("--seed", type=int, default=0)
    fit.add_argument("--report", type=Path, help="write the quality report as JSON")
    fit.set_defaults(run=_fit)

    apply = commands.add_parser("apply", help="apply strokes to a field")
    apply.add_argument("network", type=Path)
    apply.add_argument("strokes", type=Path, help="stroke file (JSON)")
    apply.add_argument("-o", "--output", type=Path, required=True, help=".safetensors or .pth")
    apply.add_argument("--mesh", type=Path, help="also write the proxy")
    apply.add_argument("--resolution", type=int, default=128, help="cells per axis of the proxy")
    apply.add_argument("--solver", default="gauss_newton", help="or quick, or paper")
    apply.add_argument("--epochs", type=int, help="of the paper's solver")
    apply.add_argument("--report", type=Path, help="write the measures of each stroke as JSON")
    apply.add_argument("--chamfer", action="store_true", help="report the Chamfer distance, too")
    apply.set_defaults(run=_apply)

    mesh = commands.add_parser("mesh", help="extract the surface of a field")
    mesh.add_argument("network", type=Path)
    mesh.add_argument("-o", "--output", type=Path, required=True, help="ply, obj, stl, glb or off")
    mesh.add_argument("--resolution", type=int, default=128, help="cells per axis")
    mesh.set_defaults(run=_mesh)

    info = commands.add_parser("info", help="describe a field as JSON")
    info.add_argument("network", type=Path)
    info.set_defaults(run=_info)
    return parser


def _fit(options: argparse.Namespace) -> None:
    from .field import checkpoint, fit, mesh_file

    _check_output(options.output, checkpoint.SUFFIXES)
    _check_output(options.report)
    vertices, triangles = mesh_file.read(options.mesh)
    result = fit.fit_mesh(
        vertices,
        triangles,
        method=options.method,
        preset=options.preset,
        width=options.width,
        thickness=options.thickness,
        seed=options.seed,
        progress=_show,
    )
    checkpoint.save(result.network, options.output)
    report = {"scale": result.scale, "center": list(result.center), **result.report}
    _finish({"network": str(options.output), **report}, options.report, report)


def _apply(options: argparse.Namespace) -> None:
    from .field import checkpoint, edit, mesh_file, proxy
    from .stroke.file import parse_strokes

    _check_output(options.output, checkpoint.SUFFIXES)
    _check_output(options.mesh, mesh_file.SUFFIXES)
    _check_output(options.report)
    proxy.check_cells(options.resolution)
    network = checkpoint.load(options.network)
    strokes = parse_strokes(_read_text(options.strokes))
    result = edit.edit(
        network,
        strokes,
        solver=options.solver,
        epochs=options.epochs,
        chamfer=options.chamfer,
        progress=_show,
    )
    checkpoint.save(result.network, options.output)
    if options.mesh:
        mesh_file.write(options.mesh, proxy.extract(result.network, options.resolution))
    report = {"network": str(options.network), "strokes": list(result.reports)}
    _finish({"network": str(options.output), "strokes": len(strokes)}, options.report, report)


def _mesh(options: argparse.Namespace) -> None:
    from .field import checkpoint, mesh_file, proxy

    _check_output(options.output, mesh_file.SUFFIXES)
    network = checkpoint.load(options.network)
    surface = proxy.extract(network, options.resolution, _show)
    mesh_file.write(options.output, surface)
    triangles = len(surface.triangles)
    _finish({"mesh": str(options.output), "triangles": triangles}, None, None)


def _info(options: argparse.Namespace) -> None:
    from .field import checkpoint, pieces, proxy

    network = checkpoint.load(options.network)
    surface = proxy.extract(network)
    description = {
        "widths": list(network.widths),
        "parameters": sum(tensor.numel() for tensor in network.parameters),
        "omegas": list(network.omegas),
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
        raise SculptError(f"{path.name}: choose a name that ends in {', '.join(suffixes)}.")
    if not path.parent.is_dir():
        raise SculptError(f"There is no folder {path.parent}; make it or choose another.")


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise SculptError(f"{path} cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise SculptError(f"{path.name} is no UTF-8 text file.") from error


def _show(fraction: float, message: str) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{fraction:4.0%} {message:<60.60}")
        sys.stderr.flush()


def _finish(summary: dict[str, Any], report_path: Path | None, report: object) -> None:
    """Print the summary as one line of JSON, write the report where one is wanted."""
    if report_path:
        from .field.whole_file import write_whole

        write_whole(report_path, json.dumps(report, indent=1, allow_nan=False).encode())
    if sys.stderr.isatty():
        sys.stderr.write("\r" + " " * 66 + "\r")
    sys.stdout.write(json.dumps(summary) + "\n")
