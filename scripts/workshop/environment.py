# SPDX-License-Identifier: GPL-3.0-or-later
"""The project's own environment, `.venv/`: made on the first start, reused ever after.

    .venv/               Blender as a Python module (bpy)
    .venv/worker/        torch for the CPU, what else the worker needs, and the development tools;
                         in the first Python found here for which that brings no CUDA
    .venv/blender-4.5/   a further Blender, for the tests

As in an artist's Blender, torch is never beside bpy. Standard library only; how a worker is
installed is the package's knowledge (`worker.install.environment`).
"""

import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.worker.install import environment as worker_environment
from neural_sculpt_addon.worker.install.interpreter import candidate_pythons

from . import ROOT, virtualenv
from .virtualenv import say

VENV = ROOT / ".venv"
WORKER = VENV / "worker"
DEVELOPMENT = ROOT / "scripts" / "requirements-dev.txt"


@dataclass(frozen=True)
class Wheel:
    """A Blender that pip can install, for the one Python it was built for."""

    python: str
    pins: tuple[str, ...]

    @property
    def recipe(self) -> str:
        """What the marker of its environment says."""
        return " ".join(self.pins)


BLENDERS = {
    "4.2": Wheel("3.11", ("bpy==4.2.23", "numpy==1.26.4")),
    "4.5": Wheel("3.11", ("bpy==4.5.15", "numpy==1.26.4")),
    "5.0": Wheel("3.11", ("bpy==5.0.1", "numpy==1.26.4")),
    "5.2": Wheel("3.13", ("bpy==5.2.3", "numpy==2.3.5")),
}
OF_PYTHON = {wheel.python: version for version, wheel in BLENDERS.items()}  # the newest of each


@dataclass(frozen=True)
class Workshop:
    """The complete environment: which Python has what."""

    blender: Path
    """Python with bpy."""
    worker: Path
    """Python with torch and the development tools."""

    @property
    def blender_version(self) -> str:
        """Of the Blender in it, as in BLENDERS."""
        return OF_PYTHON[virtualenv.version_of(self.blender)]


def ensure() -> Workshop:
    """The environment, made first where it is not complete. SculptError says what is missing."""
    if not any(virtualenv.is_complete(VENV, BLENDERS[v].recipe) for v in OF_PYTHON.values()):
        base, version = _base()
        say(f"Making .venv, about 3 GB, once. The log is {VENV / virtualenv.LOG}")
        _make_blender(VENV, base, version)
    if not virtualenv.is_complete(WORKER, recipe := _worker_recipe()):
        _make_worker(recipe)
        say("The environment is complete; the next start takes no time.\n")
    return Workshop(virtualenv.python_in(VENV), virtualenv.python_in(WORKER))


def ensure_or_exit() -> Workshop:
    """As `ensure`; what is missing is told and ends the program."""
    try:
        return ensure()
    except SculptError as error:
        sys.exit(f"\n{error}")


def enter(role: str) -> None:
    """Go on in the environment's Python: "blender", with bpy, or "worker", with torch.

    Starts the running script again in it, unless it runs there already.
    """
    workshop = ensure_or_exit()
    python: Path = getattr(workshop, role)
    os.environ[worker_environment.ENVIRONMENT_VARIABLE] = str(workshop.worker)
    if Path(sys.prefix) == python.parents[1]:
        return
    command = [str(python), *sys.argv]
    if os.name == "nt":  # where exec returns to the shell at once
        sys.exit(subprocess.call(command))
    os.execv(python, command)


def blender(version: str) -> Path:
    """A Python with the bpy of this Blender, made first where there is none. SculptError."""
    workshop = ensure()
    if version == workshop.blender_version:
        return workshop.blender
    wheel, folder = BLENDERS[version], VENV / f"blender-{version}"
    if not virtualenv.is_complete(folder, wheel.recipe):
        base = _find_python(wheel.python)
        if base is None:
            raise SculptError(f"there is no Python {wheel.python} on this computer")
        _make_blender(folder, base, version)
    return virtualenv.python_in(folder)


def _base() -> tuple[Path, str]:
    """The Python to make `.venv` with, the one that is in it or this one, and its Blender."""
    if virtualenv.is_sound(VENV):
        python = virtualenv.python_in(VENV)
        if (version := virtualenv.version_of(python)) in OF_PYTHON:
            return python, OF_PYTHON[version]
        raise SculptError(
            f".venv is of Python {version}, for which there is no Blender. Remove it, and start"
            f" again with Python {' or '.join(OF_PYTHON)}."
        )
    version = ".".join(map(str, sys.version_info[:2]))
    if version in OF_PYTHON:
        return Path(sys.executable), OF_PYTHON[version]
    script = os.path.relpath(sys.argv[0])
    found = [f"{python} {script}" for python in map(_find_python, OF_PYTHON) if python]
    raise SculptError(
        f"Blender as a Python module exists for Python {' and '.join(OF_PYTHON)}; this is Python"
        f" {version}. " + (f"Start it as {' or '.join(found)}." if found else "Install one.")
    )


def _find_python(version: str) -> Path | None:
    """A Python of this version on this computer."""
    for candidate in candidate_pythons():
        if ".".join(map(str, candidate.version[:2])) == version:
            return candidate.python
    return None


def _make_blender(folder: Path, base: Path, version: str) -> None:
    def install(python: Path) -> None:
        say(f"Installing Blender {version} as a module of Python {BLENDERS[version].python}:")
        virtualenv.pip_install(python, BLENDERS[version].pins)

    virtualenv.make(folder, base, BLENDERS[version].recipe, install)


def _make_worker(recipe: str) -> None:
    """Install the worker as an artist does, and the tools beside it."""
    with virtualenv.locked(VENV):
        if virtualenv.is_complete(WORKER, recipe):  # by another start, in the meantime
            return
        if WORKER.exists() and not virtualenv.is_sound(WORKER):
            shutil.rmtree(WORKER)
        say("Installing the worker, with PyTorch for the CPU:")
        worker = worker_environment.create(WORKER, progress=_Steps())
        say(f"  The worker has Python {'.'.join(map(str, worker.version))}, torch {worker.torch}.")
        say("Installing the development tools:")
        virtualenv.mark(WORKER, virtualenv.HALF_MADE)
        virtualenv.pip_install(worker.python, ["--requirement", str(DEVELOPMENT)])
        virtualenv.mark(WORKER, recipe)


class _Steps:
    """Progress of the worker's installation: each new message is a line."""

    def __init__(self) -> None:
        """Nothing was said yet."""
        self._last = ""

    def __call__(self, fraction: float, message: str) -> None:
        """Say it, unless it was the last that was said."""
        if message != self._last:
            say(f"  {fraction:4.0%} {message}")
            self._last = message


def _worker_recipe() -> str:
    """All that is pinned for the worker and the tools, as a hash."""
    pins = worker_environment.REQUIREMENTS.read_bytes() + DEVELOPMENT.read_bytes()
    return hashlib.sha256(pins).hexdigest()
