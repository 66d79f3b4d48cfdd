# SPDX-License-Identifier: GPL-3.0-or-later
"""Tampered .blends: every operator, and what panels draw, works on them or says why not.

What the file holds of fields and brush is mutated: other types, other values, cut and changed
bytes, missing keys. Each batch has a process of its own; what is checked is in
tampered_in_blender.py, which tries one file again:

    python scripts/tampered_in_blender.py EMPTY_FOLDER SEED NUMBER 1
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import stress_undo

COUNT = 500
ROLE = "blender"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` files: how many operators and panels were tried, what went wrong, crashes."""
    script = Path(__file__).with_name("tampered_in_blender.py")
    return stress_undo.play(
        lambda given: [sys.executable, str(script), *given], {}, count, seed, report
    )
