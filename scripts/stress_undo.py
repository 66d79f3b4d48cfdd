# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of 20 operations and more on two fields and linked duplicates, undo among them.

Strokes, edit dialogs, Blender's own tools in each mode, Absorb and results that come late, with a
toy worker; after each operation weights and meshes must be what the history says (see
tests/blender/undo_sequences.py). A batch has a process of its own, and a crash is a failure of the
sequence that it was in. One sequence again, here with seed 1 and number 17:

    python scripts/sequences_in_blender.py -- module EMPTY_FOLDER 1 17 1
"""

import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import screen

COUNT = 1000
ROLE = "blender"
BATCH = 50
LONGEST = 3600  # seconds of a batch
SCRIPT = Path(__file__).with_name("sequences_in_blender.py")

Command = Callable[[Sequence[str]], Sequence[str]]
"""From the arguments of SCRIPT."""


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` sequences in Blender as a module: how many operations, wrong states and crashes."""
    command = [sys.executable, str(SCRIPT), "--", "module"]
    return play(lambda given: [*command, *given], {}, count, seed, report)


def play(
    command: Command,
    variables: Mapping[str, str],
    count: int,
    seed: int,
    report: Callable[[str], None],
) -> dict[str, Any]:
    """Sequences in batches by a Blender; after a crash the next batch goes on behind it."""
    totals = {"operations": 0, "wrong": 0, "crashes": 0}
    took_effect: Counter[str] = Counter()
    failures: list[str] = []
    versions: dict[str, str] = {}
    number = 0
    while number < count:
        size = min(BATCH, count - number)
        lines, ended = _batch(command, variables, [str(seed), str(number), str(size)])
        current = None
        for line in lines:
            word, _, rest = line.partition(" ")
            if word == "version":
                versions["Blender"] = rest
                continue
            current, _, said = rest.partition(" ")
            if said.startswith("ends: "):
                operations, *did = said.removeprefix("ends: ").split()
                totals["operations"] += int(operations)
                took_effect.update(dict(zip(did[::2], map(int, did[1::2]), strict=True)))
            elif said.startswith("fails: "):
                totals["wrong"] += 1
                failures.append(f"{seed} {current}: {said.removeprefix('fails: ')}")
        whole = lines and current == str(number + size - 1) and not lines[-1].endswith("begins")
        if whole:
            number += size
        else:
            totals["crashes"] += 1
            at = number if current is None else int(current)
            failures.append(f"{seed} {at}: Blender {ended}")
            number = at + 1
        report(f"{number} sequences, {totals}")
    ordered = dict(sorted(took_effect.items()))
    return {**totals, "took_effect": ordered, "versions": versions, "failures": failures}


def _batch(
    command: Command, variables: Mapping[str, str], given: Sequence[str]
) -> tuple[list[str], str]:
    """The lines that told about sequences, and how the process ended."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        own = {**variables, "BLENDER_USER_RESOURCES": folder}
        given = command([folder, *given])
        code, printed, seconds = screen.run(given, own, LONGEST, show=lambda _: None)
    lines = [line for line in printed if line.startswith(("sequence ", "version "))]
    if seconds > LONGEST:
        return lines, f"hung for {LONGEST} s"
    return lines, f"ended with {signal.Signals(-code).name if code < 0 else code}"
