# SPDX-License-Identifier: GPL-3.0-or-later
"""Halve and double each constant of a subject, one at a time, and measure what changes.

    python3 scripts/sensitivity.py [SUBJECT] [--only NAME ...] [--cases N] [--seed N] [--table FILE]

Subjects are modules of `sensitivities`. The cases of each are held out: no benchmark has them. A
measure is told as the geometric mean over the cases of its ratio to that with the constants as they
are. "Other samples" are the same cases with other random samples, three times: what is within their
range is noise. "Changed" counts cases whose result has other bits at all: a constant that changes
few of them guards a rare case. Seconds are of the processor, of all threads.
"""

import argparse
import importlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from workshop import environment

if TYPE_CHECKING:
    from sensitivities.subject import Subject

SUBJECTS = (
    "edits",
    "edits_on_blades",
    "edits_with_walls",
    "network",
    "absorption",
    "fit_meshes",
    "fit_networks",
    "fit_details",
    "fit_repairs",
    "refinement",
)


def main() -> None:
    """Measure, and print the table line by line."""
    parser = argparse.ArgumentParser(description="Measure what constants change.")
    parser.add_argument("subject", nargs="?", choices=SUBJECTS, default=SUBJECTS[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", help="as solve.local.GAP")
    parser.add_argument("--cases", type=int, help="how many; each subject has its usual number")
    parser.add_argument("--seed", type=int, default=2, help="of the cases")
    parser.add_argument("--table", type=Path, help="write the table as Markdown")
    options = parser.parse_args()
    environment.enter("worker")  # what subjects import is there alone
    from sensitivities import table

    subject: Subject = importlib.import_module(f"sensitivities.{options.subject}").SUBJECT
    names = options.only or subject.names
    if unknown := set(names) - set(subject.names):
        sys.exit(f"There is no constant {', '.join(sorted(unknown))} of {options.subject}.")
    lines = []
    for line in table.lines(subject, names, options.cases or subject.count, options.seed):
        lines.append(line)
        print(line, flush=True)
        if options.table:
            options.table.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
