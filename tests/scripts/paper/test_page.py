# SPDX-License-Identifier: GPL-3.0-or-later
"""The table that the README shows, and the pages of figures."""

import numpy as np
import pytest
from paper.tables.main_table import BEGIN, END, main_table, replaced
from paper.tables.table2 import counts
from pictures.sheet import BLUE, INK, below, beside, curve, label, save
from PIL import Image

from neural_sculpt_addon.common.errors import SculptError

LOCAL = {"tube": 0.0022, "asked": 1e-5, "drift": 1e-7, "normal": 0.5, "turned": 0.01, "bytes": 8e4}
STROKE = {"tube": 0.01, "asked": 1e-3, "drift": 2e-4, "normal": 4.0, "turned": 0.9, "bytes": 69e3}


def edit(shape, factor=1.0):
    """A row of table 2."""
    local = {name: factor * value for name, value in LOCAL.items()}
    methods = {"stroke": STROKE, "local": local}
    return {"shape": shape, "tube_floor": 0.002, "methods": methods}


def edits():
    """One edit of a ball, and two of a cube, the last three times as bad."""
    made = {"ball-0": edit("ball"), "cube-0": edit("cube"), "cube-1": edit("cube", 3)}
    return {f"table2-{key}": row for key, row in made.items()}


def times(points, stroke, local):
    """A row of table 1."""
    return {"shape": "ball", "points": points, "seconds": {"stroke": stroke, "local": local}}


def test_the_main_table_has_means_of_edits_and_medians_of_times():
    rows = edits() | {
        "table1-ball-8": times(8, [4, 9, 5], [0.1, 0.2, 0.3]),
        "table1-ball-128": times(128, [6, 6, 6], [0.1, 0.1, 0.1]),
    }
    (table,) = main_table(rows)
    assert table.columns[:5] == (
        "method",
        "seconds, 8 points",
        "seconds, 128 points",
        "error",
        "drift",
    )
    assert table.rows[0] == pytest.approx(
        ("the paper's stroke method", 5, 6, 1.0, 0.2, 4.0, 0.9, 5.0, 69), abs=1e-9
    )
    mean = 5 / 3
    assert table.rows[1] == pytest.approx(
        (
            "ours, *Detail*",
            0.2,
            0.1,
            0.01 * mean,
            1e-4 * mean,
            0.5 * mean,
            0.01 * mean,
            1.1 * mean,
            133,
        )
    )
    assert "3 random edits (ball 1, cube 2)" in table.about


def test_the_main_table_without_times_or_edits():
    (table,) = main_table(edits())
    assert table.columns[1] == "error"
    assert main_table({"table1-ball-8": times(8, [4], [1])}) == []
    assert counts(list(edits().values())) == "ball 1, cube 2"


def test_the_readme_gets_the_table_between_its_markers():
    tables = main_table(edits())
    once = replaced(f"before\n{BEGIN}\nold\n{END}\nafter\n", tables)
    assert once.startswith(f"before\n{BEGIN}\n\n| method |") and once.endswith(f"{END}\nafter\n")
    assert "old" not in once and "| the paper's stroke method | 1 | 0.2 |" in once
    assert replaced(once, tables) == once
    assert "noise floor. Some are missing.\n" in replaced(once, tables, "Some are missing.")
    with pytest.raises(SculptError, match="no place"):
        replaced(f"{BEGIN} without an end", tables)


def test_a_curve_goes_through_its_values():
    picture = curve(np.linspace(-1, 1, 50), (80, 60), -2, 2).astype(int)
    blue = np.abs(picture - BLUE).sum(axis=2) < 90
    for share in (0.2, 0.5, 0.8):
        column = int(share * 80)
        middle = np.flatnonzero(blue[:, column]).mean()
        assert middle == pytest.approx(30 - 14 * (2 * share - 1), abs=1.5)  # a quarter is 1


def test_pictures_stand_in_rows_with_their_middles_in_line(tmp_path):
    dark = np.zeros((10, 20, 3), np.uint8)
    row = beside([dark, np.zeros((30, 40, 3), np.uint8)])
    assert row.shape == (30, 60, 3)
    assert (row[:10, :20] == 255).all() and (row[10:20, :20] == 0).all()
    column = below([dark, label("name", 40)])
    assert column.shape[1] == 40 and (column[:10, 10:30] == 0).all()
    assert (np.abs(column[10:].astype(int) - INK).sum(axis=2) < 60).any()
    save(tmp_path / "page.png", column)
    assert Image.open(tmp_path / "page.png").size == column.shape[1::-1]
