# SPDX-License-Identifier: GPL-3.0-or-later
"""Failures of tests, read from what pytest, unittest or a window printed.

A log is often cut, so the names and the last words of what failed are printed once more at its very
end. Standard library only.
"""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

WORDS = 12  # lines shown of each failed test
LAST_LINES = 40  # of a part that failed without a failed test: it crashed, or took too long
MOST = 15  # failed tests of a part that are shown with their last lines; of others only the name


class Failure(NamedTuple):
    """A failed test and the last lines that tell why."""

    name: str
    lines: Sequence[str] = ()


def summary(failures: Sequence[Failure], printed: Sequence[str]) -> Iterator[str]:
    """Lines that tell of the failures of a part; its own last ones where no test has failed."""
    for number, failure in enumerate(failures):
        yield f"FAILED {failure.name}"
        if number < MOST:
            yield from ("    " + line for line in failure.lines[-WORDS:])
    if not failures:
        yield from ("    " + line for line in printed[-LAST_LINES:])


def of_pytest(printed: Sequence[str]) -> list[Failure]:
    """From the short summary, each with the end of its section above."""
    sections: dict[str, list[list[str]]] = {}
    section: list[str] = []
    for line in printed:
        if header := re.fullmatch(r"_{3,} (.+) _{3,}", line):
            title = re.sub(r"^ERROR (at \w+ of|collecting) ", "", header[1])
            sections.setdefault(title, []).append(section := [])
        elif re.match(r"=+ .* =+$|-+ Captured .* -+$", line):
            section = []  # of no test
        elif line.strip():
            section.append(line)
    found = []
    for line in printed:
        if failed := re.match(r"(?:FAILED|ERROR) (\S*tests/\S+?(?:\[.*?\])?)(?: - .*)?$", line):
            title = ".".join(failed[1].split("::")[1:]) or failed[1]
            of_title = sections.get(title)
            found.append(Failure(failed[1], of_title.pop(0) if of_title else [line]))
    return found


def of_unittest(printed: Sequence[str]) -> list[Failure]:
    """From the blocks that unittest prints between double lines at its end."""
    found: list[Failure] = []
    block: list[str] | None = None
    for before, line in zip(["", *printed], printed, strict=False):
        if set(before) == {"="} and (failed := re.match(r"(?:FAIL|ERROR): (.*)", line)):
            found.append(Failure(failed[1], block := []))
        elif set(line) == {"="} or re.match(r"Ran \d+ tests? in ", line):
            block = None
        elif block is not None and line.strip("- "):
            block.append(line)
    return found


def of_window(printed: Sequence[str]) -> list[Failure]:
    """From the line in which run_in_window.py says how a test ended; its traceback is above."""
    found, since = [], []
    for line in printed:
        if ended := re.match(r"(\S+): (passed|failed|skipped)\b.*, [\d.]+ s$", line):
            if ended[2] == "failed":
                found.append(Failure(ended[1], since))
            since = []
        elif line.strip():
            since.append(line)
    return found
