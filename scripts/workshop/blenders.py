# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blenders of this computer that can run as programs, and so can open a window.

Those that the environment variable BLENDER names, or else the one on the PATH; and those that
../shared/tools/real-blender.sh provides. Standard library only.
"""

import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from neural_sculpt_addon.worker.install.environment import ENVIRONMENT_VARIABLE

from . import ROOT
from .environment import Workshop
from .virtualenv import home_of

REAL_BLENDER = ROOT.parent / "shared" / "tools" / "real-blender.sh"
SUITES = {"sid": "5.2", "trixie": "4.3"}


@dataclass(frozen=True)
class Program:
    """A Blender: what to put before its arguments. `missing` says why there is none after all.

    version: as bpy wheels are named, where it is known
    """

    name: str
    command: tuple[str, ...] = ()
    variables: Mapping[str, str] = field(default_factory=dict)
    missing: str = ""
    named: bool = False
    """Whether a person asked for it, so that it is a failure when it cannot run."""
    version: str = ""


def programs(workshop: Workshop) -> Iterator[Program]:
    """All Blenders that there are or could be, in the order in which to try them."""
    yield from _installed(workshop)
    for suite in SUITES:
        yield _debian(suite, workshop)


def first(workshop: Workshop) -> Program:
    """The first of them that there is; ends this program where there is none."""
    for program in programs(workshop):
        if not program.missing:
            return program
    sys.exit("There is no Blender with a window here; name one in the variable BLENDER.")


def _installed(workshop: Workshop) -> Iterator[Program]:
    variables = {ENVIRONMENT_VARIABLE: str(workshop.worker)}
    named = [name for name in os.environ.get("BLENDER", "").split(os.pathsep) if name]
    for path in named:
        missing = "" if shutil.which(path) else "the variable BLENDER names it, but it cannot run"
        yield Program(f"Blender ({path})", (path,), variables, missing, named=True)
    if named:
        return
    if path := shutil.which("blender"):
        yield Program(f"Blender ({path})", (path,), variables)
    else:
        yield Program("installed Blender", missing="none on the PATH or in the variable BLENDER")


def _debian(suite: str, workshop: Workshop) -> Program:
    """Debian's Blender, in a folder of its own."""
    name, home = f"Blender {SUITES[suite]} (Debian {suite})", home_of(workshop.worker)
    if not REAL_BLENDER.exists():
        return Program(name, missing=f"there is no {os.path.relpath(REAL_BLENDER, ROOT)}")
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        return Program(name, missing="it takes root")
    if home == Path("/usr"):
        return Program(name, missing=f"the worker's Python, of {home}, is not seen in its folder")
    environment = workshop.worker.parents[1].resolve()  # .venv may be a link that leads out of ROOT
    variables = {
        ENVIRONMENT_VARIABLE: str(workshop.worker),
        "REAL_BLENDER_SUITE": suite,
        "REAL_BLENDER_BIND": os.pathsep.join(map(str, (ROOT, home, environment))),
    }
    command = ("bash", str(REAL_BLENDER), "exec", "--", "blender")
    return Program(name, command, variables, version=SUITES[suite])
