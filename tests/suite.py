# SPDX-License-Identifier: GPL-3.0-or-later
"""The tests that run in a Blender: where they are, which of them, and the extension they test.

Standard library only. Modules of tests/blender, tests/window and tests/person import each other by
their bare names, from whatever folder of these rooms they are in; so no two have the same name.
"""

import sys
import unittest
import zipfile
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).resolve().parent
EXTENSION = "bl_ext.user_default.neural_sculpt"


def make_importable(*rooms: str) -> None:
    """Put the folders of rooms on the path, "blender" for example."""
    for room in rooms:
        sys.path[:0] = map(str, _folders(room))


def tests_of(room: str, patterns: list[str], short: bool) -> list[unittest.TestCase]:
    """The tests of a room that `-k` patterns take in; `short`: none that is long."""
    found = []
    for folder in _folders(room):
        loader = unittest.TestLoader()
        loader.testNamePatterns = [p if "*" in p else f"*{p}*" for p in patterns] or None
        found += _each(loader.discover(str(folder), "test_*.py", str(folder)))
    return [case for case in found if not (short and _is_long(case))]


def pack(folder: Path) -> Path:
    """The sources as a zip that Blender can install; scripts/build_extension.py makes them one
    to publish, but needs an environment of its own."""
    root = TESTS.parent
    target, package = folder / "neural_sculpt.zip", root / "neural_sculpt_addon"
    with zipfile.ZipFile(target, "w") as archive:
        for path in package.rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                archive.write(path, path.relative_to(package))
        for name in ("blender_manifest.toml", "LICENSE"):
            archive.write(root / name, name)
    return target


def _folders(room: str) -> list[Path]:
    """The room's folder and those in it that have modules."""
    return sorted({file.parent for file in (TESTS / room).rglob("*.py")})


def _each(tests: unittest.TestSuite | unittest.TestCase) -> Iterator[unittest.TestCase]:
    """The tests in a suite, of however many levels."""
    if isinstance(tests, unittest.TestSuite):
        for test in tests:
            yield from _each(test)
    else:
        yield tests


def _is_long(case: unittest.TestCase) -> bool:
    """Whether a test is marked by `long` of tests/blender/harness.py."""
    return getattr(getattr(case, case.id().rpartition(".")[2], None), "long", False)
