# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface benchmark: what drawing costs Blender's main thread, in a window.

In the first Blender found that can open a window (the variable BLENDER names another), on a virtual
screen, by simulated input, with a proxy of about 100,000 triangles, or 300,000 with `--cells 298`:
Python's part of a mouse move, what of it moves the surface under the pen, by time and by vertices
that were looked at, the time from a stroke's end to its preview and to the drawn result, the
longest tick of the timer; and the memory of Blender and of the worker over many strokes, and how
many of these were refused. MB,
and milliseconds both by the clock and of the main thread's own work, which other programs do not
lengthen. Drawing itself is software's here, which a graphics card does in no time. The brush's
longest call is the first after a new mesh, which is then sorted into a grid for its rays.
"""

import argparse

from . import window_benchmark

SECONDS = 7200


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py interface`."""
    window_benchmark.add_options(parser, 200, 172)
    parser.add_argument("--mode", choices=("OBJECT", "SCULPT"), default="OBJECT")


def run(options: argparse.Namespace) -> None:
    """Build the extension, start Blender, print the tables."""
    window_benchmark.run("interface", options, SECONDS, options.mode)
