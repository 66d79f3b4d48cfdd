# SPDX-License-Identifier: GPL-3.0-or-later
"""A stopwatch for the stages of an edit, and functions that run under it."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, NamedTuple
from unittest.mock import patch


class Span(NamedTuple):
    """When a stage ran; seconds after the stopwatch was started."""

    stage: str
    start: float
    end: float


@dataclass
class Stopwatch:
    """Spans of stages, in order. A stage within another one is part of that."""

    spans: list[Span] = field(default_factory=list)
    _began: float = field(default_factory=time.perf_counter)
    _inside: bool = False

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what is done within."""
        if self._inside:
            yield
            return
        self._inside, start = True, time.perf_counter() - self._began
        try:
            yield
        finally:
            self._inside = False
            self.spans.append(Span(name, start, time.perf_counter() - self._began))

    def totals(self) -> dict[str, float]:
        """Seconds of each stage, in the order of their first spans."""
        found: dict[str, float] = {}
        for span in self.spans:
            found[span.stage] = found.get(span.stage, 0.0) + span.end - span.start
        return found

    def timed(self, stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, as a stage."""

        @wraps(function)
        def call(*given: Any, **named: Any) -> Any:
            with self.stage(stage):
                return function(*given, **named)

        return call


@contextmanager
def watching(stages: Mapping[tuple[Any, str], str]) -> Iterator[Stopwatch]:
    """A stopwatch under which functions run: of modules and classes, by their names."""
    watch = Stopwatch()
    with ExitStack() as stack:
        for (owner, name), stage in stages.items():
            function = watch.timed(stage, getattr(owner, name))
            stack.enter_context(patch.object(owner, name, function))
        yield watch
