# SPDX-License-Identifier: GPL-3.0-or-later
"""Every check and test of the project: python3 scripts/test.py.

First the checks (ruff, basedpyright, import-linter), then pytest in the Python that has torch, then
the demo, then the tests of Blender's side in every Blender this computer can have: the bpy wheels,
each in a virtual environment of its own; the Blenders named in the environment variable BLENDER or
found on the PATH; and those that ../shared/tools/real-blender.sh provides. A part that fails does
not keep the later ones from running. Ends with a table and the line "N passed, N failed, N
skipped". Standard library only.

    --quick            only the Blender of the project's own environment, and no demo
    --blender 4.5      only this Blender, and neither the checks nor pytest
    anything else      goes to pytest, and only pytest runs
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import build_extension
import environment
from environment import ROOT, Workshop
from virtualenv import home_of, say, version_of

from neural_sculpt_addon.stroke.errors import SculptError
from neural_sculpt_addon.worker.environment import ENVIRONMENT_VARIABLE

BLENDER_TESTS = ROOT / "tests" / "run_in_blender.py"
REAL_BLENDER = ROOT.parent / "shared" / "tools" / "real-blender.sh"
PYTEST_SECONDS = 2400
BLENDER_SECONDS = 900


@dataclass(frozen=True)
class Outcome:
    """What one part of the tests came to; `note` says why it did not run."""

    name: str
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    seconds: float = 0.0
    note: str = ""


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
    code, _, seconds = _run(name, command, 600)
    return Outcome(name, passed=int(code == 0), failed=int(code != 0), seconds=seconds)


def pytest(workshop: Workshop, arguments: Sequence[str]) -> Outcome:
    """The tests of stroke, field, worker and scripts."""
    name = f"pytest, Python {version_of(workshop.worker)}"
    command = [str(workshop.worker), "-m", "pytest", *arguments]
    code, lines, seconds = _run(name, command, PYTEST_SECONDS, _variables(workshop))
    summary = next((line for line in reversed(lines) if re.search(r" in [\d.:]+", line)), "")
    count = {word: int(number) for number, word in re.findall(r"(\d+) ([a-z]+)", summary)}
    failed = count.get("failed", 0) + count.get("error", 0) + count.get("errors", 0)
    skipped = count.get("skipped", 0) + count.get("xfailed", 0)
    return Outcome(name, count.get("passed", 0), failed or int(code != 0), skipped, seconds)


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
    """The same in the Blenders that are installed here."""
    named = [name for name in os.environ.get("BLENDER", "").split(os.pathsep) if name]
    found = named or [path for path in [shutil.which("blender")] if path]
    for program in found:
        name = f"Blender ({program})"
        if shutil.which(program):
            yield _in_blender(name, [program, *_script(extension)], _variables(workshop))
        else:
            yield Outcome(name, failed=1, note="the variable BLENDER names it, but it cannot run")
    if not found:
        yield _left_out("installed Blender", "none on the PATH or in the variable BLENDER")


def from_debian(workshop: Workshop, extension: Path) -> Iterator[Outcome]:
    """The same in Debian's Blenders, each in a folder of its own."""
    home = home_of(workshop.worker)
    for suite, version in (("sid", "5.2"), ("trixie", "4.3")):
        name = f"Blender {version} (Debian {suite})"
        if not REAL_BLENDER.exists():
            yield _left_out(name, f"there is no {os.path.relpath(REAL_BLENDER, ROOT)}")
        elif not hasattr(os, "geteuid") or os.geteuid() != 0:
            yield _left_out(name, "it takes root")
        elif home == Path("/usr"):
            yield _left_out(name, f"the worker's Python, of {home}, is not seen inside its folder")
        else:
            variables = _variables(workshop) | {
                "REAL_BLENDER_SUITE": suite,
                "REAL_BLENDER_BIND": os.pathsep.join(map(str, (ROOT, home))),
            }
            command = ["bash", str(REAL_BLENDER), "exec", "--", "blender", *_script(extension)]
            yield _in_blender(name, command, variables)


def _script(extension: Path) -> list[str]:
    return [
        *("--background", "--factory-startup", "--python-exit-code", "1"),
        *("--python", str(BLENDER_TESTS), "--", str(extension)),
    ]


def _variables(workshop: Workshop) -> dict[str, str]:
    return {ENVIRONMENT_VARIABLE: str(workshop.worker)}


def _in_blender(name: str, command: Sequence[str], variables: Mapping[str, str]) -> Outcome:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as user:
        variables = {**variables, "BLENDER_USER_RESOURCES": user}
        code, lines, seconds = _run(name, command, BLENDER_SECONDS, variables)
    pattern = re.compile(r"Blender \S+: (\d+) passed, (\d+) failed, (\d+) skipped")
    found = next((match for line in reversed(lines) if (match := pattern.search(line))), None)
    if found is None:
        return Outcome(name, failed=1, seconds=seconds, note="it ended without a result")
    passed, failed, skipped = map(int, found.groups())
    return Outcome(name, passed, failed or int(code != 0), skipped, seconds)


def _left_out(name: str, reason: str) -> Outcome:
    say(f"\n== {name}: left out, {reason}")
    return Outcome(name, note=f"left out: {reason}")


def _run(
    name: str, command: Sequence[str], limit: float, variables: Mapping[str, str] | None = None
) -> tuple[int, list[str], float]:
    """Run a command, showing what it prints: exit code, lines, seconds."""
    say(f"\n== {name}")
    lines, start = [], time.monotonic()
    with subprocess.Popen(
        command,
        cwd=ROOT,
        env={**os.environ, **(variables or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    ) as process:
        timer = threading.Timer(limit, process.kill)
        timer.start()
        for line in process.stdout or ():
            lines.append(line.rstrip())
            say(lines[-1])
        timer.cancel()
    seconds = time.monotonic() - start
    if seconds > limit:
        say(f"{name} was ended after {limit:.0f} s.")
    return process.returncode, lines, seconds


def _report(outcomes: Sequence[Outcome]) -> bool:
    """Print the table and the total; whether nothing failed."""
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
    only.add_argument("--blender", choices=environment.BLENDERS, help="only this Blender")
    options, arguments = parser.parse_known_args()
    workshop = environment.ensure_or_exit()

    outcomes: list[Outcome] = []
    if arguments:
        outcomes.append(pytest(workshop, arguments))
    else:
        if not options.blender:
            outcomes += checks(workshop)
            outcomes.append(pytest(workshop, ()))
        if not (options.blender or options.quick):
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
    else:
        yield from wheels(workshop, list(environment.BLENDERS), extension)
        yield from installed(workshop, extension)
        yield from from_debian(workshop, extension)


if __name__ == "__main__":
    main()
