# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's own Python: which one it is, the command that starts it, and how it is installed.

Standard library only, no bpy: Blender's process and the scripts both use it. `create` makes a
virtual environment with the pinned `requirements.txt` and never brings gigabytes of CUDA unasked:
each interpreter first resolves the requirements without installing them, and one for which CUDA
would come is passed over. A marker file says `incomplete` until the self-test has passed, so that
an installation that was interrupted is always told from a whole one.
"""

import contextlib
import errno
import json
import os
import shutil
from collections.abc import Iterable
from enum import StrEnum
from itertools import chain
from pathlib import Path

from ...common.errors import SculptError
from ...common.progress import Progress, silent
from ...common.text import Text
from .interpreter import OLDEST, Environment, candidate_pythons, check_python, identify, lack
from .pip import UnsuitableError, run

ENVIRONMENT_VARIABLE = "NEURAL_SCULPT_PYTHON"
REQUIREMENTS = Path(__file__).with_name("requirements.txt")
LAUNCH = Path(__file__).parents[1] / "launch.py"
SPACE = 3_000_000_000
"""Bytes an installation needs while it runs; about half of them stay."""

NO_PYTHON = Text(
    "There is no Python {} or newer here for the worker; install one from"
    " python.org and try again.",
    ".".join(map(str, OLDEST)),
)

_MARKER = "neural_sculpt_environment.txt"
_LOG = "install.log"
_INCOMPLETE = b"incomplete\n"
_CUDA = ("nvidia", "cuda", "triton", "pytorch-triton")
_RESOLVED, _COLLECTED, _TESTING = 0.1, 0.7, 0.95  # fractions of the way


class Device(StrEnum):
    """What the artist wants strokes to be sculpted on."""

    AUTO = "auto"  # CUDA where it works, or else the processor
    CPU = "cpu"
    CUDA = "cuda"


def worker_command(python: Path | str, device: Device = Device.AUTO) -> list[str]:
    """The command that runs the worker of this very package on `python`, isolated, unbuffered."""
    return _launch(python, "server.server", device)


def installation_command(python: Path | str, folder: Path | str) -> list[str]:
    """The command that installs the worker into `folder`, see `installation`, on any `python`."""
    return _launch(python, "install.installation", str(folder))


def configured_python(preference: str | Path | None, folder: Path | str) -> Path:
    """The worker's Python: the one preferred, else NEURAL_SCULPT_PYTHON, else the one installed.

    Looks at files only, so it may be called while drawing. What was named wins even if it is
    broken: another Python than the one asked for would only hide the mistake.
    """
    for named in (preference, os.environ.get(ENVIRONMENT_VARIABLE)):
        if named:
            python = Path(named).expanduser()
            if not python.is_file():
                raise SculptError("There is no Python at {}; correct the path.", python)
            return python
    if not installed(folder):
        raise SculptError("The worker is not installed; install it in the add-on's preferences.")
    return environment_python(folder)


def environment_python(folder: Path | str) -> Path:
    """Where the interpreter of the virtual environment in `folder` lies."""
    parts = ("Scripts", "python.exe") if os.name == "nt" else ("bin", "python")
    return Path(folder).joinpath(*parts)


def installed(folder: Path | str) -> bool:
    """Whether `folder` holds a whole installation of the requirements of this version."""
    marker = Path(folder) / _MARKER
    try:
        return (
            marker.read_bytes() == REQUIREMENTS.read_bytes()
            and environment_python(folder).is_file()
        )
    except OSError:
        return False


def create(
    folder: Path | str, python: Path | str | None = None, progress: Progress = silent
) -> Environment:
    """Install the worker into `folder` and test it; an installation that is whole is only tested.

    `python` is the interpreter to install for; None tries `candidate_pythons` in turn. Blocks for
    minutes, so Blender has a process for it, see `installation`. What pip says is in `install.log`
    in the folder. Raises SculptError with what to do, and Cancelled when `progress` did.
    """
    folder = Path(folder).expanduser().absolute()
    if installed(folder):
        with contextlib.suppress(SculptError):  # the Python under it may have been uninstalled
            environment = check_python(environment_python(folder))
            if environment.ready:
                return environment
    try:
        _claim(folder)
        candidates = candidate_pythons() if python is None else [identify(python)]
        packages = _first_resolved(folder, candidates, progress)
        environment = _install(folder, packages, progress)
        (folder / _MARKER).write_bytes(REQUIREMENTS.read_bytes())
    except OSError as error:
        raise cannot_install(folder, error) from error
    progress(1.0, "The worker is installed")
    return environment


def cannot_install(folder: Path, error: OSError) -> SculptError:
    """What keeps the worker from being installed into `folder`, and what to do."""
    remedy = (
        Text("Free some gigabytes, or choose another folder.")
        if error.errno == errno.ENOSPC
        else Text("Stop the worker and check that you may write there, or choose another folder.")
    )
    return SculptError(
        "The worker cannot be installed in {} ({}). {}", folder, error.strerror, remedy
    )


def _claim(folder: Path) -> None:
    """Mark `folder` as ours and not yet whole; refuse one that holds anything else."""
    folder.mkdir(parents=True, exist_ok=True)
    marker = folder / _MARKER
    if not marker.is_file() and any(folder.iterdir()):
        raise SculptError(
            "{} already holds other files; choose an empty folder for the worker.", folder
        )
    free = shutil.disk_usage(folder).free
    if free < SPACE:
        raise SculptError(
            "The disk of {} has {} GB left, the worker needs {} GB while it is installed."
            " Free some, or choose another folder.",
            folder,
            f"{free / 1e9:.1f}",
            f"{SPACE / 1e9:.0f}",
        )
    marker.write_bytes(_INCOMPLETE)
    (folder / _LOG).unlink(missing_ok=True)


def _first_resolved(
    folder: Path, candidates: Iterable[Environment], progress: Progress
) -> list[str]:
    """Make in `folder` an empty environment of the first Python that can hold the worker; the
    packages that it will get."""
    reasons: dict[str, UnsuitableError] = {}
    for candidate in candidates:
        version = ".".join(map(str, candidate.version[:2]))
        if version in reasons:  # builds differ from one minor version to the next, not within one
            continue
        progress(0.0, Text("Trying Python {} ({})", version, candidate.python))
        try:
            return _resolve(folder, candidate.python, progress)
        except UnsuitableError as reason:
            reasons[version] = reason
    if not reasons:
        raise SculptError(NO_PYTHON)
    told = Text("; ".join(["Python {} {}"] * len(reasons)), *chain.from_iterable(reasons.items()))
    raise SculptError(
        "No Python here can hold the worker: {}. Name a Python that has PyTorch (in the"
        " preferences or as {}), or set PIP_EXTRA_INDEX_URL to an index with CPU builds"
        " of PyTorch and try again.",
        told,
        ENVIRONMENT_VARIABLE,
    )


def _resolve(folder: Path, python: Path, progress: Progress) -> list[str]:
    """Make a fresh environment of `python`; the exact packages that pip would install into it."""
    for entry in folder.iterdir():
        if entry.name not in (_MARKER, _LOG):
            shutil.rmtree(entry) if entry.is_dir() and not entry.is_symlink() else entry.unlink()
    report = folder / "resolved.json"
    log = folder / _LOG

    run([str(python), "-I", "-m", "venv", str(folder)], log)
    progress(_RESOLVED / 2, "Looking which packages fit")
    dry_run = ["--dry-run", "--report", str(report), "-r", str(REQUIREMENTS)]
    run([*_pip(folder), *dry_run], log)
    resolved = [entry["metadata"] for entry in json.loads(report.read_bytes())["install"]]
    if any(package["name"].lower().startswith(_CUDA) for package in resolved):
        raise UnsuitableError("would bring gigabytes of CUDA with PyTorch")
    return [f"{package['name']}=={package['version']}" for package in resolved]


def _install(folder: Path, packages: list[str], progress: Progress) -> Environment:
    """Put exactly these packages into the environment in `folder` and try it."""
    done, text = 0, "Installing"

    def on_line(line: str) -> None:
        nonlocal done, text
        done += line.startswith(("Collecting", "Processing"))  # from an index, from a folder
        if line.startswith(("Collecting", "Processing", "Downloading", "Installing")):
            text = line
        step = (_COLLECTED - _RESOLVED) / len(packages)
        fraction = _RESOLVED + step * min(done, len(packages))
        progress(fraction, text[:100])

    run([*_pip(folder), "--no-deps", *packages], folder / _LOG, on_line)
    progress(_TESTING, "Testing PyTorch")
    environment = check_python(environment_python(folder))
    if not environment.ready:
        raise SculptError(
            "The worker was installed but {}; see {}, or choose another Python.",
            lack(environment),
            folder / _LOG,
        )
    return environment


def _launch(python: Path | str, module: str, argument: str) -> list[str]:
    return [str(python), "-I", "-u", str(LAUNCH), module, argument]


def _pip(folder: Path) -> list[str]:
    """The command of pip in the environment of `folder`, up to the word install; it takes
    ready-made builds only."""
    python = str(environment_python(folder))
    options = ["--disable-pip-version-check", "--no-input", "--progress-bar", "off"]
    return [python, "-I", "-m", "pip", "install", *options, "--only-binary", ":all:"]
