# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of random sequences: each in a Blender of its own, read from the lines that it prints.

    version VERSION
    sequence NUMBER begins
    sequence NUMBER ends: OPERATIONS [NAME COUNT ...]
    sequence NUMBER fails: SENTENCE

A crash is a failure of the sequence that it was in.
"""

import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from in_blender import START
from workshop import blenders, commands, environment, screen

BATCH = 50
LONGEST = 3600  # seconds of a batch
SIZE = 640, 480  # pixels of a window, few of them, for a processor draws them

Report = Callable[[str], None]


def in_module(name: Sequence[str], count: int, seed: int, report: Report) -> dict[str, Any]:
    """`count` sequences in Blender as a module: how many operations, wrong states and crashes.

    name: of a module of `attacked`, and what it is given before FOLDER SEED FIRST COUNT
    """
    return _play([sys.executable, str(START), *_module(name)], {}, count, seed, report)


def in_window(
    name: Sequence[str], count: int, seed: int, report: Report, simulate: bool = True
) -> dict[str, Any]:
    """The same in the window of the first Blender that there is, on a virtual screen.

    simulate: whether input comes from Blender's own simulation, or else from xdotool
    """
    missing = screen.why_none()
    if not simulate and not screen.has_person():
        missing = missing or "a person needs xdotool"
    if missing:
        return {"failures": [f"Not tried: {missing}."]}
    program = blenders.first(environment.ensure_or_exit())
    command = screen.window_command(program, START, _module(name), simulate, SIZE)
    with screen.virtual_screen(SIZE) as on_screen:
        return _play(command, {**program.variables, **on_screen}, count, seed, report)


def _module(name: Sequence[str]) -> list[str]:
    return [f"reliability.attacked.{name[0]}", *name[1:]]


def _play(
    command: Sequence[str],
    variables: Mapping[str, str],
    count: int,
    seed: int,
    report: Report,
) -> dict[str, Any]:
    """Sequences in batches by a Blender; after a crash the next batch goes on behind it."""
    totals = {"operations": 0, "wrong": 0, "crashes": 0}
    took_effect: Counter[str] = Counter()
    failures: list[str] = []
    versions: dict[str, str] = {}
    number = 0
    while number < count:
        size = min(BATCH, count - number)
        given = [str(seed), str(number), str(size)]
        lines, ended = _batch(command, variables, given, report)
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
    command: Sequence[str], variables: Mapping[str, str], given: Sequence[str], report: Report
) -> tuple[list[str], str]:
    """The lines that told about sequences, and how the process ended. Failures are told at once."""

    def show(line: str) -> None:
        if line.startswith("sequence ") and " fails: " in line:
            report(line)

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        own = {**variables, "BLENDER_USER_RESOURCES": folder}
        code, printed, seconds = commands.run([*command, folder, *given], own, LONGEST, show)
    lines = [line for line in printed if line.startswith(("sequence ", "version "))]
    if seconds > LONGEST:
        return lines, f"hung for {LONGEST} s"
    return lines, f"ended with {signal.Signals(-code).name if code < 0 else code}"
