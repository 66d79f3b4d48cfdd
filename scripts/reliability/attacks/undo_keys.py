# SPDX-License-Identifier: GPL-3.0-or-later
"""Random orders of native and neural strokes, Absorb, modes, undo and redo by keys in a window.

Each press of Ctrl Z must take back one thing, byte for byte, and each of Shift Ctrl Z bring it back
(see tests/blender/scene/undo_orders.py). Keys and mouse are those of the virtual screen, by
xdotool; the worker is the real one.
"""

from collections.abc import Callable
from typing import Any

from .. import batches

COUNT = 200
ROLE = "worker"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` orders: how many operations, wrong states and crashes."""
    return batches.in_window(["undo_orders", "patient"], count, seed, report, simulate=False)
