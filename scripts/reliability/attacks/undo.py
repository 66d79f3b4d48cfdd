# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of 20 operations and more on two fields and linked duplicates, undo among them.

Strokes, edit dialogs, Blender's own tools in each mode, Absorb and results that come late, with a
toy worker; after each operation weights and meshes must be what the history says (see
tests/blender/scene/undo_sequences.py). A batch has a process of its own, and a crash is a failure
of the sequence that it was in. One sequence again, here with seed 1 and number 17:

    python scripts/in_blender/start.py reliability.attacked.undo_sequences module FOLDER 1 17 1
"""

from collections.abc import Callable
from typing import Any

from .. import batches

COUNT = 1000
ROLE = "blender"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` sequences: how many operations, wrong states and crashes."""
    return batches.in_module(["undo_sequences", "module"], count, seed, report)
