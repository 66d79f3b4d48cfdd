# SPDX-License-Identifier: GPL-3.0-or-later
"""Call times: how long Blender's calls of functions take, in milliseconds.

By the clock, and of the thread's own work, which other programs do not lengthen.
"""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

PARTS = ("median", "95 %", "most")

times: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
"""Of each call of a function, by a name of ours: by the clock, and of work."""
ended: dict[str, float] = {}
"""When a function last returned, likewise, on the clock of `time.perf_counter`."""


def timed(owner: Any, name: str, label: Callable[[tuple[Any, ...]], str]) -> None:
    """Note how long each call of a function takes, by the `label` of what it is given."""
    function = getattr(owner, name)

    def call(*given: Any) -> Any:
        start, worked = time.perf_counter(), time.thread_time()
        try:
            return function(*given)
        finally:
            name, work = label(given), time.thread_time() - worked
            ended[name] = time.perf_counter()
            times[name].append((1000 * (ended[name] - start), 1000 * work))

    setattr(owner, name, call)


def table(width: int) -> list[dict[str, Any]]:
    """Print what each call cost, with so many characters for its name; the same as rows."""
    title = " ".join(f"{part:>8}" for part in PARTS)
    print(f"\n{'ms, by the clock':{width}} {'calls':>6} {title}   of work {title}")
    rows = []
    for label, values in times.items():
        clock, work = np.percentile(values, (50, 95, 100), axis=0).T.tolist()
        numbers = f"{line(clock)}           {line(work)}"
        print(f"{label:{width}} {len(values):6} {numbers}", flush=True)
        rows.append(
            {"call": label, "calls": len(values), "clock": named(clock), "work": named(work)}
        )
    return rows


def line(parts: Sequence[float]) -> str:
    """PARTS of a table's line."""
    return " ".join(f"{part:8.1f}" for part in parts)


def named(parts: Sequence[float]) -> dict[str, float]:
    """PARTS of a row."""
    return dict(zip(PARTS, parts, strict=True))
