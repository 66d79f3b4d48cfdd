# SPDX-License-Identifier: GPL-3.0-or-later
"""What failed is read from what pytest and unittest print, with the last lines that tell why."""

import subprocess
import sys

import pytest
from workshop import failures

TESTS = """
import unittest
import pytest

def test_passes():
    print("quiet")

@pytest.mark.parametrize("text", ["a - b", "c"])
def test_texts(text):
    print("said before")
    assert text == "c"

class TestGroup:
    def test_raises(self):
        raise ValueError("no such thing")

@pytest.fixture
def broken():
    raise RuntimeError("not today")

def test_needs_it(broken):
    pass
"""
UNITTESTS = """
import unittest

class Group(unittest.TestCase):
    def test_fails(self):
        self.assertEqual(1, 2, "they differ")

    def test_passes(self):
        pass

    def test_raises(self):
        with self.subTest(number=3):
            raise ValueError("no such thing")

unittest.main(verbosity=2)
"""
WINDOW = """
Info: Saved
stroke.Stroke.test_first: passed, 3.0 s
Traceback (most recent call last):
  File "test_stroke.py", line 3, in test_second
AssertionError: 1 != 2
stroke.Stroke.test_second: failed, 12.5 s
stroke.Stroke.test_third: skipped (not here), 0.1 s
Blender 5.2.0: 1 passed, 1 failed, 1 skipped
"""


def printed(folder, *command):
    done = subprocess.run(
        [sys.executable, *command], cwd=folder, stdout=-1, stderr=-2, text=True, check=False
    )
    return done.stdout.splitlines()


@pytest.mark.parametrize("options", [(), pytest.param(("-n", "2"), marks=pytest.mark.long)])
def test_of_pytest(tmp_path, options):
    file = tmp_path / "tests" / "test_some.py"
    file.parent.mkdir()
    file.write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    given = ["-m", "pytest", "-ra", "-p", "no:cacheprovider", *options]
    found = dict(failures.of_pytest(printed(tmp_path, *given)))
    assert found.keys() == {
        "tests/test_some.py::test_texts[a - b]",
        "tests/test_some.py::TestGroup::test_raises",
        "tests/test_some.py::test_needs_it",
    }
    texts = found["tests/test_some.py::test_texts[a - b]"]
    assert texts[-1].endswith("test_some.py:11: AssertionError")
    assert "said before" not in texts
    assert "E       AssertionError: assert 'a - b' == 'c'" in texts
    assert found["tests/test_some.py::TestGroup::test_raises"][-1].endswith("ValueError")
    assert found["tests/test_some.py::test_needs_it"][-1].endswith("RuntimeError")


def test_of_a_file_that_cannot_be_collected(tmp_path):
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_some.py").write_text("import no_such_module\n")
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (found,) = failures.of_pytest(printed(tmp_path, "-m", "pytest", "-ra"))
    assert found.name == "tests/test_some.py"
    assert any("no_such_module" in line for line in found.lines)


def test_of_unittest(tmp_path):
    (tmp_path / "some.py").write_text(UNITTESTS)
    found = failures.of_unittest(printed(tmp_path, "some.py"))
    assert [failure.name.split()[0] for failure in found] == ["test_raises", "test_fails"]
    assert found[0].lines[-1] == "ValueError: no such thing"
    assert found[1].lines[-1] == "AssertionError: 1 != 2 : they differ"


def test_of_a_window():
    (found,) = failures.of_window(WINDOW.splitlines())
    assert found.name == "stroke.Stroke.test_second"
    assert found.lines[-1] == "AssertionError: 1 != 2"
    assert len(found.lines) == 3


def test_a_summary_has_each_name_and_the_end_of_a_part_without_any():
    many = [failures.Failure(f"test_{n}", [f"line {k}" for k in range(99)]) for n in range(99)]
    shown = list(failures.summary(many, ["all"]))
    assert [line for line in shown if not line.startswith(" ")] == [
        f"FAILED test_{n}" for n in range(99)
    ]
    assert shown[1 : failures.WORDS + 1][-1] == "    line 98"
    assert len(shown) == 99 + failures.MOST * failures.WORDS
    crashed = list(failures.summary([], [str(n) for n in range(99)]))
    assert crashed[-1] == "    98" and len(crashed) == failures.LAST_LINES
