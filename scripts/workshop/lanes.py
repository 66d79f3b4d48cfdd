# SPDX-License-Identifier: GPL-3.0-or-later
"""Lanes of the tests side by side: each part is shown whole, and a table ends them all.

Standard library only.
"""

import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain

from .commands import Commands
from .failures import Failure, summary
from .virtualenv import say

Show = Callable[[str], object]
Run = Callable[[Sequence[str], Mapping[str, str], float, Show], tuple[int, list[str], float]]
"""Runs a command, as `commands.run` does."""


@dataclass(frozen=True)
class Outcome:
    """What one part of the tests came to.

    note:     why it did not run, or not to its end
    failures: the tests that failed, and why
    printed:  all its lines
    """

    name: str
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    seconds: float = 0.0
    note: str = ""
    failures: Sequence[Failure] = ()
    printed: Sequence[str] = ()


@dataclass(frozen=True)
class Part:
    """What runs by itself; `work` is given what shows a line and what runs a command."""

    name: str
    work: Callable[[Show, Run], Outcome]


def alone(part: Part) -> Outcome:
    """Run a part that may have the whole computer, showing each line as it comes."""
    say(f"\n== {part.name}")
    with ThreadPoolExecutor(1) as pool, Commands() as commands:
        return pool.submit(_safe, part, say, commands.run).result()


def side_by_side(lanes: Sequence[Sequence[Part]], rest: Sequence[Part] = ()) -> list[Outcome]:
    """Run the parts of each lane one after another, and the lanes at the same time.

    rest: parts that whichever lane ends first goes on with

    Each part is shown whole when it ends. When this process is told to end, so are the parts, and
    what they had printed is shown. Returns outcomes in the order of lanes and rest.
    """
    waiting, outcomes, commands = deque(rest), {}, Commands()

    def work(part: Part) -> None:
        if commands.ended:
            return
        say(f"-- {part.name} has begun")
        shown: list[str] = []
        outcomes[part] = _safe(part, shown.append, commands.run)
        so_far = ", as far as it came" if commands.ended else ""
        say("\n".join([f"\n== {part.name}{so_far}", *shown, ""]))

    def go_along(lane: Sequence[Part]) -> None:
        for part in lane:
            work(part)
        with suppress(IndexError):
            while True:
                work(waiting.popleft())

    with ThreadPoolExecutor(len(lanes)) as pool, commands:  # which end before the pool waits
        for lane in [pool.submit(go_along, lane) for lane in lanes]:
            lane.result()
    return [outcomes[part] for part in (*chain(*lanes), *rest)]


def _safe(part: Part, show: Show, run: Run) -> Outcome:
    """What came of a part; an error of this script itself is a failure of that part alone."""
    start = time.monotonic()
    try:
        return part.work(show, run)
    except Exception as error:  # noqa: BLE001 - the other parts go on
        note = f"{type(error).__name__}: {error}"
        return Outcome(part.name, failed=1, seconds=time.monotonic() - start, note=note)


def end_when_told() -> None:
    """Let SIGTERM end this process as Ctrl C does: with all that was printed. Once is enough."""
    signals = signal.SIGINT, signal.SIGTERM

    def end(number: int, _: object) -> None:
        for each in signals:  # a second one would come into the midst of the end
            signal.signal(each, lambda *_: None)
        sys.exit(128 + number)

    if os.name != "nt":
        for each in signals:
            signal.signal(each, end)


def report(outcomes: Sequence[Outcome], seconds: float) -> bool:
    """Print the table, the total and, last of all, what failed; whether nothing did."""
    name = f"all, in {seconds // 60:.0f} min {seconds % 60:.0f} s"
    width = max(len(each) for each in (name, *(outcome.name for outcome in outcomes)))
    say(f"\n{'':{width}}  passed  failed  skipped  seconds")
    for o in outcomes:
        numbers = f"{o.passed:6}  {o.failed:6}  {o.skipped:7}  {o.seconds:7.1f}"
        say(f"{o.name:{width}}  {numbers}  {o.note}".rstrip())
    passed, failed, skipped = (
        sum(getattr(outcome, word) for outcome in outcomes)
        for word in ("passed", "failed", "skipped")
    )
    say(f"{name:{width}}  {passed:6}  {failed:6}  {skipped:7}  {seconds:7.1f}")
    total = f"\n{passed} passed, {failed} failed, {skipped} skipped"
    say(total)
    if not failed:
        return True
    for outcome in outcomes:
        if outcome.failed:
            note = f": {outcome.note}" if outcome.note else ""
            say(f"\n== what failed in {outcome.name}{note}")
            say("\n".join(summary(outcome.failures, outcome.printed)))
    say(total)
    return False
