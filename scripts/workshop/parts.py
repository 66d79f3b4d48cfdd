# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of the tests: the command of each, and what its output says of passed and failed.

Standard library only.
"""

import os
import re
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from neural_sculpt_addon.common.child import exit_in_words
from neural_sculpt_addon.worker.install.environment import ENVIRONMENT_VARIABLE

from . import ROOT, blenders, commands, failures, screen
from .environment import Workshop
from .failures import Failure
from .lanes import Outcome, Part, Run, Show
from .virtualenv import version_of

BLENDER_TESTS = ROOT / "tests" / "run_in_blender.py"
WINDOW_TESTS = ROOT / "tests" / "run_in_window.py"
WINDOW_PICTURES = ROOT / "test-output" / "window"
CHECK_SECONDS = 600
PART_SECONDS = 4500
"""Limit of a part, which is ended as one that hangs. The longest of --all, pytest, takes 2500 on a
slow computer, beside the others."""

CRASHES = {signal.SIGABRT, signal.SIGFPE, signal.SIGILL, signal.SIGSEGV}
SHORT = "--short"
"""Given to what runs tests in Blender: without those that are marked as long."""
SHORT_PYTEST = ("-m", "not long")
PROCESSES = ("-n", "2", "--dist", "worksteal")  # halves, so a module's fixtures serve it
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""For each of several processes: their threads would wait for each other's cores."""

PATIENT = ("nice", "-n", "5") if shutil.which("nice") else ()
"""Prefix of commands that run beside a window, whose input must not wait for them."""

Read = Callable[[Sequence[str]], list[Failure]]


def checks(workshop: Workshop) -> Iterator[Part]:
    """Types, style and the rule of the doors."""
    tool = str(workshop.worker)
    linter = workshop.worker.with_name("lint-imports" + (".exe" if os.name == "nt" else ""))
    yield _check("basedpyright", [tool, "-m", "basedpyright", "--pythonpath", tool])
    yield _check("ruff check", [tool, "-m", "ruff", "check", "."])
    yield _check("ruff format", [tool, "-m", "ruff", "format", "--check", "."])
    yield _check("import-linter", [str(linter)])


def demo(workshop: Workshop) -> Part:
    """The demo, from Suzanne to the .blend."""
    return _check("demo", [str(workshop.blender), str(ROOT / "scripts" / "demo.py")])


def _check(name: str, command: Sequence[str]) -> Part:
    """A command that passes when its exit code says so."""

    def work(show: Show, run: Run = commands.run) -> Outcome:
        code, lines, seconds = run([*PATIENT, *command], {}, CHECK_SECONDS, show)
        note = _too_long(seconds, CHECK_SECONDS)
        return Outcome(name, int(code == 0), int(code != 0), 0, seconds, note, printed=lines)

    return Part(name, work)


def pytest(
    workshop: Workshop,
    arguments: Sequence[str],
    variables: Mapping[str, str] | None = None,
    prefix: Sequence[str] = (),
) -> Part:
    """The tests that need no Blender; `prefix` comes before the command, as PATIENT."""
    name = f"pytest, Python {version_of(workshop.worker)}"
    command = [*prefix, str(workshop.worker), "-m", "pytest", *arguments]
    variables = {ENVIRONMENT_VARIABLE: str(workshop.worker), **(variables or {})}

    def work(show: Show, run: Run = commands.run) -> Outcome:
        code, lines, seconds = run(command, variables, PART_SECONDS, show)
        summary = next((line for line in reversed(lines) if re.search(r" in [\d.:]+", line)), "")
        count = {word: int(number) for number, word in re.findall(r"(\d+) ([a-z]+)", summary)}
        failed = count.get("failed", 0) + count.get("error", 0) + count.get("errors", 0)
        skipped = count.get("skipped", 0) + count.get("xfailed", 0)
        return Outcome(
            name,
            count.get("passed", 0),
            failed or int(code != 0),
            skipped,
            seconds,
            _too_long(seconds, PART_SECONDS),
            failures.of_pytest(lines),
            lines,
        )

    return Part(name, work)


def wheel(workshop: Workshop, version: str, python: Path, extension: Path, *given: str) -> Part:
    """The tests of Blender's side in a Blender that pip has installed beside `python`."""
    command = [*PATIENT, str(python), str(BLENDER_TESTS), "--", str(extension), *given]
    variables = {ENVIRONMENT_VARIABLE: str(workshop.worker)}
    return _in_blender(f"Blender {version} (bpy)", command, variables)


def installed(program: blenders.Program, extension: Path, *given: str) -> Part:
    """The same in a Blender that is a program of this computer."""
    if program.missing:
        return left_out(program.name, program.missing, program.named)
    command = [
        *PATIENT,
        *program.command,
        *("--background", "--factory-startup", "--python-exit-code", "1"),
        *("--python", str(BLENDER_TESTS), "--", str(extension), *given),
    ]
    return _in_blender(program.name, command, program.variables)


def windows(program: blenders.Program, extension: Path, *more: str) -> Iterator[Part]:
    """The tests that draw in its window on a virtual screen: by simulated input; as a person."""
    name = f"window of {program.name}"
    if program.missing:
        yield left_out(name, program.missing, program.named)
        return
    pictures = WINDOW_PICTURES / re.sub(r"\W+", "-", program.name).strip("-").lower()
    for by, simulate in (("", True), (", a person", False)):
        given = [str(extension), str(pictures), *more]
        command = screen.window_command(program, WINDOW_TESTS, given, simulate)
        if not simulate and not screen.has_person():
            yield left_out(name + by, "no xdotool (Debian, Ubuntu: apt-get install xdotool)")
        else:
            yield _on_screen(name + by, command, program.variables)


def left_out(name: str, reason: str, fails: bool = False) -> Part:
    """A part that cannot run here, which is a failure or is not."""

    def work(show: Show, _run: Run = commands.run) -> Outcome:
        outcome = Outcome(name, failed=int(fails), note=f"left out: {reason}")
        show(outcome.note)
        return outcome

    return Part(name, work)


def _on_screen(name: str, command: Sequence[str], variables: Mapping[str, str]) -> Part:
    """Tests in a window, on a virtual screen of their own."""

    def work(show: Show, run: Run = commands.run) -> Outcome:
        with screen.virtual_screen() as on_screen:
            part = _in_blender(
                name, command, {**variables, **on_screen}, PART_SECONDS, failures.of_window
            )
            return part.work(show, run)

    return Part(name, work)


def _in_blender(
    name: str,
    command: Sequence[str],
    variables: Mapping[str, str],
    limit: float = PART_SECONDS,
    read: Read = failures.of_unittest,
) -> Part:
    """The tests in a Blender; once more when it crashed, which is told in the table."""

    def once(show: Show, run: Run) -> tuple[Outcome, int]:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as user:
            own = {**variables, "BLENDER_USER_RESOURCES": user}
            code, lines, seconds = run(command, own, limit, show)
        return _of_blender(name, code, lines, seconds, limit, read), code

    def work(show: Show, run: Run = commands.run) -> Outcome:
        first, code = once(show, run)
        if -code not in CRASHES:
            return first
        show(f"\n{name} crashed, and runs again:")
        again, _ = once(show, run)
        notes = [f"the first time {first.note}; its stack is above", again.note]
        return replace(again, note="; ".join(filter(None, notes)))

    return Part(name, work)


def _of_blender(
    name: str, code: int, lines: Sequence[str], seconds: float, limit: float, read: Read
) -> Outcome:
    """What the last line says, unless the process ended before it."""
    pattern = re.compile(r"Blender \S+: (\d+) passed, (\d+) failed, (\d+) skipped")
    found = next((match for line in reversed(lines) if (match := pattern.search(line))), None)
    failed = read(lines)
    if found is None:
        note = _too_long(seconds, limit) or f"it ended without a result, {exit_in_words(code)}"
        return Outcome(name, 0, 1, 0, seconds, note, failed, lines)
    passed, count, skipped = map(int, found.groups())
    return Outcome(name, passed, count or int(code != 0), skipped, seconds, "", failed, lines)


def _too_long(seconds: float, limit: float) -> str:
    return f"it was ended after {limit:.0f} s" if seconds > limit else ""
