# SPDX-License-Identifier: GPL-3.0-or-later
"""Tampered .blends: every operator, and what panels draw, works on them or says why not.

What the file holds of fields and brush is mutated: other types, other values, cut and changed
bytes, missing keys. Each batch has a process of its own; what is checked is in
attacked/tampered.py, which tries one file again:

    python scripts/in_blender/start.py reliability.attacked.tampered EMPTY_FOLDER SEED NUMBER 1
"""

from collections.abc import Callable
from typing import Any

from .. import batches

COUNT = 500
ROLE = "blender"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` files: how many operators and panels were tried, what went wrong, crashes."""
    return batches.in_module(["tampered"], count, seed, report)
