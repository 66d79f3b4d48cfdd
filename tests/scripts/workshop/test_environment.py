# SPDX-License-Identifier: GPL-3.0-or-later
"""What a start says when this computer lacks something, and that a start is cheap otherwise."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from workshop import environment, virtualenv

from neural_sculpt_addon.common.errors import SculptError

ROOT = Path(__file__).resolve().parents[3]


def test_every_blender_has_a_python_and_exact_pins():
    assert set(environment.OF_PYTHON) == {"3.11", "3.13"}
    for version, wheel in environment.BLENDERS.items():
        blender, numpy = wheel.pins
        assert blender.startswith(f"bpy=={version}.")
        assert numpy.startswith("numpy==1.26" if wheel.python == "3.11" else "numpy==2.")


def test_the_wrong_python_names_the_right_ones(tmp_path, monkeypatch):
    monkeypatch.setattr(environment, "VENV", tmp_path / "venv")
    monkeypatch.setattr(environment.sys, "version_info", (3, 12, 1))
    with pytest.raises(SculptError, match=r"3\.11 and 3\.13; this is Python 3\.12"):
        environment.ensure()


def test_an_environment_of_the_wrong_python_is_left_alone(tmp_path, monkeypatch):
    python = virtualenv.python_in(tmp_path)
    python.parent.mkdir()
    python.touch()
    (tmp_path / "pyvenv.cfg").write_text("home = /usr/bin\nversion = 3.12.1\n")
    monkeypatch.setattr(environment, "VENV", tmp_path)
    with pytest.raises(SculptError, match=r"\.venv is of Python 3\.12"):
        environment.ensure()
    assert virtualenv.is_sound(tmp_path)


def test_the_package_imports_without_anything_installed():
    """On a bare Python, in isolation and without site-packages: no bpy, torch or numpy."""
    modules = [
        "neural_sculpt_addon",
        "neural_sculpt_addon.worker.install.environment",
        "neural_sculpt_addon.worker.install.installation",
        "neural_sculpt_addon.worker.install.pip",
        "neural_sculpt_addon.worker.install.interpreter",
    ]
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import {', '.join(modules)}"
    subprocess.run([sys.executable, "-I", "-S", "-c", code], check=True)


def test_blenders_side_of_the_worker_needs_numpy_alone():
    """The client must load in a Blender, which has no torch."""
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "import neural_sculpt_addon.worker.client, neural_sculpt_addon.stroke.file\n"
        "heavy = {'torch', 'scipy', 'skimage', 'trimesh', 'igl', 'bpy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-I", "-c", code], check=True)


def run_bare(script, *arguments):
    """Start a script on a Python without any packages."""
    return subprocess.run(
        [sys.executable, "-S", str(ROOT / "scripts" / f"{script}.py"), *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": os.environ["PATH"]},
    )


@pytest.mark.parametrize("script", ["demo", "test", "build_extension", "read_cases"])
def test_every_command_explains_itself_on_a_bare_python(script):
    ran = run_bare(script, "--help")
    assert ran.returncode == 0, ran.stderr
    assert "usage:" in ran.stdout


def test_the_demo_refuses_wrong_files_before_it_installs_anything(tmp_path):
    wrong = tmp_path / "shape.txt"
    wrong.touch()
    for arguments, sentence in (
        (["--mesh", "nothing.obj"], "there is no file nothing.obj"),
        (["--mesh", str(wrong)], f"{wrong} is none of .obj, .ply, .stl"),
        (["--network", str(wrong)], f"{wrong} is none of .pth, .safetensors"),
    ):
        ran = run_bare("demo", *arguments)
        assert ran.returncode == 2
        assert sentence in ran.stderr
