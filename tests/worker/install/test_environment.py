# SPDX-License-Identifier: GPL-3.0-or-later
"""Pythons probed by running them; installations refused by the real pip, without a network."""

import errno
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.worker.install import environment
from neural_sculpt_addon.worker.install import pip as installer
from neural_sculpt_addon.worker.install.environment import (
    REQUIREMENTS,
    configured_python,
    create,
    environment_python,
    installed,
    worker_command,
)
from neural_sculpt_addon.worker.install.interpreter import candidate_pythons, check_python
from neural_sculpt_addon.worker.install.pip import UnsuitableError, explain
from tests.worker.support import ROOT

MODULES = ("torch", "numpy", "scipy", "skimage", "trimesh", "safetensors", "igl")
MARKER = "neural_sculpt_environment.txt"


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """A Python without anything."""
    folder = tmp_path_factory.mktemp("bare")
    venv.create(folder, with_pip=False, symlinks=os.name != "nt")
    return environment_python(folder)


@pytest.fixture
def offline(tmp_path, monkeypatch) -> Path:
    """pip sees a folder of wheels and nothing else in the world."""
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(wheels))
    return wheels


def wheel(folder: Path, name: str, version: str, *requires: str) -> None:
    """The smallest wheel that pip installs: metadata only."""
    info = f"{name}-{version}.dist-info"
    metadata = [f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}"]
    metadata += [f"Requires-Dist: {requirement}" for requirement in requires]
    tags = "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    with zipfile.ZipFile(folder / f"{name}-{version}-py3-none-any.whl", "w") as archive:
        archive.writestr(f"{info}/METADATA", "\n".join(metadata) + "\n")
        archive.writestr(f"{info}/WHEEL", tags)
        archive.writestr(f"{info}/RECORD", "")


def pinned_wheels(folder: Path, *torch_requires: str) -> None:
    """Empty wheels of all that the worker requires."""
    for line in REQUIREMENTS.read_text().splitlines():
        if line and not line.startswith("#"):
            pin = line.partition("#")[0].partition(";")[0].strip()
            name, version = pin.split("==")
            wheel(folder, name.replace("-", "_"), version, *(torch_requires * (name == "torch")))


def test_it_needs_the_standard_library_only():
    script = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from neural_sculpt_addon.worker.install import environment\n"
        "import neural_sculpt_addon\n"
        "print([m for m in ('numpy', 'torch', 'bpy') if m in sys.modules])"
    )
    command = [sys.executable, "-I", "-S", "-c", script]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ran.stdout.strip(), ran.stderr) == ("[]", "")


def test_this_python_can_be_the_worker():
    import torch

    found = check_python(sys.executable)
    assert found.ready
    assert found.python == Path(sys.executable)
    assert found.version == sys.version_info[:3]
    assert found.torch == torch.__version__
    assert found.device == ("cuda" if torch.cuda.is_available() else "cpu")


def test_a_bare_python_lacks_all(bare):
    found = check_python(bare)
    assert (found.torch, found.device, found.missing) == (None, None, MODULES)
    assert not found.ready


def test_a_broken_torch_is_missing_with_its_reason(tmp_path):
    venv.create(tmp_path, with_pip=False, symlinks=os.name != "nt")
    [packages] = (*tmp_path.glob("lib/python*/site-packages"), *tmp_path.glob("Lib/site-packages"))
    (packages / "torch.py").write_text("raise OSError('libgomp.so is not there')")
    found = check_python(environment_python(tmp_path))
    assert found.missing[0] == "torch (libgomp.so is not there)"
    assert found.torch is None


def test_the_environment_of_this_process_does_not_bend_the_probe(tmp_path, bare, monkeypatch):
    (tmp_path / "torch.py").write_text("raise SystemExit(9)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert "torch" in check_python(bare).missing


@pytest.mark.parametrize("name", ["absent", "folder", "text", "tool"])
def test_what_is_no_python_is_refused_in_a_sentence(tmp_path, name):
    (tmp_path / "folder").mkdir()
    (tmp_path / "text").write_text("hello")
    (tmp_path / "tool").write_text("#!/bin/sh\necho 1\n")
    (tmp_path / "tool").chmod(0o755)
    with pytest.raises(SculptError, match="choose another Python"):
        check_python(tmp_path / name)


def test_candidates_run_and_the_first_has_the_version_of_this_one():
    first = next(candidate_pythons())
    assert first.version == sys.version_info[:3]
    assert subprocess.run([first.python, "-c", ""], check=False).returncode == 0


def test_the_worker_is_named_by_preference_then_variable_then_installation(
    tmp_path, bare, monkeypatch
):
    monkeypatch.delenv(environment.ENVIRONMENT_VARIABLE, raising=False)
    with pytest.raises(SculptError, match="not installed"):
        configured_python("", tmp_path)
    venv.create(tmp_path, with_pip=False, symlinks=os.name != "nt")
    (tmp_path / MARKER).write_bytes(REQUIREMENTS.read_bytes())
    assert configured_python(None, tmp_path) == environment_python(tmp_path)
    monkeypatch.setenv(environment.ENVIRONMENT_VARIABLE, sys.executable)
    assert configured_python("", tmp_path) == Path(sys.executable)
    assert configured_python(str(bare), tmp_path) == bare
    with pytest.raises(SculptError, match="no Python at"):
        configured_python(tmp_path / "absent", tmp_path)


def test_an_installation_of_other_requirements_or_an_incomplete_one_is_none(tmp_path):
    assert not installed(tmp_path)
    venv.create(tmp_path, with_pip=False, symlinks=os.name != "nt")
    for marker, whole in ((b"incomplete\n", False), (REQUIREMENTS.read_bytes(), True)):
        (tmp_path / MARKER).write_bytes(marker)
        assert installed(tmp_path) is whole
    environment_python(tmp_path).unlink()
    assert not installed(tmp_path)


def test_the_command_is_isolated(bare):
    command = worker_command(bare)
    assert command[:3] == [str(bare), "-I", "-u"]
    assert Path(command[3]).is_file()


def test_cuda_is_never_installed_unasked(tmp_path, offline):
    pinned_wheels(offline, "nvidia-cudnn-cu13")
    wheel(offline, "nvidia_cudnn_cu13", "9.20")
    with pytest.raises(SculptError, match=r"gigabytes of CUDA.*PIP_EXTRA_INDEX_URL"):
        create(tmp_path / "env", sys.executable)
    assert not list((tmp_path / "env").rglob("nvidia*"))
    assert not list((tmp_path / "env").rglob("torch*"))
    assert not installed(tmp_path / "env")


@pytest.mark.long
def test_no_builds_for_this_python_is_said(tmp_path, offline):
    with pytest.raises(SculptError, match="no ready-made builds"):
        create(tmp_path / "env", sys.executable)


@pytest.mark.long
def test_the_marker_stays_incomplete_until_the_self_test_has_passed(tmp_path, offline):
    pinned_wheels(offline)
    seen: list[float] = []

    def watch(fraction: float, message: str) -> None:
        assert (tmp_path / "env" / MARKER).read_bytes() == b"incomplete\n"
        seen.append(fraction)

    with pytest.raises(SculptError, match=r"installed but lacks torch, numpy.*install\.log"):
        create(tmp_path / "env", sys.executable, watch)
    assert seen == sorted(seen)
    assert seen[-1] == 0.95
    assert list((tmp_path / "env").rglob("torch-*.dist-info"))
    assert not installed(tmp_path / "env")
    assert "torch==" in (tmp_path / "env" / "install.log").read_text()


@pytest.mark.long
def test_an_installation_can_be_cancelled_and_begun_again(tmp_path, offline):
    def give_up(fraction: float, message: str) -> None:
        if fraction > 0:
            raise Cancelled

    for _ in range(2):
        with pytest.raises(Cancelled):
            create(tmp_path / "env", sys.executable, give_up)
        assert (tmp_path / "env" / MARKER).read_bytes() == b"incomplete\n"


def test_a_folder_with_other_files_is_left_alone(tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(SculptError, match="choose an empty folder"):
        create(tmp_path, sys.executable)
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(SculptError, match="cannot be installed in"):
        create(tmp_path / "file" / "env", sys.executable)


def test_too_little_space_is_said_before_anything_is_fetched(tmp_path, monkeypatch):
    monkeypatch.setattr(environment, "SPACE", 10**18)
    with pytest.raises(SculptError, match=r"GB left"):
        create(tmp_path / "env", sys.executable)
    assert list((tmp_path / "env").iterdir()) == []


@pytest.mark.parametrize(
    ("output", "sentence"),
    [
        (f"ERROR: [Errno {errno.ENOSPC}] No space left on device", "disk is full"),
        ("OSError: [WinError 225] Operation did not complete", "virus scanner"),
        ("Temporary failure in name resolution\nNo matching distribution found", "the network"),
        ("ReadTimeoutError(\"HTTPSConnectionPool(host='x'): Read timed out.\")", "the network"),
        (
            "SSLError(SSLCertVerificationError(1, '[SSL: CERTIFICATE_VERIFY_FAILED]",
            "proxy and cert",
        ),
        ("PermissionError: [WinError 5] Access is denied: 'torch.dll'", "could not be written"),
        ("The virtual environment was not created: ensurepip is not available.", "python3-venv"),
        ("ERROR: No matching distribution found for torch==2.13.0", "no ready-made builds"),
        ("something\nstrange happened\n", "strange happened"),
        ("", "no output"),
    ],
)
def test_failures_become_sentences(output, sentence):
    assert sentence in str(explain(output, Path("install.log")))


def test_only_failures_of_one_python_let_the_next_one_try(tmp_path):
    log = tmp_path / "log"
    with pytest.raises(UnsuitableError):
        installer.run([sys.executable, "-c", "import sys; sys.exit('No module named venv')"], log)
    with pytest.raises(SculptError) as caught:
        installer.run([sys.executable, "-c", "import sys; sys.exit('Errno 28')"], log)
    assert not isinstance(caught.value, UnsuitableError)
    assert "Errno 28" in log.read_text()
