# SPDX-License-Identifier: GPL-3.0-or-later
"""Orders of tests/blender/scene/undo_orders.py by a person's keys; `batches` reads what is printed.

    blender --python scripts/in_blender/start.py -- \\
        reliability.attacked.undo_orders patient|hasty FOLDER SEED FIRST COUNT

A hasty person goes on without waiting (see tests/person/hasty_orders.py), and the field takes in
native strokes by itself. With a patient one it does so in every other order, and in half of these
each of them brings another proxy when the hand rests.

FOLDER is an empty one for the extension, and NEURAL_SCULPT_PYTHON names the worker's Python. Lines
that begin with `xdotool` are run by the program that started Blender. Of an order that fails, KEPT
has a text, with what was done and Blender's history, and a picture of the window.
"""

import faulthandler
import importlib
from pathlib import Path
from typing import Any

from in_blender import simulated_input
from workshop import ROOT

from . import stressed_blender

KEPT = ROOT / "test-output" / "undo_orders"


def main(given: list[str]) -> None:
    """Let Blender step what the command line says."""
    person, folder, seed, first, count = given
    faulthandler.enable()
    simulated_input.play(orders(person, Path(folder), seed, int(first), int(count)))


def orders(person: str, folder: Path, seed: str, first: int, count: int) -> simulated_input.Steps:
    """One after another, whatever becomes of each."""
    stressed_blender.install(folder)
    stressed_blender.tell_version()
    drawing: Any = importlib.import_module("drawing")
    hands: Any = importlib.import_module("hands")
    patient: Any = importlib.import_module("undo_orders")
    hasty: Any = importlib.import_module("hasty_orders")
    case = hands.OrderCase()
    for number in range(first, first + count):
        case.setUp()
        if person == "hasty":
            case.live, of, by = True, hasty.HastyOrder, hasty.HastyHands
        else:
            case.live, of, by = bool(number % 2), patient.Order, hands.PersonHands
            case.off = number % 4 == 3
        yield simulated_input.DRAWN
        yield from case.add()
        order = of(f"{seed} {number}", by(case, number), drawing.field().name)
        print(f"sequence {number} begins", flush=True)
        try:
            yield from order.play()
        except Exception as error:  # noqa: BLE001 - whatever it is, it is what we look for
            told = f"{type(error).__name__}: {error} After {', '.join(order.told)}."
            keep(f"{person} {seed} {number}", told)
            print(f"sequence {number} fails: {' '.join(told.split())}", flush=True)
        else:
            print(f"sequence {number} ends: {len(order.told)}", flush=True)
        case.doCleanups()


def keep(name: str, told: str) -> None:
    """What there is to see of an order that has failed just now."""
    harness: Any = importlib.import_module("harness")
    steps = harness.module("blender.scene.sculpt_steps").steps()
    listed = [f"{step.kind}: {step.name}" for part in steps for step in part]
    session = harness.module("blender.session.worker_session").session
    after = f"{len(steps[0])} steps and {len(steps[1])} to redo", *listed, session.last_error
    KEPT.mkdir(parents=True, exist_ok=True)
    (KEPT / f"{name}.txt").write_text("\n".join((told, *after)) + "\n", encoding="utf-8")
    simulated_input.save_png(KEPT / f"{name}.png", simulated_input.screen_pixels())
