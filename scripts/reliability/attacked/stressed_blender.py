# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender for attacks: the extension installed as an artist does, and the tests' harness."""

import importlib
import os
import sys
from pathlib import Path
from typing import Any

from workshop import ROOT


def install(folder: Path) -> Any:
    """Install the sources into a user folder under `folder`; the harness of tests/blender.

    Once in a process, before anything imports bpy. Modules of tests/blender, tests/window and
    tests/person can be imported then.
    """
    os.environ["BLENDER_USER_RESOURCES"] = str(folder)
    sys.path.insert(0, str(ROOT / "tests"))
    suite = importlib.import_module("suite")
    suite.make_importable("blender", "window", "person")
    import bpy

    operators: Any = bpy.ops
    operators.extensions.package_install_files(
        filepath=str(suite.pack(folder)), repo="user_default", enable_on_install=True
    )
    return importlib.import_module("harness")


def tell_version() -> None:
    """Print a line that `batches` reads."""
    import bpy

    print(f"version {bpy.app.version_string}", flush=True)
