# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface benchmark: what drawing costs Blender's main thread, in a window.

In the first Blender found that can open a window (the variable BLENDER names another), on a virtual
screen, by simulated input, with a proxy of about 100,000 triangles: Python's part of a mouse move,
what of it moves the surface under the pen, by time and by vertices that were looked at, the time
from a stroke's end to its preview and to the drawn result, the longest tick of the timer; and
the memory of Blender and of the worker over many strokes, and how many of these were refused. MB,
and milliseconds both by the clock and of the main thread's own work, which other programs do not
lengthen. Drawing itself is software's here, which a graphics card does in no time. The brush's
longest call is the first after a new mesh, which is then sorted into a grid for its rays.
"""

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

import blenders
import build_extension
import environment
import screen

SCRIPT = environment.ROOT / "scripts" / "interface_in_blender.py"
SECONDS = 7200


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py interface`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    parser.add_argument("--strokes", type=int, default=200, help="in a row (default: %(default)s)")


def run(options: argparse.Namespace) -> None:
    """Build the extension, start Blender, print the tables."""
    if missing := screen.why_none():
        sys.exit(missing)
    workshop = environment.ensure()
    program = blenders.first(workshop)
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as user,
        screen.virtual_screen() as on_screen,
    ):
        variables = {**program.variables, **on_screen, "BLENDER_USER_RESOURCES": user}
        rows = Path(user) / "rows.json"
        given = [str(build_extension.build(workshop)), str(options.strokes), str(rows)]
        command = screen.window_command(program, SCRIPT, given)
        code, _, _ = screen.run(command, variables, SECONDS)
        if options.json and not code:
            shutil.copy(rows, options.json)
    sys.exit(code)
