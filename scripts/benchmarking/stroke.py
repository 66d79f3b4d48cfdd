# SPDX-License-Identifier: GPL-3.0-or-later
"""The stroke benchmark: from a stroke's end to the proxy drawn in Blender, step by step.

In Blender as a Python module, with a worker of its own, as in a window: the worker has prepared the
field while the stroke was drawn, and Blender looks for news as often. Milliseconds, of the clock
that all processes share:

submit   Blender's call, until the worker begins
problem  the stroke placed on the surface
solve    the local solver
proxy    the proxy's update
arrays   the mesh's edges, and the layer as bytes
send     through the pipe, and until Blender looks
commit   stroke, layer and mesh written into the scene, its undo step, and the view layer updated
blocked  the most work of Blender's main thread at a time: for submit, a piece of the preview, or a
         look for news, of which the last is commit

The strokes are the public cases, or where these are absent strokes over the top of the primitives.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import build_extension
from in_blender import START
from workshop import environment

from . import proxy, scored_cases

STEPS = ("submit", "problem", "solve", "proxy", "arrays", "send", "commit", "total", "blocked")


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py stroke`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    scored_cases.add_option(parser)
    parser.add_argument("--cells", type=int, default=128, help="per axis (default: %(default)s)")


def run(options: argparse.Namespace) -> None:
    """Build the extension, draw the strokes in Blender, print the table."""
    from neural_sculpt_addon.field import checkpoint
    from neural_sculpt_addon.stroke.file import dump_strokes

    workshop = environment.ensure()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        wanted = []
        for model, field, strokes in proxy.fields(options.cases):
            path = folder / f"{model}.safetensors"
            checkpoint.save(field, path)
            wanted += [[str(path), stroke.name, dump_strokes([stroke])] for stroke in strokes]
        (folder / "strokes.json").write_text(json.dumps([options.cells, wanted]))
        zipped = build_extension.build(workshop)
        command = [str(workshop.blender), str(START), "in_blender.stroke", str(zipped), name]
        if code := subprocess.run(command, check=False).returncode:
            sys.exit(code)
        rows = json.loads((folder / "rows.json").read_text())
    print(_line("stroke", STEPS))
    for row in rows:
        print(_line(row["stroke"], [f"{row[step]:.0f}" for step in STEPS]))
    for word, summary in (("median", statistics.median), ("worst", max)):
        print(_line(word, [f"{summary([row[step] for row in rows]):.0f}" for step in STEPS]))
    if options.json:
        options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def _line(stroke: str, cells: tuple[str, ...] | list[str]) -> str:
    return f"{stroke:<16}" + " ".join(f"{cell:>8}" for cell in cells)
