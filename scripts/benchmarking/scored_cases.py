# SPDX-License-Identifier: GPL-3.0-or-later
"""Scored cases (a `cases.json`) as strokes.

A case is a stroke on one of the pretrained networks whose result has been measured. Its profile
points mean scipy's not-a-knot cubic spline, which is not our Catmull-Rom spline, so they become a
table. Every other point of its path, 257 points equally spaced on the surface, becomes a control
point: the stroke's own spline then stays within 1e-5 of the whole path, model space.
"""

import argparse
from pathlib import Path
from typing import Any

from workshop import ROOT

CASES = ROOT.parent / "shared" / "data" / "cases" / "cases.json"
TABLE = 257  # samples of a profile: what Blender's curve widget resolves
THINNING = 2


def add_option(parser: argparse.ArgumentParser) -> None:
    """The option that names another file."""
    parser.add_argument("--cases", type=Path, default=CASES, help="default: %(default)s")


def read_case(case: dict[str, Any]) -> dict[str, Any]:
    """The stroke of a case, as the data of a stroke file."""
    profile, intensity = case["profile"], float(case["intensity"])
    if isinstance(profile, str):
        profile = {"name": profile}
    else:
        table = _sample_spline(profile)
        peak = max(1.0, *(abs(y) for y in table))  # a profile stays in [-1, 1], a spline need not
        profile, intensity = {"table": [y / peak for y in table]}, intensity * peak
    return {
        "name": case["id"],
        "points": case["path_points"][::THINNING],
        "radius": case["radius"],
        "intensity": intensity,
        "profile": profile,
        "modulation": {"name": case["modulation"]},
        "seed": case["seed"],
    }


def _sample_spline(points: list[list[float]]) -> list[float]:
    import numpy as np
    from scipy.interpolate import CubicSpline

    x, y = np.array(points, float).T
    return CubicSpline(x, y)(np.linspace(-1, 1, TABLE)).tolist()
