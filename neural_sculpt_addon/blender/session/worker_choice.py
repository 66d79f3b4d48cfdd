# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python that runs the worker, and the device that it sculpts on: how the worker is started.

An artist's own Python comes first, named in the preferences or by an environment variable; then the
environment that *Install Worker* has made.
"""

import os
from pathlib import Path

import bpy

from ...common.errors import SculptError
from ...worker.install import environment
from .. import preferences
from ..folders import environment_folder


def python() -> Path:
    """The worker's interpreter. SculptError when there is none."""
    named = bpy.path.abspath(preferences.named_python())
    return environment.configured_python(named, environment_folder())


def command() -> list[str]:
    """What starts the worker. SculptError when there is no interpreter for it."""
    return environment.worker_command(python(), preferences.device())


def has_worker() -> bool:
    """Whether there is an interpreter for the worker."""
    try:
        python()
    except SculptError:
        return False
    return True


def lacks_worker() -> bool:
    """Whether no interpreter is named for the worker, and none is installed."""
    if preferences.named_python() or os.environ.get(environment.ENVIRONMENT_VARIABLE):
        return False
    return not environment.installed(environment_folder())
