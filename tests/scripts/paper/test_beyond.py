# SPDX-License-Identifier: GPL-3.0-or-later
"""What is measured beyond the paper, its figures, and the whole command in its small form."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from paper.figures.figures import COLOURS, coloured, drift_map
from paper.tables.beyond import peaked, state_of, tables
from pictures.field_picture import Camera
from PIL import Image
from scipy.signal import find_peaks

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import Preparation
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("count", [1, 2, 7])
def test_profiles_have_so_many_peaks_of_full_height(count):
    v = np.linspace(-1, 1, 4001)
    found, told = find_peaks(peaked(count)(v), height=0)
    assert len(found) == count
    assert told["peak_heights"] == pytest.approx(1, abs=1e-4)
    assert peaked(count)([-1, 1]) == pytest.approx(0)


def test_states_are_told_apart_by_single_bits():
    shape, probes = primitive("sphere"), np.random.default_rng(0).normal(size=(20, 3)) / 2
    *rest, bias = shape.network.parameters
    up = torch.nextafter(bias, torch.full_like(bias, 9))
    nudged = Field(shape.network.with_parameters([*rest, up]))
    assert state_of(shape, probes) == state_of(shape, probes)
    assert state_of(shape, probes) != state_of(nudged, probes)


def test_tables_of_known_rows():
    found = {"pieces": 3, "asked": 0.002, "asked_p95": 0.01}
    rows = {
        "beyond-torn-2": {"height": 2.0, "methods": {"local": found}},
        "beyond-undo": {"strokes": 7, "same": 6},
    }
    torn, undo = tables(rows)
    assert torn.columns[-2:] == ("pieces: local", "asked: local")
    assert torn.rows == ((2.0, 0.16, 3, pytest.approx(2.0)),)
    assert undo.rows == ((7, 6),)


def test_a_decade_of_drift_is_as_much_colour_everywhere():
    """White, pale, orange and dark red stand for 1e-6, 2.15e-5, 4.6e-4 and 1e-2, and beyond."""
    third = 10 ** (4 / 3)
    found = coloured(np.array([0, 1e-6, third * 1e-6, third**2 * 1e-6, 1e-2, 1]))
    assert found == pytest.approx(COLOURS[[0, 0, 1, 2, 3, 3]])
    between = coloured(np.array([third**0.5 * 1e-6]))
    assert between[0] == pytest.approx(COLOURS[:2].mean(axis=0))


def test_where_nothing_moved_all_is_white_but_the_stroke():
    shape = primitive("sphere")
    preparation = Preparation(shape, extract(shape, 64))
    turn = np.linspace(-0.3, 0.3, 8)
    points = 0.6 * np.stack([np.sin(turn), -np.cos(turn), 0 * turn], axis=1)
    problem = pose(preparation, Stroke(points, Brush(0.08, 0.06)))
    picture = drift_map(problem, shape, Camera((0, -1, 0), half=0.7), 40)
    middle = picture[20, 20]
    assert (middle < 170).all()
    away = picture[8, 20].astype(float)  # above the stroke, on the ball
    assert np.ptp(away) <= 8 and away.min() > 170
    assert (picture[0, 0] == 255).all()


@pytest.mark.long
def test_the_small_form_of_the_whole_command(tmp_path):
    """All tables come, a second start makes no row again, and ours has the least drift."""
    folders = ["--work", str(tmp_path / "rows"), "--out", str(tmp_path / "tables")]
    command = [sys.executable, str(ROOT / "scripts" / "paper.py"), "--quick", *folders]
    subprocess.run(command, check=True, capture_output=True, timeout=2400)
    names = {path.stem for path in (tmp_path / "tables").glob("table-*.csv")}
    later = ["3", "4a", "4b", "4c", "5a", "5b", "5c", "5d"]
    assert names == {f"table-{n}" for n in ["main", "1", "2a", "2b", "2c", *later]}
    with (tmp_path / "tables" / "table-2c.csv").open() as file:
        drift = {row["method"]: float(row["drift"]) for row in csv.DictReader(file)}
    assert min(drift, key=drift.get) == "local"
    page = (tmp_path / "tables" / "README.md").read_text(encoding="utf-8")
    families = "profiles", "modulations", "radius-intensity"
    for name in ("methods", "drift", "peaks", *families, "frame", "sequence"):
        assert Image.open(tmp_path / "tables" / f"{name}.png").width >= 200
        assert f"![{name}]({name}.png)" in page
    again = subprocess.run(command, check=True, capture_output=True, text=True, timeout=120)
    count = len([*(tmp_path / "rows").glob("*.json")]) - 1  # about.json is no row
    assert f"{count} of {count} rows are finished." in again.stdout
