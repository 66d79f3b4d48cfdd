# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker that notes when each step towards a quick result ends, for `benchmark.py stroke`.

Started as `python -I -u timed_worker.py ROOT NOTES`. After each quick result the file NOTES gets a
line with a JSON object, from the name of a step to seconds of `time.perf_counter`, a clock that all
processes of one computer share.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, sys.argv[1])

from neural_sculpt_addon.worker.settings import settle

settle()  # before NumPy and torch load

from neural_sculpt_addon.field import edit, proxy  # noqa: E402
from neural_sculpt_addon.worker import jobs, server  # noqa: E402
from neural_sculpt_addon.worker.environment import Device  # noqa: E402

NOTES = Path(sys.argv[2])

ends: dict[str, float] = {}


def noting(step: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which notes when it last returned."""

    def call(*given: Any, **named: Any) -> Any:
        result = function(*given, **named)
        ends[step] = time.perf_counter()
        return result

    return call


def main() -> None:
    """Put notes around the steps, and serve."""
    solver = edit.SOLVERS["gauss_newton"]
    edit.SOLVERS["gauss_newton"] = replace(solver, solve=noting("solve", solver.solve))
    jobs.Jobs._prepared = noting("submit", jobs.Jobs._prepared)
    edit.pose = noting("problem", edit.pose)
    edit.update = proxy.update = noting("proxy", proxy.update)
    jobs.model_arrays = noting("arrays", jobs.model_arrays)
    server_class: Any = server.Server
    send = server_class._send_part

    def note_and_send(*given: Any) -> None:
        with NOTES.open("a", encoding="utf-8") as notes:
            notes.write(json.dumps(ends) + "\n")
        send(*given)

    server_class._send_part = note_and_send
    server.main(Device.AUTO)


if __name__ == "__main__":
    main()
