# SPDX-License-Identifier: GPL-3.0-or-later
"""What is measured beyond the paper, and the whole command in its small form."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from paper.beyond import peaked, state_of, tables
from scipy.signal import find_peaks

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.primitives import primitive

ROOT = Path(__file__).resolve().parents[2]


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


@pytest.mark.long
def test_the_small_form_of_the_whole_command(tmp_path):
    """All tables come, a second start makes no row again, and ours has the least drift."""
    folders = ["--work", str(tmp_path / "rows"), "--out", str(tmp_path / "tables")]
    command = [sys.executable, str(ROOT / "scripts" / "paper.py"), "--quick", *folders]
    subprocess.run(command, check=True, capture_output=True, timeout=2400)
    names = {path.stem for path in (tmp_path / "tables").glob("table-*.csv")}
    assert names == {
        f"table-{n}" for n in ["1", "2a", "2b", "2c", "3", "4a", "4b", "4c", "5a", "5b", "5c", "5d"]
    }
    with (tmp_path / "tables" / "table-2c.csv").open() as file:
        drift = {row["method"]: float(row["drift"]) for row in csv.DictReader(file)}
    assert min(drift, key=drift.get) == "local"
    again = subprocess.run(command, check=True, capture_output=True, text=True, timeout=120)
    count = len([*(tmp_path / "rows").glob("*.json")]) - 1  # about.json is no row
    assert f"{count} of {count} rows are finished." in again.stdout
