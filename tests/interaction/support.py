# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of drawing by hand share. They need no Blender, and test that they do not."""

import importlib
import sys
from types import ModuleType

import numpy as np


def module(name: str) -> ModuleType:
    """A module of the package, "interaction.drawing" for example, that imports no bpy."""
    found = importlib.import_module(f"neural_sculpt_addon.{name}")
    assert "bpy" not in sys.modules, f"{name} imports bpy"
    return found


def to_path(points: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Distances (N,) of points (N, 3) from a polyline (K, 3)."""
    start, along = path[:-1], np.diff(path, axis=0)  # (K - 1, 3)
    offset = points[:, None] - start  # (N, K - 1, 3)
    t = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0, 1)  # (N, K - 1)
    return np.linalg.norm(offset - t[..., None] * along, axis=-1).min(1)
