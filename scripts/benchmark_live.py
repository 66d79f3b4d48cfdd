# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of live absorption: strokes of Blender's own brushes on a field, in a window.

Ten brushes on Suzanne with about 100,000 vertices, in the first Blender found that can open a
window (the variable BLENDER names another), on a virtual screen, by simulated input: for each brush
how far the result is from the brushed mesh, how far the rest of the surface has moved, the pieces,
and the time from the stroke's end to its undo step; then many strokes in a row without a pause, and
what the extension's calls cost Blender's main thread. Lengths in thousandths of a model unit.
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

SCRIPT = environment.ROOT / "scripts" / "live_in_blender.py"
SECONDS = 3600


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py live`."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    parser.add_argument("--strokes", type=int, default=50, help="in a row (default: %(default)s)")


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
