# SPDX-License-Identifier: GPL-3.0-or-later
"""The checks and tests of the project: python3 scripts/test.py.

Three lanes run side by side, for a window waits often: the tests in a window, of the first
installed Blender, with simulated input and as a person; pytest, in two processes; and all else,
with which each lane goes on that is through: the tests of Blender's side without a window, in the
Blender of the project's own environment, the demo, ruff, basedpyright and import-linter. Tests
marked `long` are left out.

With --all they are not, and every Blender that this computer can have takes part: the bpy wheels,
each in a virtual environment of its own, with the long tests in the oldest and the newest; those
named in the environment variable BLENDER or found on the PATH; those that
../shared/tools/real-blender.sh provides. A program of a version that has a wheel takes part with
its window alone. Pictures of the windows go to test-output/window/.

A part that fails does not keep others from running. Ends with a table, the line "N passed, N
failed, N skipped" and, if there is any, what failed and why. Standard library only.

    --all            every Blender, every window, every long test
    --blender 4.5    only this Blender
    --window         only the windows, all of them
    anything else    goes to pytest, and only pytest runs
"""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import build_extension
from workshop import blenders, commands, environment, lanes, parts, screen
from workshop.environment import Workshop
from workshop.lanes import Outcome, Part
from workshop.virtualenv import say

from neural_sculpt_addon.common.errors import SculptError

SET_UP_SECONDS = 1800  # of a Blender that is fetched first


def main() -> None:
    """Run what the command line asks for; the exit code is 1 if anything failed."""
    parser = argparse.ArgumentParser(
        description="The checks and tests of the project; other arguments go to pytest alone.",
        allow_abbrev=False,
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--all", action="store_true", help="every Blender, window and long test")
    only.add_argument("--window", action="store_true", help="only the tests in a window")
    only.add_argument("--blender", choices=environment.BLENDERS, help="only this Blender")
    options, arguments = parser.parse_known_args()
    lanes.end_when_told()
    workshop = environment.ensure_or_exit()
    if arguments:
        start = time.monotonic()
        outcomes = [lanes.alone(parts.pytest(workshop, arguments))]
    else:
        background, windows = _in_blenders(workshop, options)  # sets up what they need
        start = time.monotonic()
        outcomes = _run(workshop, options, background, windows)
    sys.exit(0 if lanes.report(outcomes, time.monotonic() - start) else 1)


def _run(
    workshop: Workshop,
    options: argparse.Namespace,
    background: Sequence[Part],
    windows: Sequence[Part],
) -> list[Outcome]:
    """What all parts came to; never two windows at a time."""
    if options.blender or options.window:
        return [lanes.alone(part) for part in (*background, *windows)]
    chosen = () if options.all else parts.SHORT_PYTEST
    given = (*parts.PROCESSES, *chosen, "--durations=10")
    beside = parts.pytest(workshop, given, parts.ONE_THREAD, parts.PATIENT)
    rest = [*background, parts.demo(workshop), *parts.checks(workshop)]
    return lanes.side_by_side([[beside], windows, ()], rest)


def _in_blenders(workshop: Workshop, options: argparse.Namespace) -> tuple[list[Part], list[Part]]:
    """What runs in Blenders without a window and with one, once all that it needs is set up."""
    try:
        extension = build_extension.build(workshop)
    except SculptError as error:
        return [parts.left_out("extension", str(error), fails=True)], []
    if options.blender:
        return [_wheel(workshop, options.blender, extension)], []
    programs = [*blenders.programs(workshop)]
    more = () if options.all or options.window else (parts.SHORT,)
    if more:
        programs = [p for p in programs if p.named or not p.missing][:1]
    for program in programs:
        if not program.missing:
            say(f"Looking for {program.name}.")
            commands.run([*program.command, "--version"], program.variables, SET_UP_SECONDS)
    background = []
    if options.all:
        short = dict.fromkeys([*environment.BLENDERS][1:-1], (parts.SHORT,))  # between
        background = [
            _wheel(workshop, version, extension, *short.get(version, ()))
            for version in environment.BLENDERS
        ]
        others = [p for p in programs if p.version not in environment.BLENDERS]
        background += [parts.installed(program, extension) for program in others]
    elif not options.window:
        background = [_wheel(workshop, workshop.blender_version, extension, *more)]
    if missing := screen.why_none() if programs else "there is no installed Blender":
        return background, [parts.left_out("window tests", missing)]
    windows = [part for program in programs for part in parts.windows(program, extension, *more)]
    return background, windows


def _wheel(workshop: Workshop, version: str, extension: Path, *more: str) -> Part:
    """The tests in a Blender that pip can install; it is installed now."""
    try:
        python = environment.blender(version)
    except SculptError as error:
        return parts.left_out(f"Blender {version} (bpy)", str(error))
    return parts.wheel(workshop, version, python, extension, *more)


if __name__ == "__main__":
    main()
