# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure Neural Sculpt on this machine: python3 scripts/benchmark.py NAME.

Each benchmark is a module `benchmark_NAME` whose docstring says what it measures, with
`add_options(parser)` and `run(options)`; the latter runs in the worker's environment.
"""

import argparse

import benchmark_edit
import benchmark_fit
import benchmark_fuzz
import benchmark_interface
import benchmark_live
import benchmark_proxy
import benchmark_refine
import benchmark_session
import benchmark_stroke
import environment

from neural_sculpt_addon.worker.settings import settle

BENCHMARKS = {
    "edit": benchmark_edit,
    "fit": benchmark_fit,
    "fuzz": benchmark_fuzz,
    "interface": benchmark_interface,
    "live": benchmark_live,
    "proxy": benchmark_proxy,
    "refine": benchmark_refine,
    "session": benchmark_session,
    "stroke": benchmark_stroke,
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
    settle()  # as the worker
    options.run(options)


if __name__ == "__main__":
    main()
