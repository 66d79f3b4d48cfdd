# SPDX-License-Identifier: GPL-3.0-or-later
"""How well a field reproduces the mesh it was fitted to.

Every number is measured on fresh samples, in model space (the shape's longest side is 1.7):

error_mean, error_p95, error_max  distance of points of the mesh to the zero level, by projection
normal_deg                        mean angle between grad f and the mesh's normals there, degrees
sign_errors                       share of the box, farther than CLEAR from the mesh, of wrong sign
components                        connected pieces of the zero level, on a coarse lattice
"""

import numpy as np
from numpy.typing import NDArray

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from .evaluate import values
from .field import Field
from .mesh_distance import MeshDistance
from .pieces import components
from .projection import Projection, project
from .proxy import extract

SURFACE_SAMPLES = 8192
VOLUME_SAMPLES = 16384
CLEAR = 0.015  # model units
CELLS = 64


def report(
    field: Field, distance: MeshDistance, rng: np.random.Generator, progress: Progress = silent
) -> dict[str, float | int]:
    """Quality of `field` against the mesh, ready for JSON; see the module's docstring."""
    points, normals, _ = distance.surface(SURFACE_SAMPLES, rng)
    progress(0.2, "Measuring the field")
    volume = rng.uniform(-1, 1, (VOLUME_SAMPLES, 3))
    truth = distance(volume, lambda part, text: progress(0.2 + 0.5 * part, text))
    clear = truth.certain & (np.abs(truth.value) > CLEAR)
    wrong = (values(field, volume) < 0) != (truth.value < 0)
    return {
        **deviation(project(field, points), points, normals),
        "sign_errors": float(wrong[clear].mean()),
        "components": _components(field, progress),
    }


def deviation(found: Projection, points: NDArray, normals: NDArray) -> dict[str, float]:
    """How far the zero level, where it was `found` from them, is from points (N, 3) with normals
    (N, 3): errors and normal_deg."""
    error = np.linalg.norm(found.points - points, axis=1)  # (N,)
    cosine = np.clip(np.sum(found.normals * normals, axis=1), -1, 1)
    return {
        "error_mean": float(error.mean()),
        "error_p95": float(np.percentile(error, 95)),
        "error_max": float(error.max()),
        "normal_deg": float(np.degrees(np.arccos(cosine)).mean()),
    }


def _components(field: Field, progress: Progress) -> int:
    try:
        return components(
            extract(field, CELLS, lambda part, text: progress(0.7 + 0.3 * part, text))
        )
    except SculptError:  # the field found no surface at all
        return 0
