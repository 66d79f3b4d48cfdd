# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands: programs that run at the same time and end together, each with what it prints.

Standard library only.
"""

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Self

from . import ROOT
from .virtualenv import say

PERSON = "xdotool "
"""How a line begins by which a script in Blender asks for input as from a person."""


class Commands:
    """Commands that may run at the same time, in several threads.

    Leaving the context ends those that still run and what they started, and none begins any more.
    So whoever waits for these threads waits outside of the context, and not for a command.
    """

    def __init__(self) -> None:
        """None runs yet."""
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[str]] = set()
        self._ended = False

    @property
    def ended(self) -> bool:
        """Whether none begins any more."""
        return self._ended

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End all that run."""
        with self._lock:
            self._ended = True
            for process in self._running:
                _end(process)

    def run(
        self,
        command: Sequence[str],
        variables: Mapping[str, str],
        limit: float,
        show: Callable[[str], object] = say,
    ) -> tuple[int, list[str], float]:
        """Run a command: exit code, the lines that it prints, seconds. RuntimeError after the end.

        Lines that begin with PERSON are done instead of shown by `show`. After `limit` seconds the
        command is ended, and so is what it started: that would hold the pipe open.
        """
        lines, start = [], time.monotonic()
        environment = {**os.environ, **variables}
        with self._begun(command, environment) as process:
            timer = threading.Timer(limit, _end, [process])
            timer.start()
            try:
                for line in process.stdout or ():
                    if line.startswith(PERSON):
                        subprocess.run(line.split(), env=environment, check=False)
                        continue
                    lines.append(line.rstrip())
                    show(lines[-1])
                process.wait()  # which may be long after its last line
            except BaseException:  # Ctrl C does not reach a session of its own
                _end(process)
                raise
            finally:
                timer.cancel()
                with self._lock:
                    self._running.discard(process)
        return process.returncode, lines, time.monotonic() - start

    def _begun(
        self, command: Sequence[str], environment: Mapping[str, str]
    ) -> "subprocess.Popen[str]":
        """A command that has begun, and is among those that run, in one step."""
        with self._lock:
            if self._ended:
                raise RuntimeError(f"{command[0]} does not begin after the end of all commands")
            process = subprocess.Popen(
                command,
                cwd=ROOT,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                start_new_session=True,
            )
            self._running.add(process)
            return process


def run(
    command: Sequence[str],
    variables: Mapping[str, str],
    limit: float,
    show: Callable[[str], object] = say,
) -> tuple[int, list[str], float]:
    """Run a single command, as `Commands.run` does."""
    with Commands() as commands:
        return commands.run(command, variables, limit, show)


def _end(process: "subprocess.Popen[str]") -> None:
    """Kill a command and what it started."""
    if os.name == "nt":
        process.kill()
        return
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
