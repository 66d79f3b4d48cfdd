# SPDX-License-Identifier: GPL-3.0-or-later
"""venv and pip, run as commands: their output is progress and log, their failures become sentences.

Standard library only. pip has no interface but its command line and speaks to programmers; the
table below holds the failures that artists meet and what helps against each.
"""

import re
import subprocess
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from ...common.child import clean_environ, no_window
from ...common.errors import SculptError

_KEPT = 400  # lines of output that are looked at when a command fails


class UnsuitableError(SculptError):
    """This interpreter cannot hold the worker; another one may."""


_EVERYWHERE = (  # whatever the interpreter: pattern in the output, sentence; the first match counts
    (
        r"No space left on device|Errno 28|WinError 112",
        "The disk is full. Free some gigabytes, or choose a folder on another disk, and try again.",
    ),
    (
        r"WinError 225",
        "The virus scanner stopped the installation. Allow the folder of the worker there, and try"
        " again.",
    ),
    (
        r"CERTIFICATE_VERIFY_FAILED|SSLError",
        "The package index could not be reached safely. Check the clock, proxy and certificates of"
        " this computer, and try again.",
    ),
    (
        r"name resolution|getaddrinfo|NewConnectionError|ConnectionError|ConnectTimeout|ProxyError"
        r"|ReadTimeout|timed out|Network is unreachable|Connection refused|Connection reset",
        "The package index could not be reached. Check the network and the proxy, and try again.",
    ),
    (
        r"Permission denied|Errno 13|WinError 5\b|WinError 32\b|Read-only file system",
        "Files of the worker could not be written. Stop the worker, check that the folder may be"
        " written, and try again.",
    ),
)
_HERE = (  # this interpreter only
    (
        r"No module named '?(venv|ensurepip)|ensurepip is not|python3\S*-venv",
        "cannot make virtual environments (on Debian and Ubuntu the package python3-venv is"
        " missing)",
    ),
    (
        r"No matching distribution|Could not find a version|not a supported wheel",
        "has no ready-made builds of PyTorch and the rest for this kind of computer",
    ),
)


def run(
    command: Sequence[str], log: Path, on_line: Callable[[str], None] = lambda line: None
) -> None:
    """Run `command`, appending its output to `log`; `on_line` gets each line.

    What `on_line` raises (Cancelled) ends the process. A failure raises SculptError, or
    UnsuitableError where another interpreter may fare better.
    """
    kept: deque[str] = deque(maxlen=_KEPT)
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="replace",
        env=clean_environ(),
        creationflags=no_window(),
    )
    assert process.stdout is not None
    try:
        with process.stdout as output, log.open("a", encoding="utf-8") as file:
            file.write(f"$ {' '.join(command)}\n")
            for line in map(str.strip, output):
                on_line(line)
                if line:
                    kept.append(line)
                    file.write(line + "\n")
                    file.flush()
    except BaseException:  # a cancel above all: it must not go on without us
        process.kill()
        raise
    finally:
        code = process.wait()
    if code != 0:
        raise explain("\n".join(kept), log)


def explain(output: str, log: Path) -> SculptError:
    """The failure that `output` tells of, in words that help; `log` is where the rest stands."""
    for pattern, sentence in _EVERYWHERE:
        if re.search(pattern, output):
            return SculptError(sentence)
    for pattern, sentence in _HERE:
        if re.search(pattern, output):
            return UnsuitableError(sentence)
    last = next((line for line in reversed(output.splitlines()) if line.strip()), "no output")
    return UnsuitableError("failed with “{}” (see {})", last.strip(), log)
