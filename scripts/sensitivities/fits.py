# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits: meshes ready to be learned, networks beneath detail, and how well a field holds a mesh."""

from functools import cache
from typing import NamedTuple

import numpy as np
import torch

from neural_sculpt_addon.common.progress import silent
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.fit import fit, fit_distance
from neural_sculpt_addon.field.fit.fit_report import deviation
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance, MeshSamples
from neural_sculpt_addon.field.fit.schedule import Schedule, train
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.field.threads import one_thread

from .shapes import SHAPES

WIDTH = 128  # of networks, as usual
MEASURED = 20_000  # samples of a mesh, and of the box
CLEAR = 0.015  # model units from the mesh, within which no sign is judged
CELLS = 96  # of the proxy that pieces are counted by

ERRORS = ("error_mean", "error_p95", "normal_deg")


class Target(NamedTuple):
    """A mesh, and samples that tell how well a field holds it."""

    distance: MeshDistance
    surface: MeshSamples
    volume: np.ndarray  # (N, 3)
    signed: np.ndarray  # (N,)


@cache
def target(name: str) -> Target:
    """The mesh of that name in `shapes.SHAPES`."""
    rng = np.random.default_rng(0)
    distance = MeshDistance(clean(*SHAPES[name]()), rng)
    volume = rng.uniform(-1, 1, (MEASURED, 3))
    return Target(distance, distance.surface(MEASURED, rng), volume, distance(volume).value)


@cache
def learned(name: str, seed: int) -> Field:
    """The network beneath detail that a fit of that mesh begins with."""
    return learn(target(name).distance, seed)


def learn(distance: MeshDistance, seed: int, schedule: Schedule | None = None) -> Field:
    """A network as a fit with detail learns it, or by another schedule."""
    schedule, rng = schedule or fit.BENEATH_DETAIL, np.random.default_rng(seed)
    samples = fit_distance.sample(distance, schedule.samples, rng)
    random = torch.Generator().manual_seed(seed)
    network = Siren.random((WIDTH,) * 2, (schedule.omega, fit.OMEGA), random)
    with one_thread():
        learner = fit_distance.Learner(samples, network, schedule.batch, seed)
        train(learner, schedule, silent)
    return Field(learner.network)


def measured(field: Field, wanted: Target) -> dict[str, float]:
    """How well a field holds the mesh, how much detail that takes, and its pieces."""
    surface = wanted.surface
    found = deviation(project(field, surface.points), surface.points, surface.normals)
    wrong = (values(field, wanted.volume) < 0) != (wanted.signed < 0)
    levels = field.detail.coefficients.values()
    return {
        **found,
        "wrong_sides": int((wrong & (np.abs(wanted.signed) > CLEAR)).sum()),
        "pieces": components(extract(field, CELLS)),
        "coefficients": sum(len(level.index) for level in levels),
    }
