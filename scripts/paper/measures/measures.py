# SPDX-License-Identifier: GPL-3.0-or-later
"""Clean measures of an edit, without the noise of two samplings, for any surface alike.

asked   distance of displaced samples of the core from the result: mean, and 95 %
back    distance of samples of the result in the tube from the ground truth's mesh: mean, and 95 %
normal  angle between the result's normals and those of the displaced surface, degrees: mean
drift   distance of far samples of the unedited surface from the result: mean, 99 %, most
turned  angle by which the normals of those have turned, degrees: root mean square

Regions and samples are those of `problem.metrics`, which measures fields alone. Model space.
"""

import numpy as np

from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.problem.metrics import FAR
from neural_sculpt_addon.field.problem.problem import Problem
from neural_sculpt_addon.field.problem.tube import COLUMNS, ROWS
from neural_sculpt_addon.field.threads import join

from .surface import Array, Inside, Surface

FRESH = 7  # a stream of random numbers of its own


def measure(
    problem: Problem, result: Surface, truth: Surface, tube: Inside, count: int
) -> dict[str, float]:
    """All measures of one edit; `count` samples of the way back."""
    random = np.random.default_rng((problem.seed, FRESH))
    tubes = problem.tubes(ROWS, COLUMNS, random)
    target: Samples = join([tube.target.where(tube.displacement.core) for tube in tubes])
    surface = problem.preparation.surface
    far = surface.where(problem.copies.relative_distance(surface) > FAR)
    asked, held = result.see(target.points), result.see(far.points)
    back = truth.see(result.sample(count, problem.seed, tube)).distance
    turned = angles(held.normals, far.normals)
    return {
        "asked": float(asked.distance.mean()),
        "asked_p95": float(np.percentile(asked.distance, 95)),
        "back": float(back.mean()),
        "back_p95": float(np.percentile(back, 95)),
        "normal": float(angles(asked.normals, target.normals).mean()),
        "drift": float(held.distance.mean()),
        "drift_p99": float(np.percentile(held.distance, 99)),
        "drift_max": float(held.distance.max()),
        "turned": float(np.sqrt((turned**2).mean())),
    }


def angles(one: Array, other: Array) -> Array:
    """Degrees (N,) between unit vectors (N, 3).

    By their distance: the cosine of a small angle is rounded to what may be 0.03 degrees.
    """
    apart = np.linalg.norm(np.subtract(one, other, dtype=np.float64), axis=1)
    return np.degrees(2 * np.arcsin(np.clip(apart / 2, 0, 1)))
