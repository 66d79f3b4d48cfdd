# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy benchmark: from scratch, after a stroke, and by dense evaluation, in one run.

dense is the authors' way: all points of the lattice in blocks of 64^3 through the network as it
is, then marching cubes. stroke is the update after the edit of a case by the local solver; scratch
is measured before and after it. Each time is the best of three (dense: of one).

The networks are the pretrained ones with their public cases, or where these are absent the
primitives with a stroke over the top. Errors are mean distances to the surface of vertices and
of triangle centroids, model space; slivers the share of triangles below 5 degrees; ratio the
seconds of dense evaluation of the same network, or of the one before the edit, by these.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import scored_cases

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.field.field import Field
    from neural_sculpt_addon.field.mesh.proxy import Proxy
    from neural_sculpt_addon.stroke.stroke import Stroke

COLUMNS = ("seconds", "vertex_error", "centroid_error", "slivers", "nonmanifold_edges", "ratio")
BLOCK = 64**3  # points
SLIVER = 5  # degrees


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py proxy`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    scored_cases.add_option(parser)
    parser.add_argument("--cells", default="128,256", help="per axis, comma-separated")


def run(options: argparse.Namespace) -> None:
    """Print the table, and write the rows where `--json` says."""
    print(_line("network", "cells", "what", COLUMNS))
    rows = []
    for cells in map(int, options.cells.split(",")):
        for row in _rows(options.cases, cells):
            rows.append(row)
            figures = [f"{row[column]:.3g}" for column in COLUMNS]
            print(
                _line(row["case"] or row["network"], str(cells), row["what"], figures), flush=True
            )
        for what in ("scratch", "stroke", "dense"):
            chosen = [row for row in rows if row["cells"] == cells and row["what"] == what]
            worst = [max(row[column] for row in chosen) for column in COLUMNS[:-1]]
            worst.append(min(row["ratio"] for row in chosen))
            print(_line("worst", str(cells), what, [f"{figure:.3g}" for figure in worst]))
    if options.json:
        options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def _rows(cases: Path, cells: int) -> Iterator[dict[str, Any]]:
    from neural_sculpt_addon.field.edit.edit import sculpt
    from neural_sculpt_addon.field.levels import support
    from neural_sculpt_addon.field.mesh.proxy import extract, update
    from neural_sculpt_addon.field.problem.prepare import prepare

    def row(
        names: dict[str, str],
        field: "Field",
        what: str,
        make: "Callable[[], Proxy | Dense]",
        dense: float | None = None,
    ) -> dict[str, Any]:
        seconds, mesh = _time(make, 3 if dense else 1)
        measures = _measure(field, mesh.vertices, mesh.triangles)
        ratio = (dense or seconds) / seconds
        named = {**names, "cells": cells, "what": what, "seconds": seconds}
        return {**named, **measures, "ratio": ratio}

    for name, field, strokes in fields(cases):
        names = {"network": name, "case": ""}
        yield (slow := row(names, field, "dense", lambda f=field: _dense(f, cells)))
        dense = slow["seconds"]
        yield row(names, field, "scratch", lambda f=field: extract(f, cells), dense)
        proxy, preparation = extract(field, cells), prepare(field)
        for stroke in strokes:
            edit = sculpt(preparation, stroke)
            assert edit.layer is not None
            edited, reached = edit.field, support(edit.layer)
            names = {"network": name, "case": stroke.name}
            yield row(
                names,
                edited,
                "stroke",
                lambda p=proxy, f=edited, r=reached: update(p, f, r),
                dense,
            )
            yield row(names, edited, "scratch", lambda f=edited: extract(f, cells), dense)


def fields(cases: Path) -> "Iterator[tuple[str, Field, list[Stroke]]]":
    """Each field with its strokes."""
    from neural_sculpt_addon.field import checkpoint
    from neural_sculpt_addon.field.primitives import PRIMITIVES, primitive
    from neural_sculpt_addon.stroke.stroke import Stroke

    if cases.is_file():
        listed = json.loads(cases.read_text(encoding="utf-8"))["cases"]
        for model in dict.fromkeys(case["model"] for case in listed):
            field = checkpoint.load(cases.parent.parent / "networks" / f"{model}.pth")
            strokes = [
                Stroke.from_json(scored_cases.read_case(case))
                for case in listed
                if case["model"] == model
            ]
            yield model, field, strokes
    else:
        for name in PRIMITIVES:
            field = primitive(name)
            yield name, field, [_over_the_top(field, f"{name}-top")]


def _over_the_top(field: "Field", name: str) -> "Stroke":
    """A stroke along x over the highest point of the surface."""
    import numpy as np

    from neural_sculpt_addon.field.mesh.proxy import extract
    from neural_sculpt_addon.field.projection import project
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.stroke import Stroke

    vertices = extract(field, 64).vertices
    highest = vertices[np.argmax(vertices[:, 2])]
    line = highest + np.linspace([-0.1, 0, 0], [0.1, 0, 0], 9)  # (9, 3)
    points = project(field, line.astype(np.float32)).points
    return Stroke(points.astype(float), Brush(0.08, 0.06), name=name)


class Dense(NamedTuple):
    """What marching cubes makes of all points."""

    vertices: "NDArray[np.float32]"  # (V, 3)
    triangles: "NDArray[np.int32]"  # (F, 3)


def _dense(field: "Field", cells: int) -> Dense:
    import numpy as np
    import torch
    from skimage.measure import marching_cubes

    axis = torch.linspace(-1, 1, cells + 1)
    points = torch.cartesian_prod(axis, axis, axis)
    with torch.no_grad():
        values = torch.cat([field.value(block) for block in points.split(BLOCK)])
    lattice = values.reshape((cells + 1,) * 3).numpy()
    vertices, triangles, _, _ = marching_cubes(lattice, 0.0, spacing=(2 / cells,) * 3)
    return Dense(vertices - np.float32(1), triangles)


def _time(make: "Callable[[], Proxy | Dense]", times: int) -> "tuple[float, Proxy | Dense]":
    """The fewest seconds of so many times, and what was made."""
    seconds = []
    while True:
        start = time.perf_counter()
        mesh = make()
        seconds.append(time.perf_counter() - start)
        if len(seconds) == times:
            return min(seconds), mesh


def _measure(
    field: "Field", vertices: "NDArray[np.float32]", triangles: "NDArray[np.int32]"
) -> dict[str, float]:
    import numpy as np
    import trimesh

    from neural_sculpt_addon.field.evaluate import values_and_gradients

    def distance(points: "NDArray[Any]") -> float:
        value, gradient = values_and_gradients(field, points)
        return float(np.mean(np.abs(value) / np.linalg.norm(gradient, axis=1)))

    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    _, uses = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    return {
        "vertex_error": distance(vertices),
        "centroid_error": distance(mesh.triangles_center),
        "slivers": float(np.mean(np.degrees(mesh.face_angles.min(axis=1)) < SLIVER)),
        "nonmanifold_edges": int(np.sum(uses != 2)),
    }


def _line(network: str, cells: str, what: str, figures: Any) -> str:
    return f"{network:<22}{cells:>5} {what:<8}" + " ".join(f"{figure:>17}" for figure in figures)
