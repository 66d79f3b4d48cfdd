# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual environment that is either complete or made again.

A marker file in the folder tells its state: what it was made for, or "half made" while it is being
made. A folder without a marker was made by somebody else: it is completed in place. A lock in the
folder keeps two starts apart. Standard library only.
"""

import contextlib
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.worker.install.environment import environment_python as python_in
from neural_sculpt_addon.worker.install.pip import UnsuitableError, run

MARKER = "environment.txt"
LOCK = "environment.lock"
LOG = "environment.log"
HALF_MADE = "half made"
ROOM = 4e9
"""Bytes for an environment of any kind, with the room that pip needs to unpack."""


def say(text: str) -> None:
    """One line of progress."""
    print(text, flush=True)


def is_complete(folder: Path, recipe: str) -> bool:
    """Whether `folder` was made for `recipe` and its base Python has not gone since."""
    return _state(folder) == recipe and python_in(folder).exists()


def is_sound(folder: Path) -> bool:
    """Whether there is an environment in `folder` that can be kept, if only to be completed."""
    return python_in(folder).exists() and _state(folder) != HALF_MADE


def make(folder: Path, base: Path, recipe: str, install: Callable[[Path], None]) -> None:
    """Make the environment in `folder` with `base` and fill it, unless it is complete.

    `install` gets the environment's interpreter and puts into it what `recipe` stands for.
    SculptError when this computer lacks something.
    """
    python = python_in(folder)
    with locked(folder):
        if is_complete(folder, recipe):  # by another start, in the meantime
            return
        if not is_sound(folder):
            _empty(folder)
            _need_room(folder)
        mark(folder, HALF_MADE)
        if not python.exists():
            _run([base, "-m", "venv", folder], folder)
        install(python)
        mark(folder, recipe)


def mark(folder: Path, state: str) -> None:
    """Write down what `folder` was made for, or that it is HALF_MADE."""
    (folder / MARKER).write_text(state)


def pip_install(python: Path, arguments: Sequence[str]) -> None:
    """Run pip in the environment of `python`, and show what it fetches. SculptError."""
    options = ["--disable-pip-version-check", "--progress-bar", "off", "--retries", "2"]
    _run([python, "-I", "-m", "pip", "install", *options, *arguments], python.parents[1])


def version_of(python: Path) -> str:
    """The version of a virtual environment's interpreter, as in "3.11"."""
    return ".".join(_config(python)["version"].split(".")[:2])


def home_of(python: Path) -> Path:
    """Where the Python is installed that a virtual environment stands on."""
    return Path(_config(python)["home"]).parent


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder's lock, and wait for it while another process does."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("w") as file:
        waiting = False
        while not _try_lock(file):
            if not waiting:
                say(f"Another start is making {folder.name}; waiting for it.")
            waiting = True
            time.sleep(0.2)
        yield  # closing the file releases the lock, and so does the end of this process


def _run(command: Sequence[str | Path], folder: Path) -> None:
    try:
        run([str(part) for part in command], folder / LOG, _show)
    except UnsuitableError as error:
        raise SculptError(f"{command[0]} {error}. The log is {folder / LOG}.") from error


def _show(line: str) -> None:
    if line.startswith(("Collecting ", "Downloading ", "Installing collected")):
        say("  " + (line if len(line) < 98 else line[:95] + "..."))


def _need_room(folder: Path) -> None:
    free = shutil.disk_usage(folder).free
    if free < ROOM:
        raise SculptError(
            f"{folder} needs up to {ROOM / 1e9:.0f} GB and its disk has {free / 1e9:.1f} GB left."
            " Free some space and start again."
        )


def _state(folder: Path) -> str:
    try:
        return (folder / MARKER).read_text()
    except FileNotFoundError:
        return ""


def _empty(folder: Path) -> None:
    """Remove all but the lock and the environments inside, which have markers of their own."""
    for entry in folder.iterdir():
        if entry.is_symlink() or entry.is_file():
            if entry.name != LOCK:
                entry.unlink()
        elif not (entry / MARKER).exists():
            shutil.rmtree(entry)


def _config(python: Path) -> dict[str, str]:
    text = (python.parents[1] / "pyvenv.cfg").read_text(encoding="utf-8")
    pairs = (line.partition("=") for line in text.splitlines())
    return {key.strip(): value.strip() for key, _, value in pairs}


if sys.platform == "win32":
    import msvcrt

    def _try_lock(file: IO[str]) -> bool:
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def _try_lock(file: IO[str]) -> bool:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
