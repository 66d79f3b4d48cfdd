# SPDX-License-Identifier: GPL-3.0-or-later
"""Random orders of native and neural strokes, Absorb, modes, undo and redo by keys in a window.

Each press of Ctrl Z must take back one thing, byte for byte, and each of Shift Ctrl Z bring it back
(see tests/blender/undo_orders.py). Keys and mouse are those of the virtual screen, by xdotool; the
worker is the real one.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import blenders
import environment
import screen
import stress_undo
import stress_undo_window

COUNT = 200
ROLE = "worker"
SIZE = stress_undo_window.SIZE
SCRIPT = Path(__file__).with_name("orders_in_blender.py")


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` orders: how many operations, wrong states and crashes."""
    missing = screen.why_none() or ("" if screen.has_person() else "a person needs xdotool")
    if missing:
        return {"failures": [f"Not tried: {missing}."]}
    program = blenders.first(environment.ensure_or_exit())

    def command(given: Any) -> list[str]:
        return screen.window_command(program, SCRIPT, given, simulate=False, size=SIZE)

    with screen.virtual_screen(SIZE) as on_screen:
        variables = {**program.variables, **on_screen}
        return stress_undo.play(command, variables, count, seed, report)
