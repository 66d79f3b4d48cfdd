# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual screen, and Blender in a window on it.

Xvfb keeps the screen in a file, so a script inside Blender takes a picture of the window by reading
it (`simulated_input.picture`). Standard library only.
"""

import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Self

from blenders import Program
from environment import ROOT
from virtualenv import say

SIZE = (1280, 800)
"""Pixels of the screen; Blender's window fills it."""
SCREEN_FILE = "NEURAL_SCULPT_SCREEN"
"""Environment variable that names the file with the screen's pixels."""
PERSON = "xdotool "
"""How a line begins by which a script in Blender asks for input as from a person."""


def why_none() -> str:
    """What is missing for a virtual screen, as a sentence; empty when nothing is."""
    if shutil.which("Xvfb"):
        return ""
    return "a window needs Xvfb (Debian, Ubuntu: apt-get install xvfb)"


def has_person() -> bool:
    """Whether input can come as from a person."""
    return shutil.which("xdotool") is not None


@contextmanager
def virtual_screen(size: tuple[int, int] = SIZE) -> Iterator[Mapping[str, str]]:
    """Environment variables of a program that is to draw on a new virtual screen.

    A key that is held types once: on a busy computer a finger rests longer than it was to.
    """
    with tempfile.TemporaryDirectory() as folder:
        reading, writing = os.pipe()
        command = [
            *("Xvfb", "-displayfd", str(writing), "-screen", "0", f"{size[0]}x{size[1]}x24"),
            *("-fbdir", folder, "-nolisten", "tcp", "-noreset", "-nocursor", "-r"),
        ]
        with subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL) as server:
            try:
                os.close(writing)
                with open(reading, encoding="ascii") as pipe:
                    display = f":{int(pipe.readline())}"
                yield {
                    "DISPLAY": display,
                    "REAL_BLENDER_DISPLAY": display,
                    "WAYLAND_DISPLAY": "",
                    "LIBGL_ALWAYS_SOFTWARE": "1",
                    SCREEN_FILE: str(Path(folder) / "Xvfb_screen0"),
                }
            finally:
                server.terminate()


def window_command(
    program: Program,
    script: Path,
    arguments: Sequence[str] = (),
    simulate: bool = True,
    size: tuple[int, int] = SIZE,
) -> list[str]:
    """The command that runs a script in a Blender whose window fills the screen.

    simulate: whether input comes from `Window.event_simulate`, and from nowhere else
    """
    return [
        *program.command,
        *("--factory-startup", "--gpu-backend", "opengl", "--no-window-focus"),
        *("--window-geometry", "0", "0", *map(str, size)),
        *(("--enable-event-simulate",) if simulate else ()),
        *("--python-exit-code", "1", "--python", str(script), "--", *arguments),
    ]


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
