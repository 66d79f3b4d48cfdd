# SPDX-License-Identifier: GPL-3.0-or-later
"""An environment is complete or made again, whatever happened to it."""

import multiprocessing
import shutil
import sys
import time
from pathlib import Path

import pytest
from workshop import virtualenv

from neural_sculpt_addon.common.errors import SculptError

BASE = Path(sys.executable)


def nothing(python):
    """Install nothing."""


def touch(python):
    """Stand for packages: leave a file in the environment."""
    (python.parents[1] / "installed").touch()


def fail(python):
    """Stand for a network that breaks down in the middle."""
    touch(python)
    raise SculptError("The network is gone.")


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """A complete environment; making one takes seconds."""
    folder = tmp_path_factory.mktemp("template") / "venv"
    virtualenv.make(folder, BASE, "recipe", touch)
    return folder


@pytest.fixture
def folder(template, tmp_path):
    """A copy of it."""
    return Path(shutil.copytree(template, tmp_path / "venv", symlinks=True))


def test_is_made_once_and_then_reused(folder):
    assert virtualenv.is_complete(folder, "recipe")
    virtualenv.make(folder, BASE, "recipe", fail)
    python = virtualenv.python_in(folder)
    assert python.exists() and (folder / "installed").exists()
    assert virtualenv.version_of(python) == ".".join(map(str, sys.version_info[:2]))
    assert virtualenv.home_of(python).samefile(sys.base_prefix)


@pytest.mark.long
def test_half_made_one_is_made_again(folder):
    with pytest.raises(SculptError, match="network"):
        virtualenv.make(folder, BASE, "new", fail)
    assert not virtualenv.is_complete(folder, "new")
    assert not virtualenv.is_sound(folder)
    virtualenv.make(folder, BASE, "new", nothing)
    assert virtualenv.is_complete(folder, "new")
    assert not (folder / "installed").exists()


def test_other_pins_complete_it_in_place(folder):
    assert not virtualenv.is_complete(folder, "new")
    virtualenv.make(folder, BASE, "new", nothing)
    assert virtualenv.is_complete(folder, "new")
    assert (folder / "installed").exists()


def test_somebody_elses_environment_is_kept(folder):
    (folder / virtualenv.MARKER).unlink()
    virtualenv.make(folder, BASE, "recipe", nothing)
    assert (folder / "installed").exists()


@pytest.mark.long
def test_without_its_python_it_is_made_again(folder):
    virtualenv.python_in(folder).unlink()
    assert not virtualenv.is_complete(folder, "recipe")
    inner = folder / "inner"
    inner.mkdir()
    virtualenv.mark(inner, "an environment of its own")
    virtualenv.make(folder, BASE, "recipe", nothing)
    assert virtualenv.is_complete(folder, "recipe")
    assert inner.exists()
    assert not (folder / "installed").exists()


def _start(folder, log):
    def install(python):
        with log.open("a") as file:
            file.write("begin\n")
            file.flush()
            time.sleep(0.3)
            file.write("end\n")

    virtualenv.make(folder, BASE, "new", install)


def test_two_starts_at_once_make_it_once(folder, tmp_path):
    log = tmp_path / "log"
    starts = [multiprocessing.Process(target=_start, args=(folder, log)) for _ in range(3)]
    for start in starts:
        start.start()
    for start in starts:
        start.join()
    assert [start.exitcode for start in starts] == [0, 0, 0]
    assert log.read_text().split() == ["begin", "end"]


def test_lack_of_space_is_told_before_anything_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(virtualenv, "ROOM", 1e18)
    with pytest.raises(SculptError, match="GB left"):
        virtualenv.make(tmp_path / "venv", BASE, "recipe", nothing)
    assert not virtualenv.python_in(tmp_path / "venv").exists()


def test_a_package_that_does_not_exist_is_one_sentence(folder, tmp_path):
    missing = ["--no-index", "--find-links", str(tmp_path), "neural-sculpt-nothing==1"]
    with pytest.raises(SculptError, match="log is"):
        virtualenv.make(folder, BASE, "new", lambda python: virtualenv.pip_install(python, missing))
