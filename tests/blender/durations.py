# SPDX-License-Identifier: GPL-3.0-or-later
"""How long tests took, the slowest of them listed. Standard library only."""

import time
import unittest
from collections.abc import Iterator

MOST = 15  # that are listed
SHORT = 0.5  # seconds; what took less is not listed


class Durations:
    """Seconds of each test, and how many of them Blender's own process was at work.

    In the rest of them the worker was, or the test waited.
    """

    def __init__(self) -> None:
        """Nothing has begun."""
        self.taken: list[tuple[float, float, str]] = []
        self.begun = 0.0, 0.0

    def begin(self) -> None:
        """A test begins."""
        self.begun = time.monotonic(), time.process_time()

    def end(self, case: unittest.TestCase) -> float:
        """A test has ended; its seconds."""
        seconds, at_work = time.monotonic() - self.begun[0], time.process_time() - self.begun[1]
        self.taken.append((seconds, at_work, case.id()))
        return seconds

    def slowest(self) -> Iterator[str]:
        """Lines that tell of the slowest."""
        yield "slowest tests: seconds, and of them those of Blender's own process"
        for seconds, at_work, name in sorted(self.taken, reverse=True)[:MOST]:
            if seconds > SHORT:
                yield f"{seconds:7.1f} {at_work:7.1f}  {name}"


class TimedResult(unittest.TextTestResult):
    """Of a run of unittest, with the durations of its tests."""

    def __init__(self, *given: object, **more: object) -> None:
        """Made by the runner."""
        super().__init__(*given, **more)
        self.durations = Durations()

    def startTest(self, test: unittest.TestCase) -> None:  # noqa: N802 - of unittest
        """Its clock starts."""
        super().startTest(test)
        self.durations.begin()

    def stopTest(self, test: unittest.TestCase) -> None:  # noqa: N802 - of unittest
        """Its clock stops."""
        self.durations.end(test)
        super().stopTest(test)
