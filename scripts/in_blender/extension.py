# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a window, as an artist installs it: its modules, and a first field."""

import importlib
from typing import Any

import bpy

from . import simulated_input as hand
from .simulated_input import Steps

EXTENSION = "bl_ext.user_default.neural_sculpt"
SECONDS = 600  # in which a field must be there


def install(path: str, resolution: int) -> Steps:
    """Install the zip in an empty scene; proxies get so many cells per axis."""
    bpy.ops.extensions.package_install_files(
        filepath=path, repo="user_default", enable_on_install=True
    )
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield hand.DRAWN
    addon: Any = bpy.context.preferences.addons[EXTENSION]
    addon.preferences.resolution = resolution


def module(name: str) -> Any:
    """A module of it."""
    return importlib.import_module(f"{EXTENSION}.{name}")


def worker_session() -> Any:
    """What it has under way."""
    return module("blender.session.worker_session").session


def add(kind: str) -> Steps:
    """Add a ready field, and wait until it is there."""
    operators: Any = bpy.ops
    operators.neural_sculpt.add(kind=kind)
    yield from hand.until(lambda: not worker_session().jobs and bool(fields()), SECONDS, "a field")


def fields() -> list[Any]:
    """The fields of the file."""
    objects: Any = bpy.data.objects
    return [ob for ob in objects if ob.neural_sculpt.revision]
