# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of live absorption: strokes of Blender's own brushes on a field, in a window.

Ten brushes on Suzanne, by default with about 100,000 vertices, in the first Blender found that can
open a window (the variable BLENDER names another), on a virtual screen, by simulated input: for
each brush how far the result is from the brushed mesh, how far the rest of the surface has moved,
the pieces, and the time from the stroke's end to its undo step; then many strokes in a row without
a pause, and what the extension's calls cost Blender's main thread. Lengths in thousandths of a
model unit.
"""

import argparse

from . import window_benchmark

SECONDS = 3600


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py live`."""
    window_benchmark.add_options(parser, 50, 238)


def run(options: argparse.Namespace) -> None:
    """Build the extension, start Blender, print the tables."""
    window_benchmark.run("live", options, SECONDS)
