# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the extension keeps its own files; they outlive its updates."""

import os
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

import bpy

from . import ADDON


def user_folder() -> Path:
    """The folder that Blender gives the extension."""
    try:
        return Path(bpy.utils.extension_path_user(ADDON, create=True))
    except ValueError:  # registered from a source tree, by a script or a test
        return private_folder()


@cache
def private_folder() -> Path:
    """A temporary folder of this user alone: the same one each time, unless somebody else has taken
    its name."""
    user = os.getuid() if hasattr(os, "getuid") else 0  # on Windows each user has another place
    path = Path(tempfile.gettempdir()) / f"neural_sculpt-{user}"
    with suppress(FileExistsError):
        path.mkdir(mode=0o700)
    found = path.lstat()
    private = os.name == "nt" or (found.st_uid == user and not found.st_mode & 0o077)
    if private and stat.S_ISDIR(found.st_mode):
        return path
    return Path(tempfile.mkdtemp(prefix="neural_sculpt-"))


def environment_folder() -> Path:
    """The folder of the environment that Install makes."""
    return user_folder() / "environment"


def log_file() -> Path:
    """The worker's log; it does not exist before the worker is first started."""
    return user_folder() / "worker.log"


def installation_log() -> Path:
    """Progress of the installation of the worker; it does not exist before the first
    installation."""
    return user_folder() / "installation.log"


def preset_folder() -> Path:
    """The artist's own presets, one file each; it does not exist before the first is saved."""
    return user_folder() / "presets"
