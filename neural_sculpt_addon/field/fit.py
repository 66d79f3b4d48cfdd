# SPDX-License-Identifier: GPL-3.0-or-later
"""From a triangle mesh to a field.

    clean the mesh -> signed distance -> samples -> train -> measure

Two methods: "distance" learns the mesh's signed distance and takes seconds; "paper" is the eikonal
fit of the authors, for comparison. Meshes come in their own space; the field lives in model space,
where the longest side is 1.7, and mesh space = scale * model space + center.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent
from . import fit_distance, fit_paper
from .fit_distance import Course
from .fit_report import report
from .mesh_cleanup import clean
from .mesh_distance import MeshDistance
from .network import Siren


class Method(StrEnum):
    """How the network learns the mesh."""

    DISTANCE = "distance"
    PAPER = "paper"


class Preset(StrEnum):
    """How long it learns."""

    DRAFT = "draft"
    NORMAL = "normal"
    FINE = "fine"


COURSES = {
    (Method.DISTANCE, Preset.DRAFT): Course(400, 384, 20_000, 1.5e-3),
    (Method.DISTANCE, Preset.NORMAL): Course(1200, 384, 40_000, 1.2e-3),
    (Method.DISTANCE, Preset.FINE): Course(5000, 512, 150_000, 1e-3),
    (Method.PAPER, Preset.DRAFT): Course(300, 512, 100_000, 1e-3),
    (Method.PAPER, Preset.NORMAL): Course(2000, 1024, 100_000, 1e-3),
    (Method.PAPER, Preset.FINE): Course(10_000, 2048, 100_000, 1e-3),
}


@dataclass(frozen=True)
class Fit:
    """A field fitted to a mesh: mesh space = scale * model space + center.

    report: quality (see `fit_report`), "seconds", and what was repaired; ready for JSON
    """

    network: Siren
    scale: float
    center: tuple[float, float, float]
    report: dict[str, Any]


def fit_mesh(
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    method: str = Method.DISTANCE,
    preset: str = Preset.NORMAL,
    thickness: float | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Fit:
    """Fit a field to the mesh of `vertices` (V, 3) and `triangles` (F, 3).

    thickness: mesh units; makes a solid of a sheet, which has no inside of its own
    The same seed gives the same weights. SculptError for a mesh that has no inside to be found.
    """
    start = time.monotonic()
    course = COURSES[Method(method), Preset(preset)]
    rng = np.random.default_rng(seed)
    progress(0.0, "Cleaning the mesh")
    mesh = clean(vertices, triangles)
    if thickness is not None and not 0 < thickness < np.inf:
        raise SculptError("The thickness of a sheet must be a positive number.")
    thickness = None if thickness is None else thickness / mesh.scale
    distance = MeshDistance(mesh, thickness, rng, _part(progress, 0.02, 0.08))
    with _one_thread():
        if Method(method) is Method.DISTANCE:
            samples = fit_distance.sample(
                distance, course.samples, rng, _part(progress, 0.08, 0.15)
            )
            learning = fit_distance.learn(samples, course, seed)
        else:
            points, normals = (_float(array) for array in distance.surface(course.samples, rng))
            learning = fit_paper.learn(points, normals, course, seed)
        network = _follow(learning, course.steps, _part(progress, 0.15, 0.92))
        quality = report(network, distance, rng, _part(progress, 0.92, 1.0))
    x, y, z = (float(coordinate) for coordinate in mesh.center)
    seconds = time.monotonic() - start
    return Fit(network, mesh.scale, (x, y, z), {**quality, **mesh.repairs, "seconds": seconds})


def _follow(learning: Iterator[tuple[Siren, float]], steps: int, progress: Progress) -> Siren:
    """Run the steps, telling the current error; the network after the last of them."""
    for step in range(1, steps):
        _, error = next(learning)
        progress(step / steps, f"Fitting, error {error:.4f}")
    return next(learning)[0]


def _part(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a part of the work."""
    return lambda fraction, text: progress(start + (end - start) * fraction, text)


@contextmanager
def _one_thread() -> Iterator[None]:
    """One torch thread: on a network this small more of them wait for each other."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _float(array: NDArray[np.float64]) -> torch.Tensor:
    return torch.from_numpy(array.astype(np.float32))
