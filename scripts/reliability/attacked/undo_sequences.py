# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences of tests/blender/scene/undo_sequences.py; `batches` reads what is printed.

    python scripts/in_blender/start.py \\
        reliability.attacked.undo_sequences module FOLDER SEED FIRST COUNT   (a Python with bpy)
    blender --enable-event-simulate --python scripts/in_blender/start.py -- \\
        reliability.attacked.undo_sequences window FOLDER SEED FIRST COUNT

FOLDER is an empty one for the extension, and NEURAL_SCULPT_PYTHON names the worker's Python.
"""

import faulthandler
import importlib
import logging
import os
import time
from pathlib import Path
from typing import Any
from unittest.mock import patch

from . import stressed_blender


def window_hands(undo_sequences: Any) -> Any:
    """What an artist does, by keys in the window."""
    import bpy
    from in_blender import simulated_input

    drawing: Any = importlib.import_module("drawing")

    class WindowHands(undo_sequences.Hands):
        def undo(self) -> simulated_input.Steps:
            yield from drawing.undo()

        def redo(self) -> simulated_input.Steps:
            yield from drawing.redo()

        def escape(self) -> simulated_input.Steps:
            yield simulated_input.DRAWN
            simulated_input.tap("ESC", drawing.middle())
            yield simulated_input.DRAWN

        def context(self) -> Any:
            area, region = simulated_input.view_area(), simulated_input.region()
            return bpy.context.temp_override(
                window=simulated_input.window(), area=area, region=region
            )

    return WindowHands()


def sequences(where: str, folder: Path, seed: str, first: int, count: int) -> Any:
    """One after another, whatever becomes of each; a generator as `Sequence.play`."""
    harness = stressed_blender.install(folder)
    stressed_blender.tell_version()
    undo_sequences: Any = importlib.import_module("undo_sequences")
    hands = undo_sequences.Hands() if where == "module" else window_hands(undo_sequences)
    harness.SteeredCase.setUpClass()
    case = harness.SteeredCase()
    harness.SculptCase.setUp(case)
    case.folder = case.heard
    logging.disable(logging.WARNING)  # what is said to the artist
    with patch.object(
        case.session.watcher, "work_came", lambda: None
    ):  # results come when it is their turn
        for number in range(first, first + count):
            sequence = undo_sequences.Sequence(case, f"{seed} {number}", hands)
            print(f"sequence {number} begins", flush=True)
            try:
                yield from sequence.play()
            except Exception as error:  # noqa: BLE001 - whatever it is, it is what we look for
                told = f"{type(error).__name__}: {error} After {', '.join(sequence.told)}."
                print(f"sequence {number} fails: {' '.join(told.split())}", flush=True)
                case.session.stop()
            else:
                did = " ".join(f"{word} {n}" for word, n in sequence.took_effect.items() if n)
                print(f"sequence {number} ends: {len(sequence.told)} {did}", flush=True)
    case.doCleanups()
    harness.SteeredCase.doClassCleanups()


def main(given: list[str]) -> None:
    """Play what the command line says, in a window step by step."""
    where, folder, seed, first, count = given
    faulthandler.enable()
    steps = sequences(where, Path(folder), seed, int(first), int(count))
    if where == "window":
        from in_blender import simulated_input

        simulated_input.play(steps)
        return
    for seconds in steps:
        time.sleep(seconds)
    os._exit(0)  # some Blenders hang in a regular exit of their Python module
