# SPDX-License-Identifier: GPL-3.0-or-later
"""The same sequences in a Blender with a window: undo, redo and Esc are keys, and all is drawn.

That is the first Blender which scripts/workshop/blenders.py finds, on a virtual screen.
"""

from collections.abc import Callable
from typing import Any

from .. import batches

COUNT = 200
ROLE = "worker"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` sequences: how many operations, wrong states and crashes."""
    return batches.in_window(["undo_sequences", "window"], count, seed, report)
