# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that are led around the rim of a thin part."""

import numpy as np
import pytest

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import thin_lens


@pytest.mark.parametrize("end", [0.9, pytest.param(0.3, marks=pytest.mark.long)])
def test_a_lip_is_raised_around_the_rim(end):
    """The lens is 0.1 thick and 1 wide; the stroke goes from its upper side to its lower one."""
    turn = np.linspace(1.2, -end, 14)
    y = 0.05 * np.sin(3 * turn)
    out = np.sqrt(1 - (y / 0.5) ** 2)
    points = np.stack([0.5 * out * np.cos(turn), y, 0.05 * out * np.sin(turn)], axis=1)
    report = sculpt(prepare(thin_lens()), Stroke(points, Brush(0.08, 0.04))).report()
    assert report["tolerance_met"]
    assert report["reverse_p95"] < 0.6e-3
    assert report["reverse_max"] < 5e-3
    assert report["untouched_normal_rms"] < 0.25
    assert report["components_after"] == 1
