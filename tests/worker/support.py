# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the worker share: where things lie, and waiting without guessing times."""

import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
TOY_WORKER = [sys.executable, "-I", "-u", str(Path(__file__).with_name("toy_worker.py")), str(ROOT)]
PATIENCE = 120.0  # seconds, for machines that are busy with something else; never the usual time


def until(condition: Callable[[], object]) -> None:
    """Wait until `condition` holds; fail the test when it never does."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def gone(pid: int) -> bool:
    """Whether the process has ended, be it that nobody has asked for its return code yet."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return True
    return stat.rpartition(")")[2].split()[0] in "ZX"


def processes_of(folder: Path) -> dict[int, list[str]]:
    """The processes with `folder` in their command lines, by number."""
    found = {}
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().decode(errors="replace").split("\0")
        except (FileNotFoundError, ProcessLookupError):
            continue
        if any(str(folder) in word for word in words):
            found[int(entry.parent.name)] = words
    return found
