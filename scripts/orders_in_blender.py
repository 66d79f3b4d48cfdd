# SPDX-License-Identifier: GPL-3.0-or-later
"""Play random orders of tests/blender/undo_orders.py by a person's keys; for `stress_undo_keys`.

    blender --python scripts/orders_in_blender.py -- FOLDER SEED FIRST COUNT

FOLDER is an empty one for the extension, and NEURAL_SCULPT_PYTHON names the worker's Python. What
started Blender does the lines that begin with `xdotool`.
"""

import faulthandler
import importlib
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import simulated_input
import stressed_blender


def orders(folder: Path, seed: str, first: int, count: int) -> simulated_input.Steps:
    """One after another, whatever becomes of each."""
    stressed_blender.install(folder)
    stressed_blender.tell_version()
    sys.path.insert(0, str(Path(stressed_blender.__file__).parents[1] / "tests" / "window"))
    drawing: Any = importlib.import_module("drawing")
    undo_orders: Any = importlib.import_module("undo_orders")
    person: Any = importlib.import_module("test_person")
    case = person.Person()
    for number in range(first, first + count):
        case.setUp()
        yield simulated_input.DRAWN
        yield from case.add()
        hands = person.PersonHands(case, number)
        order = undo_orders.Order(f"{seed} {number}", hands, drawing.field().name)
        print(f"sequence {number} begins", flush=True)
        try:
            yield from order.play()
        except Exception as error:  # noqa: BLE001 - whatever it is, it is what we look for
            told = f"{type(error).__name__}: {error} After {', '.join(order.told)}."
            print(f"sequence {number} fails: {' '.join(told.split())}", flush=True)
        else:
            print(f"sequence {number} ends: {len(order.told)}", flush=True)
        case.doCleanups()


faulthandler.enable()
_folder, _seed, _first, _count = sys.argv[sys.argv.index("--") + 1 :]
simulated_input.play(orders(Path(_folder), _seed, int(_first), int(_count)))
