# SPDX-License-Identifier: GPL-3.0-or-later
"""Cases become the strokes they stand for: same path, same profile, same modulation."""

import json

import numpy as np
import pytest
from benchmarking.scored_cases import CASES, read_case
from scipy.interpolate import CubicSpline

from neural_sculpt_addon.stroke.curve import fit_curve
from neural_sculpt_addon.stroke.stroke import Stroke

MODULATIONS = {  # as the cases' own documentation writes them
    "identity": np.ones_like,
    "linear": lambda u: 1 - u,
    "central": lambda u: np.exp(-6 * (u - 0.5) ** 2),
    "sinusoidal": lambda u: 1 + np.sin(10 * (u - 0.5)),
}


def made_case(profile):
    """A helix of 257 equally spaced points."""
    t = np.linspace(0, 2, 257)
    path = np.stack([0.5 * np.cos(t), 0.5 * np.sin(t), 0.2 * t], axis=1)  # (257, 3)
    return {
        "id": "made",
        "path_points": path.tolist(),
        "radius": 0.1,
        "intensity": 0.05,
        "profile": profile,
        "modulation": "central",
        "seed": 7,
    }


def check(case):
    """The stroke's displacement is the case's, and its spline the case's path."""
    stroke = Stroke.from_json(read_case(case))
    path = np.array(case["path_points"])
    points, _ = fit_curve(stroke.points).resample(len(path))
    assert np.abs(points - path).max() < 1e-5
    v = np.linspace(-1, 1, 1001)
    if case["profile"] == "quintic":
        expected = 1 - np.abs(v) ** 3 * (10 - 15 * np.abs(v) + 6 * v**2)
    else:
        expected = CubicSpline(*np.array(case["profile"], float).T)(v)
    height = stroke.brush.intensity * stroke.brush.profile(v)
    assert np.abs(height - case["intensity"] * expected).max() < 3e-4 * abs(case["intensity"])
    u = np.linspace(0, 1, 101)
    assert np.abs(stroke.brush.modulation(u) - MODULATIONS[case["modulation"]](u)).max() < 1e-12
    assert stroke.seed == case["seed"] and stroke.name == case["id"]


@pytest.mark.parametrize(
    "profile",
    [
        "quintic",
        [[-1, 0], [0, 1], [1, 0]],
        [[-1, 0], [-0.5, -0.8], [0.5, 0.8], [1, 0]],  # its spline leaves [-1, 1]
        [[-1, 0], [-0.4, 1], [0.4, -1], [1, 0]],
    ],
)
def test_made_cases(profile):
    check(made_case(profile))


def scored_cases():
    """Those that lie beside the project."""
    path = CASES
    return json.loads(path.read_text())["cases"] if path.exists() else []


MADE = [{**made_case("quintic"), "id": name, "modulation": name} for name in MODULATIONS]


@pytest.mark.parametrize("case", [*MADE, *scored_cases()], ids=lambda case: case["id"])
def test_cases(case):
    check(case)
