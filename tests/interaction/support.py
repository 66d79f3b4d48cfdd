# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of drawing by hand share. They need no Blender, and test that they do not."""

import importlib
import sys
from types import ModuleType


def module(name: str) -> ModuleType:
    """A module of the package, "interaction.drawing" for example, that imports no bpy."""
    found = importlib.import_module(f"neural_sculpt_addon.{name}")
    assert "bpy" not in sys.modules, f"{name} imports bpy"
    return found
