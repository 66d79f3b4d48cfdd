# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: whole runs in a process of their own, and every refusal in one sentence."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.cli import main
from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field import points_file
from neural_sculpt_addon.field.checkpoint import layer_to_bytes, load, save
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.fit import consolidate
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.primitives import FOLDER
from neural_sculpt_addon.field.problem.metrics import find_surface
from tests.field.analytic import ball
from tests.field.random_layers import random_layer

ROOT = Path(__file__).parents[2]
STROKE = {"points": [[0.5, 0, 0], [0.48, 0.14, 0]], "radius": 0.1, "intensity": 0.03}


def run(*arguments, cwd, start=("-m", "neural_sculpt_addon")):
    """The command in a fresh interpreter, as a user starts it; its imports find no bpy."""
    return subprocess.run(
        [sys.executable, *start, *map(str, arguments)],
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
    """Two strokes by the default solver: what is near them moves, the rest is as it was."""
    write_strokes(
        folder / "strokes.json", {**STROKE, "name": "one"}, {**STROKE, "intensity": -0.02}
    )
    names = ("--mesh", "out.ply", "--resolution", "48", "--report", "report.json")
    done = run(
        *("apply", "ball.safetensors", "strokes.json", "-o", "out.safetensors", *names), cwd=folder
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout) == {"network": "out.safetensors", "strokes": 2}
    report = json.loads((folder / "report.json").read_text())
    assert report["network"] == "ball.safetensors"
    assert [stroke["solver"] for stroke in report["strokes"]] == ["local", "local"]
    before, after = load(folder / "ball.safetensors"), load(folder / "out.safetensors")
    assert after.detail.levels and not before.detail.levels
    n = np.random.default_rng(0).normal(size=(2000, 3))
    n *= 0.5 / np.linalg.norm(n, axis=1, keepdims=True)
    away = n[n[:, 0] < 0]
    np.testing.assert_array_equal(before.sample(away).f, after.sample(away).f)
    assert -0.02 < after.sample([STROKE["points"][0]]).f[0] < -0.005  # 0.03 - 0.02 higher
    assert trimesh.load_mesh(folder / "out.ply").is_watertight


def test_apply_by_the_paper(folder, monkeypatch, capsys):
    strokes = [
        {**STROKE, "name": "one"},
        {**STROKE, "mirror": "X", "name": "two", "intensity": -0.02},
    ]
    write_strokes(folder / "strokes.json", *strokes)
    names = ("--mesh", "out.ply", "--resolution", "48", "--report", "report.json")
    monkeypatch.chdir(folder)
    command = ["apply", "ball.safetensors", "strokes.json", "-o", "out.pth", *names]
    assert main([*command, "--solver", "paper", "--epochs", "1"]) == 0
    assert json.loads(capsys.readouterr().out) == {"network": "out.pth", "strokes": 2}
    assert load(folder / "out.pth").network.widths == (75,)
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
    assert (info["levels"], info["coefficients"]) == ([], 0)
    assert info["bytes"] == {"network": 4 * info["parameters"], "detail": 0, "detail_in_memory": 0}
    assert info["components"] == 1
    np.testing.assert_allclose([info["low"], info["high"]], [[-0.5] * 3, [0.5] * 3], atol=1e-3)
    for suffix in ("ply", "obj", "stl", "glb", "off"):
        path = folder / f"mesh.{suffix}"
        options = ["-o", str(path), "--resolution", "32"]
        assert main(["mesh", str(folder / "ball.safetensors"), *options]) == 0
        summary = json.loads(capsys.readouterr().out)
        assert summary["triangles"] == len(trimesh.load_mesh(path).faces) > 1000


def test_info_of_detail(folder, capsys):
    layer = random_layer(0, levels=(5, 7))
    save(ball(0.5).plus(layer), folder / "detailed.safetensors")
    assert main(["info", str(folder / "detailed.safetensors")]) == 0
    info = json.loads(capsys.readouterr().out)
    assert info["levels"] == [
        {"level": k, "spacing": 2**-k, "coefficients": len(layer[k].index)} for k in (5, 7)
    ]
    assert info["coefficients"] == len(layer[5].index) + len(layer[7].index)
    assert info["bytes"]["detail"] == len(layer_to_bytes(layer))
    assert info["bytes"]["detail_in_memory"] >= 4 * info["coefficients"]


def test_sample(folder, monkeypatch, capsys):
    x = np.random.default_rng(0).uniform(-0.9, 0.9, (3000, 3))
    np.save(folder / "points.npy", x)
    monkeypatch.chdir(folder)
    assert main(["sample", "ball.safetensors", "points.npy", "-o", "out.npz"]) == 0
    assert json.loads(capsys.readouterr().out) == {"samples": "out.npz", "points": 3000}
    with np.load(folder / "out.npz") as samples:
        assert set(samples) == {"f", "gradient"}
        f, gradient = samples["f"], samples["gradient"]
    assert f.dtype == gradient.dtype == np.float32
    np.testing.assert_allclose(f, (np.sum(x**2, axis=1) - 0.25), atol=1e-5)  # of a ball, R = 1/2
    np.testing.assert_allclose(gradient, 2 * x, atol=1e-4)


def test_consolidate(folder, monkeypatch):
    """A shipped sphere with a bump becomes a plain network that the authors' tool can load."""
    monkeypatch.setattr(consolidate, "CONTINUED", replace(consolidate.CONTINUED, steps=100))
    strokes = [{"points": [[0.6, 0, 0]], "radius": 0.2, "intensity": 0.05}]
    write_strokes(folder / "strokes.json", *strokes)
    sphere, bumpy, plain = (str(p) for p in (FOLDER / "sphere.safetensors", *(
        folder / name for name in ("bumpy.safetensors", "plain.pth"))))  # fmt: skip
    assert main(["apply", sphere, str(folder / "strokes.json"), "-o", bumpy]) == 0
    assert main(["apply", sphere, str(folder / "strokes.json"), "-o", plain]) == 1
    report = folder / "lost.json"
    assert main(["consolidate", bumpy, "-o", plain, "--report", str(report)]) == 0
    lost = json.loads(report.read_text())
    assert (lost["components_before"], lost["components"]) == (1, 1)
    assert lost["distance_mean"] < lost["distance_p95"] < lost["distance_max"] < 0.05
    assert load(plain).network.widths == (128, 128)
    assert not load(plain).detail.levels


def test_fit_a_draft(folder, monkeypatch):
    trimesh.creation.icosphere(3, radius=2.0).apply_translation([5, 0, 1]).export(folder / "in.stl")
    options = ("--preset", "draft", "--report", "report.json", "--seed", "1")
    monkeypatch.chdir(folder)
    assert main(["fit", "in.stl", "-o", "out.safetensors", *options]) == 0
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
    field = load(out)
    assert field.network.widths == (64, 64)
    high = 0.25 * 1.7 / 2
    assert find_surface(field, [[0, 0, high], [0.3, 0, -high]]).distance.max() < 0.02


def test_fit_a_sheet_by_choice_with_a_word(folder, capsys):
    (folder / "in.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3\nf 1 3 4\n")
    command = ["fit", str(folder / "in.obj"), "-o", str(folder / "out.safetensors")]
    command += ["--preset", "draft", "--width", "64"]
    assert main(command) == 1
    assert "--open thickness" in capsys.readouterr().err
    assert main([*command, "--open", "thickness"]) == 0
    assert "Open parts got a thickness of 0.04." in capsys.readouterr().err
    field = load(folder / "out.safetensors")
    high = 0.02 * 1.7 / 2
    assert find_surface(field, [[0, 0, high], [0.3, 0, -high]]).distance.max() < 0.01


def stroke_file(path, **words):
    write_strokes(path / "strokes.json", {**STROKE, **words})


def damage(path, **_):
    data = (path / "ball.safetensors").read_bytes()
    (path / "ball.safetensors").write_bytes(data[: len(data) // 2])


def poison(path):
    field = ball(0.5)
    field.network.weights[0][0, 0] = float("nan")
    save(field, path / "ball.safetensors")


def empty_field(path):
    one = torch.ones(1)
    network = Siren((torch.zeros(1, 3), torch.ones(1, 1)), (one, one), (1.0,))
    save(Field(network), path / "ball.safetensors")


def detailed(path):
    save(ball(0.5).plus(random_layer(0)), path / "ball.safetensors")


def points(array):
    return lambda path: np.save(path / "points.npy", array)


APPLY = ["apply", "ball.safetensors", "strokes.json", "-o", "out.safetensors"]
MESH = ["mesh", "ball.safetensors", "-o", "out.ply"]
FIT = ["fit", "in.obj", "-o", "out.safetensors"]
SAMPLE = ["sample", "ball.safetensors", "points.npy", "-o", "out.npz"]
CONSOLIDATE = ["consolidate", "ball.safetensors", "-o", "out.safetensors"]
NOTHING = lambda path: None  # noqa: E731

BAD = {
    "a film with a thickness": (
        lambda p: (p / "in.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        [*FIT, "--open", "solid", "--thickness", "0.1"],
        "--thickness goes with --open thickness",
    ),
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
    "detail as .pth": (detailed, [*APPLY[:-1], "out.pth"], "--solver network"),
    "strokes as .pth, told before they are solved": (
        lambda p: stroke_file(p, points=[[0.9, 0, 0]]),
        [*APPLY[:-1], "out.pth"],
        "--solver network",
    ),
    "a fit as .pth, told before the mesh is read": (
        NOTHING,
        [*FIT[:-1], "out.pth"],
        "--no-detail",
    ),
    "detail for the network's solver": (detailed, [*APPLY, "--solver", "network"], "Consolidate"),
    "detail for the paper's solver": (detailed, [*APPLY, "--solver", "paper"], "Consolidate"),
    "a seed below zero": (NOTHING, [*CONSOLIDATE, "--seed", "-1"], "from 0 to 2^63"),
    "a seed beyond 64 bits": (NOTHING, [*CONSOLIDATE, "--seed", str(2**64)], "from 0 to 2^63"),
    "no points": (NOTHING, SAMPLE, "cannot be read"),
    "points in a plane": (points(np.zeros((4, 2))), SAMPLE, "(N, 3)"),
    "one point": (points(np.zeros(3)), SAMPLE, "(N, 3)"),
    "NaN as a point": (points(np.full((1, 3), np.nan)), SAMPLE, "NaN"),
    "points in words": (points(np.array([["a", "b", "c"]])), SAMPLE, "(N, 3)"),
    "complex points": (points(np.zeros((1, 3), complex)), SAMPLE, "(N, 3)"),
    "points that are objects": (points(np.array([[{}] * 3])), SAMPLE, "no NumPy array"),
    "points that are noise": (
        lambda p: (p / "points.npy").write_bytes(np.random.default_rng(0).bytes(500)),
        SAMPLE,
        "no NumPy array",
    ),
    "an archive as points": (
        lambda p: np.savez((p / "points.npy").open("wb"), x=np.zeros((1, 3))),
        SAMPLE,
        "no NumPy array",
    ),
    "samples of no kind": (points(np.zeros((1, 3))), [*SAMPLE[:-1], "out.npy"], "ends in"),
    "a network without units": (NOTHING, [*CONSOLIDATE, "--width", "0"], "units wide"),
    "a network too wide": (NOTHING, [*CONSOLIDATE, "--width", "100000"], "units wide"),
    "a surface to consolidate": (empty_field, CONSOLIDATE, "no surface"),
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


SENSELESS = {
    "The radius is 1e-30": {"radius": 1e-30},
    "The intensity is 1e+308": {"intensity": 1e308},
    "With its pressure": {"radius": 1e-3, "radius_factors": [0.05, 0.05]},
    "radius_factors are": {"radius_factors": [1e300, 1]},
    "no width": {"radius_factors": [1e-300, 1e-300]},
    "profile": {"profile": {"points": [[-1e308, 0], [1e308, 0]]}},
    "no field": {"x" * 5000: 1},
    "name": {"name": ["x" * 5000]},
}


@pytest.mark.parametrize("word", SENSELESS)
def test_senseless_strokes_are_refused_in_one_sentence(folder, capsys, monkeypatch, word):
    stroke_file(folder, **SENSELESS[word])
    monkeypatch.chdir(folder)
    assert main(APPLY) == 1
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert word in err
    assert len(err) < 300


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


class Harm:
    """An object whose unpickling would write a file."""

    def __init__(self, marker):
        self.marker = marker

    def __reduce__(self):
        return os.system, (f"touch {self.marker}",)


def test_nothing_in_a_file_of_points_is_executed(folder, monkeypatch):
    np.save(folder / "points.npy", np.array([[Harm(folder / "executed")] * 3]))
    monkeypatch.chdir(folder)
    assert main(SAMPLE) == 1
    assert not (folder / "executed").exists()


@settings(max_examples=200)
@given(st.data())
def test_any_damage_to_a_file_of_points_is_a_sentence(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "points.npy"
    np.save(path, np.random.default_rng(0).uniform(-1, 1, (9, 3)))
    whole = bytearray(path.read_bytes())
    place = data.draw(st.integers(0, 130) | st.integers(0, len(whole)))
    whole[place : place + data.draw(st.integers(0, 300))] = data.draw(st.binary(max_size=8))
    path.write_bytes(whole)
    try:
        read = points_file.read(path)
    except SculptError as error:
        assert "\n" not in str(error)
        return
    assert read.shape[1:] == (3,) and np.isfinite(read).all()


def test_a_refusal_in_a_process_of_its_own(folder):
    (folder / "ball.safetensors").rename(folder / "ball.pth")
    done = run("apply", "ball.pth", "strokes.json", "-o", "out.pth", cwd=folder)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.strip().startswith("neural_sculpt_addon: ball.pth")
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not bound the memory")
def test_too_little_memory_is_told_in_one_sentence(folder):
    """The lattice of 1024 cells has 1027^3 points of four bytes: 4.3e9, more than 4 GiB."""
    code = """
import resource, sys
from neural_sculpt_addon.cli import main
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
sys.exit(main(sys.argv[1:]))
"""
    told = "neural_sculpt_addon: out of memory; try a lower resolution."
    after = " out.safetensors is written."
    for arguments, error in ((MESH, told), ([*APPLY, "--mesh", "out.ply"], told + after)):
        done = run(*arguments, "--resolution", 1024, cwd=folder, start=("-c", code))
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr.strip() == error
        assert not (folder / "out.ply").exists()
    assert len(load(folder / "out.safetensors").detail.coefficients)


@pytest.mark.parametrize(
    ("when", "told"), [("edit", "Nothing was written."), ("mesh", "out.safetensors is written.")]
)
def test_what_is_there_after_a_cancel_is_told(folder, when, told):
    """Ctrl C in the first stroke, and in the mesh that comes after the field."""
    code = """
import _thread, signal, sys
from neural_sculpt_addon import cli
signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell ignores for its jobs
written = cli._save
def show(fraction, message):
    _thread.interrupt_main()
def save(field, options):
    written(field, options)
    _thread.interrupt_main()
if sys.argv.pop(1) == "edit":
    cli._show = show
else:
    cli._save = save
sys.exit(cli.main(sys.argv[1:]))
"""
    done = run(when, *APPLY, "--mesh", "out.ply", cwd=folder, start=("-c", code))
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.strip().startswith("neural_sculpt_addon: cancelled")
    assert done.stderr.strip().endswith(told)
    assert (folder / "out.safetensors").exists() == (when == "mesh")
    assert not (folder / "out.ply").exists()


def test_a_wrong_command_explains_the_usage(capsys):
    for arguments in (
        [],
        ["melt"],
        ["apply"],
        ["mesh", "a.pth", "-o", "b.ply", "--resolution", "x"],
        ["consolidate", "a.pth", "-o", "b.pth", "--width", "x"],
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
