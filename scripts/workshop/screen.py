# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual screen, and Blender in a window on it.

Xvfb keeps the screen in a file, so a script inside Blender takes a picture of the window by reading
it (`simulated_input.screen_pixels`). Standard library only.
"""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from .blenders import Program

SIZE = (1280, 800)
"""Pixels of the screen; Blender's window fills it."""
SCREEN_FILE = "NEURAL_SCULPT_SCREEN"
"""Environment variable that names the file with the screen's pixels."""


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
