# SPDX-License-Identifier: GPL-3.0-or-later
"""Every check and test of the project: python3 scripts/test.py.

First the checks (ruff, basedpyright, import-linter), then pytest in the Python that has torch, then
the demo, then the tests of Blender's side in every Blender this computer can have: the bpy wheels,
each in a virtual environment of its own; the Blenders named in the environment variable BLENDER or
found on the PATH; and those that ../shared/tools/real-blender.sh provides. The last two also run
the tests that draw in a window, whose pictures go to test-output/window/. A part that fails does
not keep the later ones from running. Ends with a table and the line "N passed, N failed, N
skipped". Standard library only.

    --quick            only the Blender of the project's own environment, and no demo
    --blender 4.5      only this Blender, and neither the checks nor pytest
    --window           only the tests in a window
    anything else      goes to pytest, and only pytest runs
"""

import argparse
import os
import re
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import blenders
import build_extension
import environment
import screen
from environment import ROOT, Workshop
from virtualenv import say, version_of

from neural_sculpt_addon.stroke.errors import SculptError
from neural_sculpt_addon.worker.ending import exit_in_words
from neural_sculpt_addon.worker.install.environment import ENVIRONMENT_VARIABLE

BLENDER_TESTS = ROOT / "tests" / "run_in_blender.py"
WINDOW_TESTS = ROOT / "tests" / "run_in_window.py"
WINDOW_PICTURES = ROOT / "test-output" / "window"
PYTEST_SECONDS = 2400
BLENDER_SECONDS = 900
WINDOW_SECONDS = 1500
LAST_LINES = 60  # of a part that failed, shown again at the end
CRASHES = {signal.SIGABRT, signal.SIGFPE, signal.SIGILL, signal.SIGSEGV}


@dataclass(frozen=True)
class Outcome:
    """What one part of the tests came to.

    note:    why it did not run, or not to its end
    printed: its lines, so that those of a failure can be shown again at the end
    """

    name: str
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    seconds: float = 0.0
    note: str = ""
    printed: Sequence[str] = ()


def checks(workshop: Workshop) -> Iterator[Outcome]:
    """Style, types and the rule of the doors."""
    tool = str(workshop.worker)
    yield _check("ruff check", [tool, "-m", "ruff", "check", "."])
    yield _check("ruff format", [tool, "-m", "ruff", "format", "--check", "."])
    yield _check("basedpyright", [tool, "-m", "basedpyright", "--pythonpath", tool])
    linter = workshop.worker.with_name("lint-imports" + (".exe" if os.name == "nt" else ""))
    yield _check("import-linter", [str(linter)])


def _check(name: str, command: Sequence[str]) -> Outcome:
    """A command that passes when its exit code says so."""
    code, lines, seconds = _run(name, command, 600)
    return Outcome(name, int(code == 0), int(code != 0), seconds=seconds, printed=lines)


def pytest(workshop: Workshop, arguments: Sequence[str]) -> Outcome:
    """The tests of stroke, field, worker and scripts."""
    name = f"pytest, Python {version_of(workshop.worker)}"
    command = [str(workshop.worker), "-m", "pytest", *arguments]
    code, lines, seconds = _run(name, command, PYTEST_SECONDS, _variables(workshop))
    summary = next((line for line in reversed(lines) if re.search(r" in [\d.:]+", line)), "")
    count = {word: int(number) for number, word in re.findall(r"(\d+) ([a-z]+)", summary)}
    failed = count.get("failed", 0) + count.get("error", 0) + count.get("errors", 0)
    skipped = count.get("skipped", 0) + count.get("xfailed", 0)
    failed = failed or int(code != 0)
    return Outcome(name, count.get("passed", 0), failed, skipped, seconds, printed=lines)


def demo(workshop: Workshop) -> Outcome:
    """The demo, from Suzanne to the .blend."""
    return _check("demo", [str(workshop.blender), str(ROOT / "scripts" / "demo.py")])


def wheels(workshop: Workshop, versions: Sequence[str], extension: Path) -> Iterator[Outcome]:
    """The tests of Blender's side in Blenders that pip can install."""
    for version in versions:
        try:
            python = environment.blender(version)
        except SculptError as error:
            yield _left_out(f"Blender {version} (bpy)", str(error))
            continue
        command = [str(python), str(BLENDER_TESTS), "--", str(extension)]
        yield _in_blender(f"Blender {version} (bpy)", command, _variables(workshop))


def installed(workshop: Workshop, extension: Path) -> Iterator[Outcome]:
    """The same in the Blenders that are programs of this computer."""
    for program in blenders.programs(workshop):
        if program.missing:
            yield _without(program.name, program)
        else:
            command = [*program.command, *_script(extension)]
            yield _in_blender(program.name, command, program.variables)


def windows(workshop: Workshop, extension: Path) -> Iterator[Outcome]:
    """The tests that draw by hand, in the same Blenders with a window on a virtual screen."""
    if missing := screen.why_none():
        yield _left_out("window tests", missing)
        return
    if not screen.has_person():
        say("\nNo xdotool (apt-get install xdotool): the test as a person is left out.")
    for program in blenders.programs(workshop):
        name = f"window of {program.name}"
        if program.missing:
            yield _without(name, program)
            continue
        pictures = WINDOW_PICTURES / re.sub(r"\W+", "-", program.name).strip("-").lower()
        given = [str(extension), str(pictures)]
        with screen.virtual_screen() as on_screen:
            variables = {**program.variables, **on_screen}
            command = screen.window_command(program, WINDOW_TESTS, given)
            yield _in_blender(name, command, variables, WINDOW_SECONDS)
            if screen.has_person():
                command = screen.window_command(program, WINDOW_TESTS, given, simulate=False)
                yield _in_blender(f"{name}, a person", command, variables, WINDOW_SECONDS)


def _without(name: str, program: blenders.Program) -> Outcome:
    if program.named:
        return Outcome(name, failed=1, note=program.missing)
    return _left_out(name, program.missing)


def _script(extension: Path) -> list[str]:
    return [
        *("--background", "--factory-startup", "--python-exit-code", "1"),
        *("--python", str(BLENDER_TESTS), "--", str(extension)),
    ]


def _variables(workshop: Workshop) -> dict[str, str]:
    return {ENVIRONMENT_VARIABLE: str(workshop.worker)}


def _in_blender(
    name: str,
    command: Sequence[str],
    variables: Mapping[str, str],
    limit: float = BLENDER_SECONDS,
) -> Outcome:
    """The tests in a Blender; once more when it crashed, which is told in the table."""
    first, code = _once_in_blender(name, command, variables, limit)
    if -code not in CRASHES:
        return first
    again, _ = _once_in_blender(f"{name}, again", command, variables, limit)
    notes = [f"the first time {first.note}; its stack is above", again.note]
    return replace(again, name=name, note="; ".join(filter(None, notes)))


def _once_in_blender(
    name: str, command: Sequence[str], variables: Mapping[str, str], limit: float
) -> tuple[Outcome, int]:
    """What came of it, and what the process returned."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as user:
        variables = {**variables, "BLENDER_USER_RESOURCES": user}
        code, lines, seconds = _run(name, command, limit, variables)
    pattern = re.compile(r"Blender \S+: (\d+) passed, (\d+) failed, (\d+) skipped")
    found = next((match for line in reversed(lines) if (match := pattern.search(line))), None)
    if found is None:
        note = f"it ended without a result, {exit_in_words(code)}"
        return Outcome(name, failed=1, seconds=seconds, note=note, printed=lines), code
    passed, failed, skipped = map(int, found.groups())
    failed = failed or int(code != 0)
    return Outcome(name, passed, failed, skipped, seconds, printed=lines), code


def _left_out(name: str, reason: str) -> Outcome:
    say(f"\n== {name}: left out, {reason}")
    return Outcome(name, note=f"left out: {reason}")


def _run(
    name: str, command: Sequence[str], limit: float, variables: Mapping[str, str] | None = None
) -> tuple[int, list[str], float]:
    """Run a command, showing what it prints: exit code, lines, seconds."""
    say(f"\n== {name}")
    code, lines, seconds = screen.run(command, variables or {}, limit)
    if seconds > limit:
        say(f"{name} was ended after {limit:.0f} s.")
    return code, lines, seconds


def _report(outcomes: Sequence[Outcome]) -> bool:
    """Print the ends of what failed, the table and the total; whether nothing failed."""
    for outcome in outcomes:
        if outcome.failed:
            say("\n".join(["", f"== the end of {outcome.name}", *outcome.printed[-LAST_LINES:]]))
    width = max(len(outcome.name) for outcome in outcomes)
    say(f"\n{'':{width}}  passed  failed  skipped  seconds")
    for o in outcomes:
        numbers = f"{o.passed:6}  {o.failed:6}  {o.skipped:7}  {o.seconds:7.1f}"
        say(f"{o.name:{width}}  {numbers}  {o.note}".rstrip())
    passed, failed, skipped = (
        sum(getattr(outcome, word) for outcome in outcomes)
        for word in ("passed", "failed", "skipped")
    )
    say(f"\n{passed} passed, {failed} failed, {skipped} skipped")
    return failed == 0


def main() -> None:
    """Run what the command line asks for; the exit code is 1 if anything failed."""
    parser = argparse.ArgumentParser(
        description="Every check and test of the project; other arguments go to pytest alone.",
        allow_abbrev=False,
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--quick", action="store_true", help="only the Blender of .venv")
    only.add_argument("--window", action="store_true", help="only the tests in a window")
    only.add_argument("--blender", choices=environment.BLENDERS, help="only this Blender")
    options, arguments = parser.parse_known_args()
    workshop = environment.ensure_or_exit()

    outcomes: list[Outcome] = []
    if arguments:
        outcomes.append(pytest(workshop, arguments))
    else:
        if not (options.blender or options.window):
            outcomes += checks(workshop)
            outcomes.append(pytest(workshop, ()))
        if not (options.blender or options.quick or options.window):
            outcomes.append(demo(workshop))
        outcomes += _blenders(workshop, options)
    sys.exit(0 if _report(outcomes) else 1)


def _blenders(workshop: Workshop, options: argparse.Namespace) -> Iterator[Outcome]:
    start = time.monotonic()
    try:
        extension = build_extension.build(workshop)
    except SculptError as error:
        yield Outcome("extension", failed=1, seconds=time.monotonic() - start, note=str(error))
        return
    yield Outcome("extension", passed=1, seconds=time.monotonic() - start)
    if options.blender:
        yield from wheels(workshop, [options.blender], extension)
    elif options.quick:
        yield from wheels(workshop, [workshop.blender_version], extension)
    elif options.window:
        yield from windows(workshop, extension)
    else:
        yield from wheels(workshop, list(environment.BLENDERS), extension)
        yield from installed(workshop, extension)
        yield from windows(workshop, extension)


if __name__ == "__main__":
    main()
