# SPDX-License-Identifier: GPL-3.0-or-later
"""Kills of Blender (SIGKILL) with a stroke in computation: its worker ends, its folder goes.

The real worker in Blender as a module, which is killed at a random moment of its strokes. The
folder goes at the next start.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from in_blender import START

COUNT = 50
ROLE = "blender"
BLENDER = [sys.executable, str(START), "reliability.attacked.killed"]
LONGEST = 3.0  # seconds of strokes before the kill
PATIENCE = 30.0  # seconds in which a worker must have left


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` kills: folders right after them, folders and workers left at the end."""
    failures: list[str] = []
    totals = dict.fromkeys(("kills", "folders_after_kills", "folders_left", "workers_left"), 0)
    random = Random(seed)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        temporary = Path(name) / "temporary"
        temporary.mkdir()
        for number in range(count):
            worker = _killed(Path(name) / str(number), temporary, random.uniform(0, LONGEST))
            totals["kills"] += 1
            left = _folders(temporary)
            totals["folders_after_kills"] += bool(left)
            if len(left) > 1:
                failures.append(f"{number}: the start did not sweep, there are {left}")
            if not _gone(worker):
                totals["workers_left"] += 1
                failures.append(f"{number}: worker {worker} is left")
                os.kill(worker, signal.SIGKILL)
            if number % 10 == 9:
                report(str(totals))
        command, variables = _start(Path(name) / "end", temporary)
        subprocess.run(
            [*command, "end"], env=variables, stdout=subprocess.DEVNULL, timeout=300, check=True
        )
        left = _folders(temporary)
        totals["folders_left"] = len(left)
        failures += [f"{folder} is left" for folder in left]
    return {**totals, "failures": failures}


def _killed(user: Path, temporary: Path, seconds: float) -> int:
    """Kill a Blender so many seconds after its first stroke; the number of its worker's process."""
    command, variables = _start(user, temporary)
    with subprocess.Popen(
        command, env=variables, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as blender:
        assert blender.stdout is not None
        told = next(line for line in blender.stdout if line.startswith("worker "))
        time.sleep(seconds)
        blender.kill()
    return int(told.split()[1])


def _start(user: Path, temporary: Path) -> tuple[list[str], dict[str, str]]:
    """Command and variables of a Blender."""
    user.mkdir()
    variables = {**os.environ, "TMPDIR": str(temporary), "BLENDER_USER_RESOURCES": str(user)}
    return [*BLENDER, str(user)], variables


def _folders(temporary: Path) -> list[str]:
    """What is in the folder for temporary files; Blender's own are its own affair."""
    return [path.name for path in temporary.iterdir() if not path.name.startswith("blender_")]


def _gone(worker: int) -> bool:
    """Whether a process ends in time; one that nobody has waited for has ended, too."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            state = Path(f"/proc/{worker}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
        time.sleep(0.05)
    return False
