# SPDX-License-Identifier: GPL-3.0-or-later
"""Random orders of strokes, modes, undo and redo by keys in a window that wait for no result.

The worker stops and goes on meanwhile. Each press of Ctrl Z must take back one thing all the same,
and each of Shift Ctrl Z bring it back; and what comes in must be the same, byte for byte, whichever
way has led to it (see tests/person/hasty_orders.py).
"""

from collections.abc import Callable
from typing import Any

from .. import batches

COUNT = 100
ROLE = "worker"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` orders: how many operations, wrong states and crashes."""
    return batches.in_window(["undo_orders", "hasty"], count, seed, report, simulate=False)
