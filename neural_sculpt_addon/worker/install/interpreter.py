# SPDX-License-Identifier: GPL-3.0-or-later
"""Which Pythons are on this computer, and whether one of them can be the worker.

Standard library only: Blender's process and the scripts ask before anything is installed. An
interpreter is never judged by its name: it is run, isolated, on a probe that imports what the
worker imports, trains one sine layer for one step and answers with one line of JSON.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ...common.child import clean_environ, no_window
from ...common.errors import SculptError
from ...common.text import Text

OLDEST = (3, 11)
NEWEST = (3, 14)
"""The Pythons for which the pinned requirements exist."""

PROBE_SECONDS = 180.0
"""A first import of torch from a cold disk, behind a virus scanner, can take a minute."""

_PROBE = """
import importlib, json, sys
missing, torch = [], None
for name in sys.argv[1:]:
    try:
        module = importlib.import_module(name)
        torch = module if name == "torch" else torch
    except Exception as error:
        missing.append(name if isinstance(error, ModuleNotFoundError) else f"{name} ({error})")
device = None
if torch is not None:
    layer = torch.nn.Linear(3, 4)
    torch.sin(30 * layer(torch.ones(2, 3))).sum().backward()
    device = "cuda" if torch.cuda.is_available() else "cpu"
print()
print(json.dumps({"version": list(sys.version_info[:3]), "device": device, "missing": missing,
                  "torch": None if torch is None else str(torch.__version__)}))
"""

_MODULES = ("torch", "numpy", "scipy", "skimage", "trimesh", "safetensors", "igl")


@dataclass(frozen=True)
class Environment:
    """A Python as the probe found it."""

    python: Path
    version: tuple[int, int, int]
    torch: str | None
    """Version of torch, None where there is none."""
    device: str | None
    """The best device torch sees here, "cuda" or "cpu"; None without torch."""
    missing: tuple[str, ...]
    """Modules of the worker that cannot be imported, with the reason where it is a strange one."""

    @property
    def ready(self) -> bool:
        """Whether the worker can run on it as it is."""
        return not self.missing and self.version[:2] >= OLDEST


def check_python(python: Path | str) -> Environment:
    """Run `python` on the probe, which imports torch: seconds, so not on Blender's main thread.

    Raises SculptError if it is no Python 3 that can be run; what it lacks is in the answer.
    """
    return _probe(Path(python), _MODULES)


def identify(python: Path | str) -> Environment:
    """As `check_python`, but quick: only the version is asked for, the rest stays empty."""
    return _probe(Path(python), ())


def lack(environment: Environment) -> Text:
    """What keeps an environment from being ready, as the end of a sentence."""
    if environment.version[:2] < OLDEST:
        found, oldest = (".".join(map(str, v[:2])) for v in (environment.version, OLDEST))
        return Text("is Python {}, older than {}", found, oldest)
    return Text("lacks {}", ", ".join(environment.missing))


def candidate_pythons() -> Iterator[Environment]:
    """Interpreters that could hold the worker, in the order of `present_pythons`.

    What does not run or is too old or too new is left out. Lazy, for every step runs a process.
    Each is identified only, not checked.
    """
    for python in present_pythons():
        try:
            environment = identify(python)
        except SculptError:
            continue
        if OLDEST <= environment.version[:2] <= NEWEST:
            yield environment


def present_pythons() -> Iterator[Path]:
    """Interpreters by their names: this one, then its own version, then newest first.

    One for each place it is found in. Only looks at files, so one may turn out not to run.
    """
    here = sys.version_info[:2]
    minors = range(NEWEST[1], OLDEST[1] - 1, -1)
    versions = sorted(((3, minor) for minor in minors), key=lambda version: version != here)
    seen: set[Path] = set()
    for python in _named_pythons(versions):
        if python.is_file() and python.resolve() not in seen:
            seen.add(python.resolve())
            yield python


def _named_pythons(versions: Iterable[tuple[int, int]]) -> Iterator[Path]:
    """Where a Python may lie: here, on the PATH, where installers put them; files or not."""
    if Path(sys.executable or "").stem.lower().startswith("python"):  # a Blender may stand there
        yield Path(sys.executable)
    suffix = ".exe" if os.name == "nt" else ""
    folders = [Path(folder) for folder in os.get_exec_path() if os.path.isabs(folder)]
    folders += [Path("/usr/local/bin"), Path("/opt/homebrew/bin")]  # a Mac's apps lack them
    homes = _installations()
    for major, minor in versions:
        yield from (folder / f"python{major}.{minor}{suffix}" for folder in folders)
        for home in homes:  # .../3.13.0/bin/python3.13, and on Windows ...\Python313\python.exe
            yield home / "bin" / f"python{major}.{minor}"
            if home.name.replace(".", "").startswith(f"Python{major}{minor}"):
                yield home / "python.exe"
    yield from (folder / f"{name}{suffix}" for folder in folders for name in ("python3", "python"))


def _installations() -> list[Path]:
    """Folders that may each hold one Python: the neighbours of this one, newest name first."""
    parents = [Path(sys.base_prefix).parent, Path.home() / ".pyenv" / "versions"]
    if local := os.environ.get("LOCALAPPDATA"):
        parents.append(Path(local) / "Programs" / "Python")
    return [home for parent in parents for home in sorted(parent.glob("*"), reverse=True)]


def _probe(python: Path, modules: Iterable[str]) -> Environment:
    command = [str(python), "-I", "-c", _PROBE, *modules]
    try:
        ran = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=PROBE_SECONDS,
            env=clean_environ(),
            creationflags=no_window(),
            check=False,
        )
        answer = json.loads(ran.stdout.splitlines()[-1])
        return Environment(
            python,
            tuple(answer["version"]),
            answer["torch"],
            answer["device"],
            tuple(answer["missing"]),
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SculptError("{} cannot be run ({}); choose another Python.", python, error) from error
    except (ValueError, IndexError, KeyError, TypeError) as error:
        raise SculptError(
            "{} did not answer as a Python 3 does; choose another Python.", python
        ) from error
