# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: whole runs in a process of their own, and every refusal in one sentence."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from neural_sculpt_addon.cli import main
from neural_sculpt_addon.field.checkpoint import load, save
from neural_sculpt_addon.field.metrics import find_surface
from neural_sculpt_addon.field.network import Siren
from tests.field.analytic import ball

ROOT = Path(__file__).parents[2]
STROKE = {"points": [[0.5, 0, 0], [0.48, 0.14, 0]], "radius": 0.1, "intensity": 0.03}


def run(*arguments, cwd):
    """The command in a fresh interpreter, as a user starts it; its imports find no bpy."""
    return subprocess.run(
        [sys.executable, "-m", "neural_sculpt_addon", *map(str, arguments)],
        cwd=cwd,
        env={"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )


@pytest.fixture
def folder(tmp_path):
    """A folder with a field and a stroke file."""
    save(ball(0.5, spare=60), tmp_path / "ball.safetensors")
    write_strokes(tmp_path / "strokes.json", STROKE)
    return tmp_path


def write_strokes(path, *strokes, version=1):
    path.write_text(json.dumps({"version": version, "strokes": strokes}))


def test_apply_from_start_to_end(folder):
    strokes = [
        {**STROKE, "name": "one"},
        {**STROKE, "mirror": "X", "name": "two", "intensity": -0.02},
    ]
    write_strokes(folder / "strokes.json", *strokes)
    names = ("--mesh", "out.ply", "--resolution", "48", "--report", "report.json")
    done = run(
        *("apply", "ball.safetensors", "strokes.json", "-o", "out.pth", *names),
        *("--solver", "paper", "--epochs", "1"),
        cwd=folder,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout) == {"network": "out.pth", "strokes": 2}
    assert load(folder / "out.pth").widths == (75,)
    report = json.loads((folder / "report.json").read_text())
    assert report["network"] == "ball.safetensors"
    assert [stroke["stroke"] for stroke in report["strokes"]] == ["one", "two"]
    for stroke in report["strokes"]:
        assert 0 < stroke["tube_mean"] <= stroke["tube_p95"] <= stroke["tube_max"]
    mesh = trimesh.load_mesh(folder / "out.ply")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(np.pi / 6, rel=0.05)
    away = find_surface(load(folder / "out.pth"), mesh.vertices).distance
    assert away.max() < 1e-3


def test_info_and_mesh(folder, capsys):
    assert main(["info", str(folder / "ball.safetensors")]) == 0
    info = json.loads(capsys.readouterr().out)
    assert info["widths"] == [75]
    assert info["parameters"] == 75 * 3 + 75 + 75 + 1
    assert info["omegas"] == [1.0]
    assert info["components"] == 1
    np.testing.assert_allclose([info["low"], info["high"]], [[-0.5] * 3, [0.5] * 3], atol=1e-3)
    for suffix in ("ply", "obj", "stl", "glb", "off"):
        path = folder / f"mesh.{suffix}"
        options = ["-o", str(path), "--resolution", "32"]
        assert main(["mesh", str(folder / "ball.safetensors"), *options]) == 0
        summary = json.loads(capsys.readouterr().out)
        assert summary["triangles"] == len(trimesh.load_mesh(path).faces) > 1000


def test_fit_a_draft(folder):
    trimesh.creation.icosphere(3, radius=2.0).apply_translation([5, 0, 1]).export(folder / "in.stl")
    options = ("--preset", "draft", "--report", "report.json", "--seed", "1")
    done = run("fit", "in.stl", "-o", "out.safetensors", *options, cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads((folder / "report.json").read_text())
    np.testing.assert_allclose(report["center"], [5, 0, 1], atol=0.05)
    assert report["scale"] == pytest.approx(4.0 / 1.7, rel=0.01)
    n = np.random.default_rng(0).normal(size=(500, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    away = find_surface(load(folder / "out.safetensors"), 0.85 * n).distance
    assert away.mean() < 0.02


def test_fit_a_sheet_with_a_thickness_and_a_width(folder):
    (folder / "in.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3\nf 1 3 4\n")
    options = ["--preset", "draft", "--thickness", "0.5", "--width", "64"]
    out = folder / "out.safetensors"
    assert main(["fit", str(folder / "in.obj"), "-o", str(out), *options]) == 0
    network = load(out)
    assert network.widths == (64, 64)
    high = 0.25 * 1.7 / 2
    assert find_surface(network, [[0, 0, high], [0.3, 0, -high]]).distance.max() < 0.02


def stroke_file(path, **words):
    write_strokes(path / "strokes.json", {**STROKE, **words})


def damage(path, **_):
    data = (path / "ball.safetensors").read_bytes()
    (path / "ball.safetensors").write_bytes(data[: len(data) // 2])


def poison(path):
    network = ball(0.5)
    network.weights[0][0, 0] = float("nan")
    save(network, path / "ball.safetensors")


def empty_field(path):
    save(Siren((torch.zeros(1, 3), torch.ones(1, 1)), (torch.ones(1), torch.ones(1)), (1.0,)),
         path / "ball.safetensors")  # fmt: skip


APPLY = ["apply", "ball.safetensors", "strokes.json", "-o", "out.safetensors"]
MESH = ["mesh", "ball.safetensors", "-o", "out.ply"]
FIT = ["fit", "in.obj", "-o", "out.safetensors"]
NOTHING = lambda path: None  # noqa: E731

BAD = {
    "no network": (lambda p: (p / "ball.safetensors").unlink(), APPLY, "cannot be read"),
    "half a network": (damage, APPLY, "damaged"),
    "NaN weights": (poison, APPLY, "NaN"),
    "a field without surface": (empty_field, MESH, "no surface"),
    "info without surface": (empty_field, ["info", "ball.safetensors"], "no surface"),
    "no strokes": (lambda p: (p / "strokes.json").unlink(), APPLY, "cannot be read"),
    "no JSON": (lambda p: (p / "strokes.json").write_text("{"), APPLY, "JSON"),
    "no text": (lambda p: (p / "strokes.json").write_bytes(b"\xff\xfe\x00"), APPLY, "UTF-8"),
    "newer strokes": (
        lambda p: write_strokes(p / "strokes.json", version=2),
        APPLY,
        "Update Neural Sculpt",
    ),
    "a stroke off the surface": (
        lambda p: stroke_file(p, points=[[0.9, 0, 0]]),
        APPLY,
        "off the surface",
    ),
    "a NaN in a stroke": (
        lambda p: stroke_file(p, points=[[float("nan"), 0, 0]]),
        APPLY,
        "Stroke 1",
    ),
    "no such solver": (NOTHING, [*APPLY, "--solver", "magic"], "solver"),
    "no epochs": (NOTHING, [*APPLY, "--solver", "paper", "--epochs", "0"], "epochs"),
    "an output of no kind": (NOTHING, [*APPLY[:-1], "out.txt"], "ends in"),
    "an output nowhere": (NOTHING, [*APPLY[:-1], "absent/out.pth"], "no folder"),
    "a mesh of no kind": (NOTHING, [*APPLY, "--mesh", "out.fbx"], "ends in"),
    "a report nowhere": (NOTHING, [*APPLY, "--report", "absent/report.json"], "no folder"),
    "a folder as output": (
        lambda p: (p / "out.ply").mkdir(),
        [*MESH, "--resolution", "16"],
        "cannot be written",
    ),
    "no cells": (NOTHING, [*MESH, "--resolution", "0"], "resolution"),
    "fewer than no cells": (NOTHING, [*MESH, "--resolution", "-5"], "resolution"),
    "more cells than memory": (NOTHING, [*MESH, "--resolution", "100000"], "resolution"),
    "more cells for the proxy": (
        NOTHING,
        [*APPLY, "--mesh", "out.ply", "--resolution", "100000"],
        "resolution",
    ),
    "no mesh": (NOTHING, FIT, "cannot be read"),
    "an empty mesh": (lambda p: (p / "in.obj").write_text("v 0 0 0\n"), FIT, "in.obj"),
    "a thickness below zero": (
        lambda p: trimesh.creation.box().export(p / "in.obj"),
        [*FIT, "--thickness", "-1"],
        "positive",
    ),
    "a mesh of one triangle": (
        lambda p: (p / "in.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        FIT,
        "",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_in_one_sentence(folder, capsys, monkeypatch, name):
    spoil, arguments, word = BAD[name]
    spoil(folder)
    monkeypatch.chdir(folder)
    assert main(arguments) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert word in err
    assert err.count("\n") == 1
    assert len(err) < 400
    assert not list(folder.glob("out.safetensors"))


def test_a_refusal_in_a_process_of_its_own(folder):
    (folder / "ball.safetensors").rename(folder / "ball.pth")
    done = run("apply", "ball.pth", "strokes.json", "-o", "out.pth", cwd=folder)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.strip().startswith("neural_sculpt_addon: ball.pth")
    assert "Traceback" not in done.stderr


def test_a_wrong_command_explains_the_usage(capsys):
    for arguments in (
        [],
        ["melt"],
        ["apply"],
        ["mesh", "a.pth", "-o", "b.ply", "--resolution", "x"],
    ):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        assert caught.value.code == 2
        assert "usage:" in capsys.readouterr().err


def test_help_needs_no_torch():
    code = """
import sys
from neural_sculpt_addon.cli import main
try:
    main(["--help"])
except SystemExit:
    assert not {"torch", "bpy", "numpy"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True)
