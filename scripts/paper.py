# SPDX-License-Identifier: GPL-3.0-or-later
"""Repeat the paper's evaluation: python3 scripts/paper.py.

Writes docs/paper/: the tables as Markdown and CSV, the figures, the machine, the versions and the
seeds; a run of all tables also writes the one in README.md. Rows that are finished are kept in
test-output/paper/, and a later start goes on from there. Times are to be compared within one run on
a machine with nothing else to do; tables 1 and 4 have some.

    --quick     a small form, in minutes, into test-output/paper/quick: does all of it work?
    --plan      only tell what is left and how long it takes
    --finished  make no more rows, and write the tables of those that are there
    --anew METHOD  measure one method anew, but for times; the others keep their rows, which are
                finished here or were recorded in benchmarks/paper.json by a full run
    1 2 3 4 beyond figures   only these
"""

import argparse
import functools
import sys
from pathlib import Path

from workshop import ROOT, environment

from neural_sculpt_addon.worker.runtime import set_up

ROWS = ROOT / "test-output" / "paper"
RECORD = ROOT / "benchmarks" / "paper.json"
TABLES = ("1", "2", "3", "4", "beyond", "figures")


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description="Repeat the paper's evaluation.")
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=", ".join(TABLES))
    parser.add_argument("--quick", action="store_true", help="a small form, in minutes")
    parser.add_argument("--plan", action="store_true", help="only tell how long it takes")
    parser.add_argument("--finished", action="store_true", help="only write what is finished")
    parser.add_argument("--anew", metavar="METHOD", help="measure one method anew, as local")
    parser.add_argument("--work", type=Path, help="folder of finished rows")
    parser.add_argument("--out", type=Path, help="where the tables go (default: docs/paper)")
    options = parser.parse_args()
    if unknown := set(options.tables) - set(TABLES):
        sys.exit(f"There is no table {', '.join(sorted(unknown))}; choose of {', '.join(TABLES)}.")
    environment.enter("worker")
    set_up()  # before NumPy and torch load
    from paper import run

    from neural_sculpt_addon.common.errors import SculptError

    form = "quick" if options.quick else "full"
    out = options.out or (ROWS / "quick" / "tables" if options.quick else ROOT / "docs" / "paper")
    whole = not (options.quick or options.tables or options.out)
    try:
        run.run(
            options.quick,
            options.tables or TABLES,
            options.work or ROWS / form,
            out,
            functools.partial(print, flush=True),
            only_plan=options.plan,
            only_finished=options.finished,
            readme=ROOT / "README.md" if whole else None,
            record=RECORD if whole else None,
            anew=options.anew,
        )
    except SculptError as error:
        sys.exit(f"{error}")


if __name__ == "__main__":
    main()
