# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes: how one is started, and how it ended, in words. Standard library only."""

import os
import signal
import subprocess
from collections.abc import Sequence
from typing import BinaryIO


def clean_environ() -> dict[str, str]:
    """This process's environment without what would bend another Python's imports."""
    bends = {"PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "__PYVENV_LAUNCHER__"}
    return {name: value for name, value in os.environ.items() if name not in bends}


def no_window() -> int:
    """Popen's creationflags that keep a console from flashing up on Windows; 0 elsewhere."""
    return getattr(subprocess, "CREATE_NO_WINDOW", 0)


def start_logged(command: Sequence[str], log: BinaryIO) -> subprocess.Popen[bytes]:
    """Start `command` with a pipe to its stdin; what it prints goes into `log`. OSError."""
    return subprocess.Popen(
        command,
        bufsize=0,
        stdin=subprocess.PIPE,
        stdout=log,
        stderr=log,
        env=clean_environ(),
        creationflags=no_window(),
    )


def exit_in_words(code: int, log_tail: str = "") -> str:
    """A return code in words: the exception that Python ended with, or the signal it died of."""
    if code >= 0:
        last = log_tail.rpartition("\n")[2].strip()
        return f"exit code {code}: {last}" if code and last else f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"killed by signal {-code}"
