# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure Neural Sculpt on this machine: python3 scripts/benchmark.py NAME.

Each benchmark is a module of `benchmarking` whose docstring says what it measures, with
`add_options(parser)` and `run(options)`; the latter runs in the worker's environment.
"""

import argparse

from benchmarking import edit, fit, fuzz, interface, live, proxy, refine, session, stroke
from workshop import environment

from neural_sculpt_addon.worker.runtime import set_up

BENCHMARKS = {
    "edit": edit,
    "fit": fit,
    "fuzz": fuzz,
    "interface": interface,
    "live": live,
    "proxy": proxy,
    "refine": refine,
    "session": session,
    "stroke": stroke,
}


def main() -> None:
    """Run the benchmark that the command line names."""
    parser = argparse.ArgumentParser(description="Measure Neural Sculpt on this machine.")
    commands = parser.add_subparsers(required=True, metavar="{" + ",".join(BENCHMARKS) + "}")
    for name, benchmark in BENCHMARKS.items():
        about = benchmark.__doc__ or ""
        command = commands.add_parser(name, help=about.splitlines()[0], description=about)
        benchmark.add_options(command)
        command.set_defaults(run=benchmark.run)
    options = parser.parse_args()
    environment.enter("worker")
    set_up()  # as the worker
    options.run(options)


if __name__ == "__main__":
    main()
