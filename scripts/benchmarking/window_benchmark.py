# SPDX-License-Identifier: GPL-3.0-or-later
"""A benchmark in Blender's window, in the first Blender that can open one.

The variable BLENDER names another. It is a module of `in_blender`, and is given the extension, how
many strokes it draws in a row, the cells of the proxy, and the file for its rows. Standard library
only.
"""

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

import build_extension
from in_blender import START
from workshop import blenders, commands, environment, screen


def add_options(parser: argparse.ArgumentParser, strokes: int, cells: int) -> None:
    """The options of such a benchmark, and what they are by default: `strokes` in a row, `cells` of
    the proxy per axis."""
    parser.add_argument("--json", type=Path, help="write one object per row")
    parser.add_argument(
        "--strokes", type=int, default=strokes, help="in a row (default: %(default)s)"
    )
    parser.add_argument("--cells", type=int, default=cells, help="per axis (default: %(default)s)")


def run(name: str, options: argparse.Namespace, seconds: float, *more: str) -> None:
    """Build the extension and start the module `name` in Blender, for so many seconds at most;
    `more` is given to it at the end."""
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
        extension, numbers = build_extension.build(workshop), (options.strokes, options.cells)
        given = [str(extension), *map(str, numbers), str(rows), *more]
        command = screen.window_command(program, START, [f"in_blender.{name}", *given])
        code, _, _ = commands.run(command, variables, seconds)
        if options.json and not code:
            shutil.copy(rows, options.json)
    sys.exit(code)
