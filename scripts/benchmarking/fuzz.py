# SPDX-License-Identifier: GPL-3.0-or-later
"""The fuzz benchmark: any stroke at all, on a sphere, a torus and Suzanne.

Radius 0.005 to 0.5, intensity -0.3 to 0.3, 1 to 500 points of a random walk over the surface, any
profile, modulation, ends, direction, pressure and mirror, from numbered seeds. Each ends with a
sound field and a report, or with the reason why not. Seconds are of the processor, of all
threads together; memory is the most that the process ever took. Model space.
"""

import argparse
import json
import sys
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.field.mesh.surface import Samples
    from neural_sculpt_addon.field.problem.prepare import Preparation
    from neural_sculpt_addon.stroke.stroke import Stroke

MODELS = ("sphere", "torus", "suzanne")
METHODS = ("local", "network")
MEASURES = (
    *("tube_mean", "tube_p95", "reverse_p95", "drift_mean", "drift_max", "gradient"),
    *("components_before", "components_after", "gain", "tolerance", "tolerance_met", "levels"),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py fuzz`."""
    parser.add_argument("--json", type=Path, help="write one object per stroke, as they come")
    parser.add_argument("--strokes", type=int, default=500, help="default: %(default)s")
    parser.add_argument("--first", type=int, default=0, help="seed of the first stroke")
    parser.add_argument("--method", choices=METHODS, default="local", help="default: %(default)s")


def run(options: argparse.Namespace) -> None:
    """Draw the strokes, write the rows, print a summary; fail when one of them broke something."""
    rows = []
    for row in _rows(options):
        rows.append(row)
        if options.json:
            options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")
    solved = [row for row in rows if "tube_p95" in row]
    changed = [row for row in solved if row["components_after"] != row["components_before"]]
    print(f"{len(rows)} strokes, {options.method}")
    print(f"within tolerance {sum(row['tolerance_met'] for row in solved)} of {len(solved)}")
    print(f"number of pieces changed {len(changed)}: {[row['case'] for row in changed]}")
    for reason, count in Counter(row["refused"] for row in rows if "refused" in row).items():
        print(f"refused {count}: {reason}")
    print(f"most seconds {max(row['seconds'] for row in rows):.1f}")
    print(f"most memory {max(row['memory_mb'] for row in rows)} MB")
    if unsound := [row["case"] for row in rows if not row["sound"]]:
        sys.exit(f"Numbers that are not finite: {unsound}")


def _rows(options: argparse.Namespace) -> "Iterator[dict[str, Any]]":
    """One stroke after another, each on an unedited model."""
    import resource

    import numpy as np

    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.field.problem.prepare import prepare

    ready = {name: prepare(primitive(name)) for name in MODELS}
    for seed in range(options.first, options.first + options.strokes):
        model = MODELS[seed % len(MODELS)]
        stroke = any_stroke(ready[model], np.random.default_rng(seed))
        started = time.process_time()
        row = {
            "case": seed,
            "model": model,
            "method": options.method,
            "radius": stroke.brush.radius,
            "intensity": stroke.brush.intensity,
            "points": len(stroke.points),
            **_sculpt(ready[model], stroke, options.method),
        }
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
        yield row | {"seconds": time.process_time() - started, "memory_mb": memory}


def _sculpt(ready: "Preparation", stroke: "Stroke", solver: str) -> dict[str, Any]:
    import numpy as np
    import torch

    from neural_sculpt_addon.common.errors import SculptError
    from neural_sculpt_addon.field.edit.edit import sculpt

    try:
        edit = sculpt(ready, stroke, solver=solver)
    except SculptError as error:
        return {"refused": str(error), "sound": True}
    report = edit.report()
    finite = [bool(torch.isfinite(part).all()) for part in edit.field.network.parameters]
    parts = edit.field.detail.coefficients.values()
    surface = edit.preparation.surface
    finite += [bool(np.isfinite(part.values).all()) for part in parts]
    finite += [bool(np.isfinite(part).all()) for part in surface]
    finite += [bool(np.isfinite(value)) for value in report.values() if isinstance(value, float)]
    return {**{name: report[name] for name in MEASURES}, "sound": all(finite)}


def any_stroke(ready: "Preparation", random: "np.random.Generator") -> "Stroke":
    """A stroke without any moderation."""
    import numpy as np

    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.modulation import Modulation
    from neural_sculpt_addon.stroke.profile import Profile
    from neural_sculpt_addon.stroke.stroke import Direction, Ends, Stroke

    count = int(random.integers(1, random.choice([13, 501])))
    profile = Profile(str(random.choice(sorted(Profile.FORMULAS))))
    if random.random() < 0.6:
        profile = Profile(table=tuple(random.uniform(-1, 1, random.integers(2, 34)).tolist()))
    radius = float(np.exp(random.uniform(np.log(0.005), np.log(0.5))))
    factors = random.uniform(0, 2, (2, count)) if random.random() < 0.5 else (None, None)
    return Stroke(
        _wander(ready.surface, count, random),
        Brush(
            radius,
            random.uniform(-0.3, 0.3),
            profile,
            Modulation(str(random.choice(sorted(Modulation.FORMULAS)))),
        ),
        bool(random.random() < 0.3),
        *factors,
        ends=list(Ends)[random.integers(2)],
        direction=list(Direction)[random.integers(2)],
        mirror=frozenset(str(random.choice(["", "", "X", "YZ"]))),
        seed=int(random.integers(1 << 31)),
    )


def _wander(surface: "Samples", count: int, random: "np.random.Generator") -> "NDArray[np.float64]":
    """`count` points (count, 3) of the surface, each near the one before, of any roughness."""
    import numpy as np
    from scipy.spatial import KDTree

    tree = KDTree(surface.points)
    place, ahead = surface.points[random.integers(len(surface.points))], random.normal(size=3)
    step, turning = random.uniform(0, 0.2), random.uniform(0, 1)
    points = []
    for _ in range(count):
        points.append(place)
        ahead += turning * random.normal(size=3)
        ahead /= np.linalg.norm(ahead)
        place = surface.points[tree.query(place + step * ahead)[1]]
    return np.array(points, float)
