# SPDX-License-Identifier: GPL-3.0-or-later
"""From a triangle mesh to a field.

    clean the mesh -> signed distance -> samples -> train -> measure

Two methods: "distance" learns the mesh's signed distance and takes seconds; "paper" is the eikonal
fit of the authors, for comparison. Meshes come in their own space; the field lives in model space,
where the longest side is 1.7, and mesh space = scale * model space + center.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, silent, sub_progress
from . import fit_distance, fit_paper
from .course import Course, Learner, follow
from .field import Field
from .fit_report import report
from .grow import grow
from .mesh_cleanup import CleanMesh, clean
from .mesh_distance import MeshDistance
from .mesh_thicken import thicken
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
    (Method.DISTANCE, Preset.DRAFT): Course(400, 384, 30_000, 1.5e-3, 0.006),
    (Method.DISTANCE, Preset.NORMAL): Course(1200, 384, 50_000, 1.2e-3, 0.003, omega=48.0),
    (Method.DISTANCE, Preset.FINE): Course(5000, 512, 150_000, 1e-3, 0.0015, omega=48.0),
    (Method.PAPER, Preset.DRAFT): Course(300, 512, 100_000, 1e-3, np.inf),
    (Method.PAPER, Preset.NORMAL): Course(2000, 1024, 100_000, 1e-3, np.inf),
    (Method.PAPER, Preset.FINE): Course(10_000, 2048, 100_000, 1e-3, np.inf),
}

WIDTHS = (64, 128, 256)  # units of each of the two hidden layers
OMEGA = 30.0  # of the second layer
AUTOMATIC = (128, 256)  # the first that meets the tolerance


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
    width: int | None = None,
    thickness: float | None = None,
    seed: int = 0,
    progress: Progress = silent,
    preview: Callable[[Fit], None] = lambda _: None,
    enough: Callable[[], bool] = lambda: False,
) -> Fit:
    """Fit a field to the mesh of `vertices` (V, 3) and `triangles` (F, 3).

    width:     one of `WIDTHS`, or as the course's tolerance demands
    thickness: mesh units; makes solids of open pieces, for a sheet has no inside of its own
    preview:   given the field now and then while it learns; all that its report has is "error"
    enough:    once it is true, the network of the moment is kept (see `course.follow`)
    The same seed gives the same weights. SculptError for a mesh that has no inside to be found.
    """
    start = time.monotonic()
    method, course = Method(method), COURSES[Method(method), Preset(preset)]
    if width is not None and width not in WIDTHS:
        raise SculptError(f"A network is {', '.join(map(str, WIDTHS))} units wide, not {width}.")
    rng = np.random.default_rng(seed)
    progress(0.0, "Cleaning the mesh")
    mesh = _prepared(vertices, triangles, thickness)
    x, y, z = (float(coordinate) for coordinate in mesh.center)
    distance = MeshDistance(mesh, rng, sub_progress(progress, 0.02, 0.08))

    def show(network: Siren, error: float) -> None:
        preview(Fit(network, mesh.scale, (x, y, z), {"error": error}))

    with one_thread():
        teach = _teacher(method, course, distance, rng, seed, sub_progress(progress, 0.08, 0.15))
        widths, quality = (width,) if width else AUTOMATIC, {}
        random = torch.Generator().manual_seed(seed)
        network = Siren.random((widths[0],) * 2, (course.omega, OMEGA), random)
        for units in widths:
            learner = teach(grow(network, (units, units)))
            network = learner.network
            follow(learner, course, sub_progress(progress, 0.15, 0.92), show, enough)
            quality = report(Field(network), distance, rng, sub_progress(progress, 0.92, 1.0))
            if quality["error_mean"] <= course.tolerance or enough():
                break
    quality = {**quality, **mesh.repairs, "seconds": time.monotonic() - start}
    return Fit(network, mesh.scale, (x, y, z), quality)


def _prepared(vertices: ArrayLike, triangles: ArrayLike, thickness: float | None) -> CleanMesh:
    mesh = clean(vertices, triangles)
    if thickness is None:
        return mesh
    if not 0 < thickness < np.inf:
        raise SculptError("The thickness of a sheet must be a positive number.")
    return thicken(mesh, thickness / mesh.scale)


def _teacher(
    method: Method,
    course: Course,
    distance: MeshDistance,
    rng: np.random.Generator,
    seed: int,
    progress: Progress,
) -> Callable[[Siren], Learner]:
    """What gives a network the samples to learn from."""
    if method is Method.DISTANCE:
        samples = fit_distance.sample(distance, course.samples, rng, progress)
        return lambda network: fit_distance.Learner(samples, network, course.batch, seed)
    surface = distance.surface(course.samples, rng)
    points, normals = _float(surface.points), _float(surface.normals)
    return lambda network: fit_paper.Learner(points, normals, network, course.batch, seed)


@contextmanager
def one_thread() -> Iterator[None]:
    """One torch thread: on a network this small more of them wait for each other."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _float(array: NDArray[np.float64]) -> torch.Tensor:
    return torch.from_numpy(array.astype(np.float32))
