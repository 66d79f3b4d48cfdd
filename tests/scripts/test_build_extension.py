# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zip: the same bytes twice, and all that belongs in it, and nothing else."""

import os
import zipfile

import build_extension
import pytest
from workshop import environment, virtualenv


@pytest.fixture(scope="module")
def workshop():
    workshop = environment.Workshop(
        virtualenv.python_in(environment.VENV), virtualenv.python_in(environment.WORKER)
    )
    if not workshop.blender.exists():
        pytest.skip("there is no .venv, whose Blender builds extensions")
    return workshop


def test_two_builds_are_equal(workshop, tmp_path):
    one = build_extension.build(workshop, tmp_path / "one")
    for path in build_extension.PACKAGE.glob("*.py"):
        status = path.stat()
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    two = build_extension.build(workshop, tmp_path / "two")
    assert one.name == two.name
    assert one.read_bytes() == two.read_bytes()


def test_it_holds_the_package_the_manifest_and_the_licence(workshop, tmp_path):
    path = build_extension.build(workshop, tmp_path)
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        manifest = archive.read("blender_manifest.toml").decode()
        licence = archive.read("LICENSE").decode()
    assert names == sorted(names)
    assert {"__init__.py", "stroke/stroke.py", "worker/launch.py"} <= set(names)
    assert {"worker/install/requirements.txt", "blender/registration.py"} <= set(names)
    assert 'id = "neural_sculpt"' in manifest
    assert "GNU GENERAL PUBLIC LICENSE" in licence
    strange = [n for n in names if "__pycache__" in n or "/." in n or n.startswith(("tests", "."))]
    assert not strange
    assert path.stat().st_size < 2e6
