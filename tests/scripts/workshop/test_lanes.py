# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts beside each other: all run, each is shown whole, and what failed comes last."""

import os
import re
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest
from workshop import commands, lanes
from workshop.commands import Commands
from workshop.failures import Failure
from workshop.lanes import Outcome, Part

from tests.worker.support import gone, until


def part(name, **counts):
    def work(show, _run):
        for line in range(3):
            show(f"{name} {line}")
        return Outcome(name, **counts)

    return Part(name, work)


def test_lanes_run_at_the_same_time_and_outcomes_are_in_order(capsys):
    meet = threading.Barrier(2, timeout=60)

    def work(show, _run):
        show("came")
        meet.wait()  # for ever, were the other one not there
        return Outcome("met", passed=1)

    first = [Part("first", work), part("after", passed=2)]
    outcomes = lanes.side_by_side([first, [Part("second", work)]], [part("rest", passed=3)])
    assert [outcome.passed for outcome in outcomes] == [1, 2, 1, 3]
    shown = capsys.readouterr().out
    for name in ("after", "rest"):
        assert f"== {name}\n{name} 0\n{name} 1\n{name} 2\n" in shown
    assert shown.index("== first") < shown.index("== after")


def test_an_error_of_a_part_is_its_failure_alone():
    def broken(_show, _run):
        raise OSError("no room")

    first, second = lanes.side_by_side([[Part("broken", broken), part("whole", passed=1)]])
    assert (first.failed, first.note) == (1, "OSError: no room")
    assert second.passed == 1


def test_what_failed_is_told_last_and_the_total_after_it(capsys):
    failed = Outcome("two", 3, 1, 0, 5.0, failures=[Failure("test_it", ["E  1 != 2"])])
    crashed = Outcome("three", 0, 1, 0, 5.0, "it crashed", printed=["the stack"])
    assert not lanes.report([Outcome("one", 4, 0, 1, 61.0), failed, crashed], 71.0)
    lines = capsys.readouterr().out.split("\n")
    total = "7 passed, 2 failed, 1 skipped"
    end = lines[lines.index(total) + 1 :]
    assert [line for line in end if line] == [
        "== what failed in two",
        "FAILED test_it",
        "    E  1 != 2",
        "== what failed in three: it crashed",
        "    the stack",
        total,
    ]
    assert re.search(r"^all, in 1 min 11 s +7 +2 +1 +71.0$", "\n".join(lines), re.M)


def test_success_ends_with_the_total(capsys):
    assert lanes.report([Outcome("one", 4, 0, 1, 3.0)], 3.0)
    assert capsys.readouterr().out.endswith("\n4 passed, 0 failed, 1 skipped\n")


@pytest.mark.skipif(os.name != "posix", reason="process groups of POSIX")
def test_a_command_that_takes_too_long_ends_with_what_it_started(tmp_path):
    pid = tmp_path / "pid"
    started = f"sleep 600 & echo $! > {pid}; echo begun; wait"
    code, lines, seconds = commands.run(["sh", "-c", started], {}, 2.0, lambda _: None)
    assert (code, lines) == (-signal.SIGKILL, ["begun"])
    assert seconds > 2.0
    until(lambda: gone(int(pid.read_text())))


@pytest.mark.skipif(os.name != "posix", reason="process groups of POSIX")
def test_the_end_of_all_commands_ends_one_that_has_closed_its_output(tmp_path):
    pid = tmp_path / "pid"
    quiet = f"echo $$ > {pid}.new; mv {pid}.new {pid}; exec >&- 2>&-; exec sleep 600"
    with ThreadPoolExecutor(1) as pool, Commands() as commands:
        running = pool.submit(commands.run, ["sh", "-c", quiet], {}, 600)
        until(pid.exists)
    assert running.result()[0] == -signal.SIGKILL
    assert gone(int(pid.read_text()))


def test_no_command_begins_after_the_end_of_all(tmp_path):
    with Commands() as commands:
        assert not commands.ended
    assert commands.ended
    with pytest.raises(RuntimeError, match="does not begin"):
        commands.run([sys.executable, "-c", f"open({str(tmp_path / 'made')!r}, 'w')"], {}, 600)
    assert not (tmp_path / "made").exists()


SLEEPING = """
import pathlib, sys
here = pathlib.Path(__file__).parent
sys.path.insert(0, {scripts!r})
from workshop import lanes

def sleeping(name):
    def work(show, run):
        def told(line):
            show(line)
            (here / "new" / name).write_text(line)
            (here / "new" / name).rename(here / name)
        run(["sh", "-c", "echo $$; sleep 600"], {{}}, 600, told)
    return lanes.Part(name, work)

lanes.end_when_told()
"""
"""Start of a script: parts that write the number of their process into a file, and sleep."""

LATE = """
class Lanes(list):
    def __iter__(self):
        yield self[0]
        while not (here / "one").exists():
            pass
        signal.raise_signal(signal.SIGTERM)
        yield self[1]
"""


def asleep(folder, script):
    """A process with a script of parts that sleep."""
    (folder / "new").mkdir()
    path = folder / "script.py"
    path.write_text(SLEEPING.format(scripts=str(Path(lanes.__file__).parents[1])) + script)
    return subprocess.Popen([sys.executable, str(path)], stdout=subprocess.PIPE, text=True)


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_when_told_to_end_it_shows_what_there_is_and_leaves_nothing(tmp_path):
    parts = "[[sleeping('one')], [sleeping('two')]], [sleeping('three')]"
    begun = [tmp_path / "one", tmp_path / "two"]
    with asleep(tmp_path, f"lanes.side_by_side({parts})") as script:
        try:
            until(lambda: all(pid.exists() for pid in begun))
            script.terminate()
            shown, _ = script.communicate(timeout=60)
        finally:
            script.kill()
    assert script.returncode == 128 + signal.SIGTERM
    for pid in begun:
        assert f"as far as it came\n{pid.read_text()}\n" in shown
        until(partial(gone, int(pid.read_text())))
    assert "three" not in shown


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_told_to_end_between_two_lanes_it_ends_the_first_and_begins_no_second(tmp_path):
    """The signal comes while lanes are handed out: one runs, and the other does not yet."""
    late = LATE + "lanes.side_by_side(Lanes([[sleeping('one')], [sleeping('two')]]))"
    with asleep(tmp_path, "import signal\n" + late) as script:
        try:
            shown, _ = script.communicate(timeout=60)
        finally:
            script.kill()
    assert script.returncode == 128 + signal.SIGTERM
    pid = (tmp_path / "one").read_text()
    assert f"== one, as far as it came\n{pid}\n" in shown
    assert "two" not in shown
    assert gone(int(pid))
