# SPDX-License-Identifier: GPL-3.0-or-later
"""Heartbeat: how each side knows that the worker's process still runs. Standard library only.

A thread of the worker touches a file every `INTERVAL` seconds; Blender looks at the file's time,
which it only compares with the one before. A job that computes for long beats all the same: the
computations give up Python's lock every few milliseconds, and none keeps it for seconds. A job that
has not come to its next report within `STUCK` seconds waits for something that does not answer, a
driver for example, and the worker beats no more.
"""

import contextlib
import time
from pathlib import Path

INTERVAL = 0.5
"""Seconds between two beats, and at least between two looks."""

SILENT = 15.0
"""Seconds without a beat after which a worker is taken to hang. A busy machine starves it for
less."""

SILENT_STARTING = 90.0
"""The same while libraries are loaded, from a slow disk, with Python's lock held."""

STUCK = 120.0
"""Seconds for which a job may report nothing."""


def beat(folder: Path) -> None:
    """Give a sign of life in a folder; OSError when it is gone."""
    (folder / "pulse").touch()


class Pulse:
    """Watch over signs of life: how long there was none."""

    def __init__(self, folder: Path) -> None:
        """Watch the worker that beats in `folder`; no beat is known yet."""
        self._path = folder / "pulse"
        self._last: int | None = None
        self._looked = time.monotonic()
        self.silent = 0.0
        """Seconds, of those in which somebody looked: sleep of the machine is no silence."""

    def look(self) -> None:
        """Look for a sign of life, unless that was done just now."""
        now = time.monotonic()
        passed = now - self._looked
        if passed < INTERVAL:
            return
        self._looked = now
        self.silent += min(passed, 2 * INTERVAL)
        with contextlib.suppress(OSError):  # it has not begun to beat
            if (seen := self._path.stat().st_mtime_ns) != self._last:
                self._last, self.silent = seen, 0.0
