# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of a subject: its cases are done with each constant halved, doubled, and as it is."""

import math
import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass

from neural_sculpt_addon.common.errors import SculptError

from .constants import changed, find, others
from .subject import Case, Subject

REPEATED = 3  # times with other samples
LEAST = 1e-9  # of a measure that is part of a ratio
ALWAYS = "seconds"  # of the processor: told of every subject

Row = dict[str, float]


@dataclass
class Outcome:
    """What came of the cases, by their numbers: measures and bits; some may have been refused."""

    rows: dict[int, Row]
    bits: dict[int, bytes]
    refused: int


def lines(subject: Subject, names: Sequence[str], count: int, seed: int) -> Iterator[str]:
    """The lines of the table as Markdown, as they are found."""
    headings = (
        *("constant", "value", ALWAYS, *subject.ratios),
        *(f"highest {name}" for name in subject.highest),
        *(*subject.sums, "refused", "changed"),
    )
    yield f"| {' | '.join(headings).replace('_', ' ')} |"
    yield "|---" * len(headings) + "|"
    cases = subject.cases(count, seed, 0)
    _done(cases)  # what is drawn once is drawn now
    usual = _done(cases)
    for name, value, outcome in _outcomes(subject, names, cases, usual, seed):
        yield f"| {name} | {value} | {' | '.join(_cells(subject, outcome, usual))} |"


def _outcomes(
    subject: Subject, names: Sequence[str], cases: list[Case], usual: Outcome, seed: int
) -> Iterator[tuple[str, str, Outcome]]:
    """Of the constants as they are, of other samples, of each constant halved and doubled."""
    yield "as it is", "", usual
    for more in range(1, REPEATED + 1):
        yield "other samples", "", _done(subject.cases(len(cases), seed, more))
    for name in names:
        constant = find(name)
        value = constant.value
        for other in others(name):
            yield f"`{constant.title}`", f"{value:g} → {other:g}", _done(cases, name, other, usual)


def _done(
    cases: Sequence[Case], name: str = "", value: float = 0.0, usual: Outcome | None = None
) -> Outcome:
    """Do the cases with another value of a constant, and measure them with its usual one.

    usual: what comes of that, so that what has the same bits is not measured again
    """
    outcome = Outcome({}, {}, 0)
    for number, case in enumerate(cases):
        started = time.process_time()
        try:
            with changed(name, value) if name else nullcontext():
                made = case()
        except SculptError:
            outcome.refused += 1
            continue
        seconds = time.process_time() - started
        is_known = usual is not None and usual.bits.get(number) == made.bits
        row = usual.rows[number] if usual and is_known else made.measure()
        outcome.rows[number] = {**row, ALWAYS: seconds}
        outcome.bits[number] = made.bits
    return outcome


def _cells(subject: Subject, outcome: Outcome, usual: Outcome) -> list[str]:
    """A line of the table, of what was done both ways."""
    both = [(row, usual.rows[k]) for k, row in outcome.rows.items() if k in usual.rows]
    rows = [row for row, _ in both]
    return [
        *(f"{_mean_ratio(name, both):.2f}" for name in (ALWAYS, *subject.ratios)),
        *(f"{1e3 * max(row[name] for row in rows):.2f}" for name in subject.highest),
        *(f"{sum(row[name] for row in rows):g}" for name in subject.sums),
        str(outcome.refused),
        str(sum(bits != usual.bits.get(k) for k, bits in outcome.bits.items())),
    ]


def _mean_ratio(name: str, both: Sequence[tuple[Row, Row]]) -> float:
    """The geometric mean of a measure's ratio to the usual one."""
    return math.exp(
        statistics.fmean(
            math.log(max(row[name], LEAST) / max(usual[name], LEAST)) for row, usual in both
        )
    )
