# SPDX-License-Identifier: GPL-3.0-or-later
"""From a triangle mesh to a field (docs/method.md, section 5).

    clean the mesh -> signed distance -> samples -> learn a network -> detail -> strays -> measure

The network learns the mesh's signed distance in a few steps, which give it the smooth whole. Then
detail is added level by level where the preset's tolerance asks for it (`fit_detail`). Without
detail, for fields of 70 kB, the network takes as many steps as the preset says. The eikonal fit of
the paper's authors, method "paper", is there for comparison and has no detail.

A mesh comes in mesh space, its own units; the field is in model space, where the longest side is
1.7: mesh space = scale * model space + center.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from ...common.errors import SculptError
from ...common.progress import Progress, silent, sub_progress
from ..field import Field
from ..network import Siren
from ..threads import one_thread
from . import fit_distance, fit_paper
from .fit_detail import FitTolerance, refine
from .fit_repair import Repaired, repaired
from .fit_report import Presets, report
from .mesh_cleanup import clean
from .mesh_distance import MeshDistance
from .mesh_open import Open, prepare
from .schedule import Learner, Schedule, check_seed, train

LARGEST_LATTICE = 256
"""Cells along each axis, at most, of the proxy by which a field is judged. They are half as large
as those of the preset's finest level, or as large where that level is finer."""


class Method(StrEnum):
    """What the network learns: the signed distance to the mesh, or what the paper's authors fit."""

    DISTANCE = "distance"
    PAPER = "paper"


class Quality(StrEnum):
    """Preset: steps of the network without detail, and tolerance of the detail."""

    DRAFT = "draft"
    NORMAL = "normal"
    FINE = "fine"


SCHEDULES = {
    (Method.DISTANCE, Quality.DRAFT): Schedule(400, 384, 30_000, 1.5e-3),
    (Method.DISTANCE, Quality.NORMAL): Schedule(1200, 384, 50_000, 1.2e-3, omega=48.0),
    (Method.DISTANCE, Quality.FINE): Schedule(5000, 512, 150_000, 1e-3, omega=48.0),
    (Method.PAPER, Quality.DRAFT): Schedule(300, 512, 100_000, 1e-3),
    (Method.PAPER, Quality.NORMAL): Schedule(2000, 1024, 100_000, 1e-3),
    (Method.PAPER, Quality.FINE): Schedule(10_000, 2048, 100_000, 1e-3),
}
"""Schedules of fits without detail."""

BENEATH_DETAIL = Schedule(200, 384, 20_000, 1.5e-3)
"""Schedule of fits with detail, of all presets: half as many steps or twice the rate leave islands;
twice as many steps, for nearly twice the time, save an eighth of the coefficients and no error."""
WIDE_LAYER = 256
"""Units of a layer from which on a fit with detail takes the draft's schedule: after fewer steps so
wide a network is rough, and more finely so than detail can mend."""

TOLERANCES: dict[str, FitTolerance] = {
    Quality.DRAFT: FitTolerance(1e-3, 6.0, finest=5),
    Quality.NORMAL: FitTolerance(2e-4, 3.0, finest=6),
    Quality.FINE: FitTolerance(1.5e-4, 3.0, finest=7),
}

WIDTHS = (64, 128, 256)  # units of each of the two hidden layers
OMEGA = 30.0  # of the second layer


@dataclass(frozen=True)
class Fit:
    """A field that was fitted to a mesh: mesh space = scale * model space + center.

    report: quality (see `fit_report`), "seconds", what was repaired, and in "notes" sentences about
            what the artist should know; ready for JSON
    """

    field: Field
    scale: float
    center: tuple[float, float, float]
    report: dict[str, Any]


def fit_mesh(
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    method: str = Method.DISTANCE,
    preset: str = Quality.NORMAL,
    detail: bool = True,
    width: int = 128,
    open_parts: str | None = None,
    thickness: float | None = None,
    seed: int = 0,
    keep_origin: bool = False,
    progress: Progress = silent,
    preview: Callable[[Fit], None] = lambda _: None,
    enough: Callable[[], bool] = lambda: False,
) -> Fit:
    """Fit a field to the mesh of `vertices` (V, 3) and `triangles` (F, 3).

    method:      one of `Method`
    preset:      one of `Quality`
    detail:      whether the field may hold more than a network; the paper's method never does
    width:       units of the network's layers, one of `WIDTHS`
    open_parts:  one of `Open`, what becomes of open parts; None makes shells of them where there is
                 a `thickness`, or else solids
    thickness:   of open parts that become shells, mesh units; None takes one that suits the mesh
    keep_origin: whether the mesh's origin is that of the field, see `mesh_cleanup.placed`
    preview:     called now and then with the fit so far; while the network learns, its report has
                 the "error"
    enough:      once it is true, the field as it is then is kept, see `schedule.train`

    The same seed gives the same bits. SculptError when the mesh has no inside, or a setting is none
    of those that there are; Cancelled when `progress` raises it.
    """
    start = time.monotonic()
    if preset not in list(Quality):
        raise SculptError(
            "There is no quality {}; choose one of {}.", f"{preset!r:.60}", ", ".join(Quality)
        )
    check_seed(seed)
    if open_parts not in (None, *Open):
        raise SculptError(
            "Open parts cannot be {}; choose one of {}.", f"{open_parts!r:.60}", ", ".join(Open)
        )
    method, preset = Method(method), Quality(preset)
    kind = Open(open_parts or (Open.SOLID if thickness is None else Open.THICKNESS))
    if width not in WIDTHS:
        raise SculptError("A network is {} units wide, not {}.", ", ".join(map(str, WIDTHS)), width)
    detail = detail and method is Method.DISTANCE
    schedule = SCHEDULES[method, Quality.DRAFT if detail else preset]
    if detail and width < WIDE_LAYER:
        schedule = BENEATH_DETAIL
    rng = np.random.default_rng(seed)
    progress(0.0, "Cleaning the mesh")
    mesh, notes = prepare(clean(vertices, triangles, keep_origin), kind, thickness)
    x, y, z = (float(coordinate) for coordinate in mesh.center)
    distance = MeshDistance(mesh, rng, sub_progress(progress, 0.02, 0.08))

    def show(field: Field, **told: float) -> None:
        preview(Fit(field, mesh.scale, (x, y, z), told))

    with one_thread():
        teach = _teacher(method, schedule, distance, rng, seed, sub_progress(progress, 0.08, 0.15))
        random = torch.Generator().manual_seed(seed)
        learner = teach(Siren.random((width,) * 2, (schedule.omega, OMEGA), random))
        learned = 0.4 if detail else 0.92
        train(
            learner,
            schedule,
            sub_progress(progress, 0.15, learned),
            lambda network, error: show(Field(network), error=error),
            enough,
        )
        field = Field(learner.network)
        if detail:
            part = sub_progress(progress, learned, 0.88)
            field = refine(field, distance, TOLERANCES[preset], rng, part, show, enough)
        cells = min(LARGEST_LATTICE, 4 * 2 ** TOLERANCES[preset].finest)
        part = sub_progress(progress, 0.88, 0.95)
        found = _without_strays(field, distance, cells, rng, part, detail and not enough())
        presets = Presets(TOLERANCES, preset)
        part = sub_progress(progress, 0.95, 1.0)
        quality = report(found, mesh, distance, presets, rng, part)
    told = [*notes, *_about(found), *quality.notes]
    measures = {**quality.measures, **mesh.repairs, "seconds": time.monotonic() - start}
    measures |= {"notes": told} if told else {}
    field = found.field
    return Fit(field, mesh.scale, (x, y, z), measures)


def _without_strays(
    field: Field,
    distance: MeshDistance,
    cells: int,
    rng: np.random.Generator,
    progress: Progress,
    may_add: bool,
) -> Repaired:
    """The field as of `repaired`. SculptError when nothing of the mesh is left in it."""
    try:
        return repaired(field, distance, cells, rng, progress, may_add)
    except SculptError as error:
        raise SculptError(
            "The field has no surface: all parts of the mesh are thinner than it can hold. Choose"
            " a finer quality, or make them thicker."
        ) from error


def _about(found: Repaired) -> list[str]:
    """A sentence about surface of the field where the mesh has none."""
    if not len(found.left.points):
        return []
    return ["The field has surface where the mesh has none. Choose a finer quality, or Detail."]


def _teacher(
    method: Method,
    schedule: Schedule,
    distance: MeshDistance,
    rng: np.random.Generator,
    seed: int,
    progress: Progress,
) -> Callable[[Siren], Learner]:
    """What gives a network the samples to learn from."""
    if method is Method.DISTANCE:
        samples = fit_distance.sample(distance, schedule.samples, rng, progress)
        return lambda network: fit_distance.Learner(samples, network, schedule.batch, seed)
    surface = distance.surface(schedule.samples, rng)
    points, normals = _float(surface.points), _float(surface.normals)
    return lambda network: fit_paper.Learner(points, normals, network, schedule.batch, seed)


def _float(array: NDArray[np.float64]) -> torch.Tensor:
    return torch.from_numpy(array.astype(np.float32))
