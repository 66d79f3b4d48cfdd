# SPDX-License-Identifier: GPL-3.0-or-later
"""The same sequences in a Blender with a window: undo, redo and Esc are keys, and all is drawn.

That is the first Blender which scripts/blenders.py finds, on a virtual screen.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import blenders
import environment
import screen
import stress_undo

COUNT = 200
ROLE = "worker"
SIZE = 640, 480  # pixels, few of them, for a processor draws them


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` sequences: how many operations, wrong states and crashes."""
    if missing := screen.why_none():
        return {"failures": [f"Not tried: {missing}."]}
    program = blenders.first(environment.ensure_or_exit())
    script = Path(stress_undo.SCRIPT)

    def command(given: Any) -> list[str]:
        return screen.window_command(program, script, ["window", *given], size=SIZE)

    with screen.virtual_screen(SIZE) as on_screen:
        variables = {**program.variables, **on_screen}
        return stress_undo.play(command, variables, count, seed, report)
