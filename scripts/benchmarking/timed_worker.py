# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker that notes when each step of an edit ends, for `benchmark.py stroke`.

Started as `python -I -u timed_worker.py ROOT NOTES`. Before each result of an edit the file NOTES
gets a line with a JSON object, from the name of a step to seconds of `time.perf_counter`, a clock
that all processes of one computer share.
"""

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, sys.argv[1])

from neural_sculpt_addon.worker.runtime import set_up

set_up()  # before NumPy and torch load

from neural_sculpt_addon.field.edit import edit  # noqa: E402
from neural_sculpt_addon.field.mesh import proxy  # noqa: E402
from neural_sculpt_addon.worker.install.environment import Device  # noqa: E402
from neural_sculpt_addon.worker.server import jobs, server, store  # noqa: E402

NOTES = Path(sys.argv[2])

ends: dict[str, float] = {}


def noting(step: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which notes when it last returned."""

    def call(*given: Any, **named: Any) -> Any:
        result = function(*given, **named)
        ends[step] = time.perf_counter()
        return result

    return call


def note_and_return(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which writes a line of notes before it returns."""

    def call(*given: Any) -> Any:
        result = function(*given)
        with NOTES.open("a", encoding="utf-8") as notes:
            notes.write(json.dumps(ends) + "\n")
        return result

    return call


def main() -> None:
    """Put notes around the steps, and serve."""
    solver: Any = edit.LocalEdit
    solver.solve, solver.forbid = noting("solve", solver.solve), noting("solve", solver.forbid)
    store.Store.state = noting("submit", store.Store.state)
    edit.pose = noting("problem", edit.pose)
    edit.update = proxy.update = noting("proxy", proxy.update)
    jobs.proxy_arrays = noting("arrays", jobs.proxy_arrays)
    jobs.Jobs.edit = note_and_return(jobs.Jobs.edit)
    server.main(Device.AUTO)


if __name__ == "__main__":
    main()
