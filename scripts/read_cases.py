# SPDX-License-Identifier: GPL-3.0-or-later
"""Turn scored cases (a `cases.json`) into stroke files: python3 scripts/read_cases.py FOLDER.

A case is a stroke on one of the pretrained networks whose result has been measured. Its profile
points mean scipy's not-a-knot cubic spline, which is not our Catmull-Rom spline, so they become a
table. Every other point of its path, 257 points equally spaced on the surface, becomes a control
point: the stroke's own spline then stays within 1e-5 of the whole path, model space.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import environment

CASES = environment.ROOT.parent / "shared" / "data" / "cases" / "cases.json"
TABLE = 257  # samples of a profile: what Blender's curve widget resolves
THINNING = 2


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


def main() -> None:
    """Write one stroke file for each case into the given folder."""
    parser = argparse.ArgumentParser(description="Turn scored cases into stroke files.")
    parser.add_argument("folder", type=Path, help="where the stroke files go")
    parser.add_argument("--cases", type=Path, default=CASES, help="default: %(default)s")
    options = parser.parse_args()
    environment.enter("worker")
    sys.path.insert(0, str(environment.ROOT))
    from neural_sculpt_addon.stroke.file import dump_strokes
    from neural_sculpt_addon.stroke.stroke import Stroke

    try:
        cases = json.loads(options.cases.read_text(encoding="utf-8"))["cases"]
    except (OSError, ValueError, KeyError) as error:
        raise SystemExit(f"{options.cases} cannot be read as cases: {error!r}.") from error
    options.folder.mkdir(parents=True, exist_ok=True)
    for case in cases:
        path = options.folder / f"{case['id']}.json"
        path.write_text(dump_strokes([Stroke.from_json(read_case(case))]), encoding="utf-8")
        print(f"{case['model']}: {path}")


if __name__ == "__main__":
    main()
