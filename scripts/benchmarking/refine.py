# SPDX-License-Identifier: GPL-3.0-or-later
"""The refined proxy against uniform ones, on a shape with 1, 20 and 100 strokes, in one run.

The strokes have radii of 0.02 to 0.1, are short arcs, and lie at random. Errors are distances of
points, drawn evenly from the surface, from the mesh, in model space; slivers the share of triangles
below 5 degrees; turned the triangles that look the other way than the field at their middles.
scratch is the time of the refinement without that of the uniform proxy; stroke that of its update
after the last stroke; with a tolerance that is wider than usual all is made anew, and it is left
out. share is that of the triangles that a uniform proxy of the same p99 would have, interpolated
between those of 128, 256, 384 and 512 cells by powers; none beyond these. Each time is the
processor's, of all threads together, the least of three: so other work beside it changes little.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.field.field import Field
    from neural_sculpt_addon.field.levels import Coefficients
    from neural_sculpt_addon.field.mesh.proxy import Proxy
    from neural_sculpt_addon.field.mesh.refinement.refine import Refined
    from neural_sculpt_addon.field.problem.prepare import Preparation

UNIFORM = (128, 256, 384, 512)
TOLERANCES = (1 / 32, 1 / 64, 1 / 128)  # cells
RADII = (0.02, 0.03, 0.05, 0.1)
HALF = 0.15  # model units from the middle of a stroke to its ends
SAMPLES = 40_000
SLIVER = 5  # degrees
COLUMNS = ("triangles", "mean", "p99", "largest", "slivers", "turned", "open", "scratch", "stroke")


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py refine`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    parser.add_argument("--strokes", default="1,20,100", help="how many, comma-separated")
    parser.add_argument("--shape", default="sphere", help="a ready-made one (default: %(default)s)")


def run(options: argparse.Namespace) -> None:
    """Print the table, and write the rows where `--json` says."""
    print(f"{'strokes':>7} {'mesh':<14}" + "".join(f"{name:>11}" for name in (*COLUMNS, "share")))
    rows = []
    wanted = [int(count) for count in options.strokes.split(",")]
    for count, states in _sculpted(options.shape, max(wanted)):
        if count in wanted:
            for row in _rows(*states):
                rows.append({"shape": options.shape, "strokes": count, **row})
                figures = (row.get(name) for name in (*COLUMNS, "share"))
                texts = ["" if each is None else f"{each:.4g}" for each in figures]
                print(f"{count:>7} {row['mesh']:<14}" + "".join(f"{t:>11}" for t in texts))
    if options.json:
        options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def _sculpted(
    shape: str, count: int
) -> "Iterator[tuple[int, tuple[Preparation, Preparation, Coefficients]]]":
    """After each of so many strokes: what was before, what is now, and the stroke's layer."""
    import numpy as np

    from neural_sculpt_addon.common.errors import SculptError
    from neural_sculpt_addon.field.edit.edit import sculpt
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.field.problem.prepare import prepare
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.stroke import Stroke

    random, now = np.random.default_rng(3), prepare(primitive(shape))
    surface = now.surface
    number = 0
    while number < count:
        place = random.integers(len(surface.points))
        along = np.cross(surface.normals[place], random.normal(size=3))
        along /= np.linalg.norm(along)
        points = surface.points[place] + np.linspace(-HALF, HALF, 9)[:, None] * along
        radius = RADII[number % len(RADII)]
        number += 1
        stroke, before = Stroke(points, Brush(radius, (-1) ** (number - 1) * radius / 2)), now
        try:
            edit = sculpt(before, stroke)
        except SculptError:  # across the steep side of another one
            number -= 1
            continue
        assert edit.layer is not None
        now = edit.preparation
        yield number, (before, now, edit.layer)


def _rows(
    before: "Preparation", now: "Preparation", layer: "Coefficients"
) -> Iterator[dict[str, Any]]:
    from neural_sculpt_addon.field.levels import support
    from neural_sculpt_addon.field.mesh.proxy import extract
    from neural_sculpt_addon.field.mesh.refinement.refine import EDGE_TOLERANCE, again, refine
    from neural_sculpt_addon.field.mesh.surface import sample_surface

    many, field, reached = 10**7, now.field, support(layer)
    finest = extract(field, UNIFORM[-1])
    true = sample_surface(field, finest, SAMPLES, 1).points
    found = []
    for cells in UNIFORM:
        proxy = extract(field, cells)
        found.append(_measure(field, proxy, true))
        yield {"mesh": f"uniform {cells}", **found[-1]}
    for tolerance in TOLERANCES:
        known = refine(before.field, before.proxy, many, tolerance)
        scratch, refined = _time(lambda t=tolerance: refine(field, now.proxy, many, t))
        stroke = None
        if tolerance <= EDGE_TOLERANCE:
            stroke, _ = _time(lambda k=known: again(field, now.proxy, k, reached, many))
        row = _measure(field, refined, true)
        share = _share(row, found)
        name = f"refined 1/{round(1 / tolerance)}"
        yield {"mesh": name, **row, "scratch": scratch, "stroke": stroke, "share": share}


def _share(row: dict[str, Any], uniform: list[dict[str, Any]]) -> float | None:
    """The triangles of a mesh by those of a uniform one with the same p99."""
    import numpy as np

    errors = np.log([each["p99"] for each in uniform])
    counts = np.log([each["triangles"] for each in uniform])
    order = np.argsort(errors)
    wanted = np.log(row["p99"])
    if not errors.min() <= wanted <= errors.max():
        return None
    return float(row["triangles"] / np.exp(np.interp(wanted, errors[order], counts[order])))


def _time(make: "Callable[[], Refined]") -> "tuple[float, Refined]":
    """The fewest seconds of the processor of three times, and what was made."""
    best, made = float("inf"), None
    for _ in range(3):
        start = time.process_time()
        made = make()
        best = min(best, time.process_time() - start)
    assert made is not None
    return best, made


def _measure(
    field: "Field", mesh: "Proxy | Refined", true: "NDArray[np.float32]"
) -> dict[str, Any]:
    import igl
    import numpy as np
    import trimesh

    from neural_sculpt_addon.field.evaluate import values_and_gradients

    vertices, triangles = mesh.vertices.astype(float), mesh.triangles.astype(np.int64)
    square = igl.point_mesh_squared_distance(true.astype(float), vertices, triangles)[0]
    distance = np.sqrt(square)
    shape = trimesh.Trimesh(vertices, triangles, process=False)
    _, uses = np.unique(shape.edges_sorted, axis=0, return_counts=True)
    outward = values_and_gradients(field, shape.triangles_center)[1]
    return {
        "triangles": len(triangles),
        "mean": float(distance.mean()),
        "p99": float(np.quantile(distance, 0.99)),
        "largest": float(distance.max()),
        "slivers": float(np.mean(np.degrees(shape.face_angles.min(axis=1)) < SLIVER)),
        "turned": int(np.sum((shape.face_normals * outward).sum(axis=1) < 0)),
        "open": int(np.sum(uses != 2)),
    }
