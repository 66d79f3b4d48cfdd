# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that installs the worker, as Blender starts it."""

import json
import os
import subprocess
import sys
import sysconfig
import textwrap
import venv
from collections.abc import Iterator
from pathlib import Path

import pytest

from neural_sculpt_addon.common.text import from_json
from neural_sculpt_addon.worker.install.environment import (
    REQUIREMENTS,
    environment_python,
    installation_command,
    installed,
)
from neural_sculpt_addon.worker.install.interpreter import present_pythons
from tests.worker.support import PATIENCE, processes_of, until

MARKER = "neural_sculpt_environment.txt"
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Iterator[Path]:
    """Where to install, with nothing to install from, and no process left behind."""
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
    monkeypatch.setenv("PIP_RETRIES", "1")
    yield tmp_path / "environment"
    if sys.platform == "linux":
        until(lambda: not processes_of(tmp_path / "environment"))


@pytest.fixture
def halting(tmp_path, monkeypatch):
    """pip never gets beyond reading its constraints."""
    os.mkfifo(tmp_path / "constraints.txt")
    monkeypatch.setenv("PIP_CONSTRAINT", str(tmp_path / "constraints.txt"))


def install(folder: Path, python: Path | str = sys.executable) -> list[dict]:
    """Run it to its end; what it says."""
    command = installation_command(python, folder)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        said = [json.loads(line) for line in process.stdout]
    assert process.returncode == 0
    return said


def pip_runs(folder: Path) -> bool:
    """Whether the environment's pip is at work."""
    return any(arguments[2:4] == ["-m", "pip"] for arguments in processes_of(folder).values())


def test_a_whole_environment_is_kept(folder):
    venv.create(folder, with_pip=False, symlinks=os.name != "nt")
    [packages] = (*folder.glob("lib/python*/site-packages"), *folder.glob("Lib/site-packages"))
    (packages / "lent.pth").write_text(sysconfig.get_path("purelib"))
    (folder / MARKER).write_bytes(REQUIREMENTS.read_bytes())
    assert install(folder) == [{"fraction": 0.0, "message": "Starting"}]
    assert installed(folder)


def test_a_python_without_packages_can_run_it_and_says_what_failed(folder, tmp_path):
    venv.create(tmp_path / "bare", with_pip=False, symlinks=os.name != "nt")
    *before, last = install(folder, environment_python(tmp_path / "bare"))
    told = [from_json(news["message"]) for news in before]
    assert [text.split()[0] for text in told] == ["Starting", "Trying", "Looking"]
    assert told[1].template == "Trying Python {} ({})"
    assert last == {
        "error": "The package index could not be reached. Check the network and the proxy, and try"
        " again."
    }
    assert not installed(folder)


@LINUX
@pytest.mark.long
def test_the_end_of_stdin_ends_it_and_pip(folder, halting):
    command = installation_command(sys.executable, folder)
    with subprocess.Popen(command, bufsize=0, stdin=subprocess.PIPE) as process:
        until(lambda: pip_runs(folder))
        process.stdin.close()
        assert process.wait(PATIENCE) != 0
    until(lambda: not processes_of(folder))
    assert not installed(folder)


@LINUX
def test_it_ends_in_the_midst_of_making_the_environment(folder):
    """venv has processes of its own then, which are none of ours."""
    command = installation_command(sys.executable, folder)
    with subprocess.Popen(command, bufsize=0, stdin=subprocess.PIPE) as process:
        until(lambda: any("ensurepip" in words for words in processes_of(folder).values()))
        process.stdin.close()
    until(lambda: not processes_of(folder))
    assert not [*folder.glob("bin/pip*")]


@LINUX
@pytest.mark.long
def test_it_goes_with_pip_when_its_parent_is_killed(folder, halting):
    script = textwrap.dedent(f"""
        import subprocess, time
        process = subprocess.Popen({installation_command(sys.executable, folder)!r}, stdin=-1)
        time.sleep(600)
    """)
    with subprocess.Popen([sys.executable, "-c", script]) as parent:
        until(lambda: pip_runs(folder))
        parent.kill()
    until(lambda: not processes_of(folder))


def test_pythons_are_found_without_running_them(monkeypatch, tmp_path):
    named = tmp_path / "python3.11"
    named.write_text("no program")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "blender"))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert named in present_pythons()
    monkeypatch.setattr(sys, "executable", str(named))
    assert next(present_pythons()) == named
