# SPDX-License-Identifier: GPL-3.0-or-later
"""Run tests/window in a Blender with a window, against the extension as an artist installs it.

Started by `scripts/test.py --window`, on a virtual screen:

    blender --enable-event-simulate --python tests/run_in_window.py -- \\
        EXTENSION.zip PICTURES [--short] [-k PATTERN ...]

Without --enable-event-simulate tests/person runs instead, for Blender then takes other input. A
test is a generator: each `yield seconds` lets Blender's main loop run. A picture of the window at
the end of each test goes to the folder PICTURES. --short leaves out tests marked `long`. The last
line reads as in run_in_blender.py.
"""

import sys
import traceback
import unittest
from collections.abc import Iterator
from pathlib import Path

import bpy

TESTS = Path(__file__).resolve().parent
sys.path[:0] = [str(TESTS), str(TESTS.parent / "scripts")]

from in_blender import simulated_input  # noqa: E402 - found by the paths above
from suite import EXTENSION, make_importable, tests_of  # noqa: E402

make_importable("blender", "window", "person")

from durations import Durations  # noqa: E402

ROOM = "window" if bpy.app.use_event_simulate else "person"


def steps() -> simulated_input.Steps:
    """Install the extension, run every test, tell how many passed."""
    given = sys.argv[sys.argv.index("--") + 1 :]
    patterns = [given[i + 1] for i, word in enumerate(given[:-1]) if word == "-k"]
    bpy.ops.extensions.package_install_files(
        filepath=given[0], repo="user_default", enable_on_install=True
    )
    count, durations = {"passed": 0, "failed": 0, "skipped": 0}, Durations()
    for case in tests_of(ROOM, patterns, "--short" in given):
        durations.begin()
        outcome, reason = yield from run(case, Path(given[1]))
        count[outcome] += 1
        name = case.id().partition(".")[2]
        print(f"{name}: {outcome}{reason}, {durations.end(case):.1f} s", flush=True)
    bpy.ops.preferences.addon_disable(module=EXTENSION)
    print("\n".join(durations.slowest()))
    version = ".".join(map(str, bpy.app.version))
    print(f"Blender {version}: " + ", ".join(f"{n} {word}" for word, n in count.items()))


def run(case: unittest.TestCase, pictures: Path) -> Iterator:
    """Step one test: how it ended, and why when it was skipped."""
    outcome, reason = "passed", ""
    try:
        case.setUp()
        yield simulated_input.DRAWN
        yield from getattr(case, case.id().rpartition(".")[2])()
    except unittest.SkipTest as skipped:
        outcome, reason = "skipped", f" ({skipped})"
    except Exception:  # noqa: BLE001 - whatever a test raises is its failure
        outcome = "failed"
        traceback.print_exc()
    yield simulated_input.DRAWN
    picture = pictures / f"{case.id().rpartition('.')[2].removeprefix('test_')}.png"
    simulated_input.save_png(picture, simulated_input.screen_pixels())
    case.doCleanups()
    return outcome, reason


simulated_input.play(steps())
