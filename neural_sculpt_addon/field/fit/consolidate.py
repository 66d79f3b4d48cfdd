# SPDX-License-Identifier: GPL-3.0-or-later
"""Consolidation: a plain network fitted to a field with detail, and what was lost by it.

The network learns the field's value and gradient near its surface, and its value in the box, by
the learner that fits meshes. What it cannot hold is lost: a network of 128 x 128 units takes 70 kB
and keeps what is coarser than about a twentieth of the shape. The report, in model space, on
samples of the field's surface:

distance_mean, distance_p95, distance_max  to the surface of the network
normal_deg                                 mean angle between the normals, degrees
components_before, components              connected pieces of the field's surface, the network's
"""

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from ...common.errors import SculptError
from ...common.progress import Progress, silent, sub_progress
from ..evaluate import values_and_gradients
from ..field import Field
from ..geometry import angles
from ..mesh.pieces import components
from ..mesh.proxy import Proxy, extract
from ..mesh.surface import sample_surface
from ..network import Siren
from ..problem.metrics import find_surface
from ..threads import one_thread
from .fit import OMEGA
from .fit_distance import (
    AROUND_DEVIATION,
    NEAR_DEVIATION,
    SAMPLED_BOX,
    Learner,
    TrainingSamples,
    arranged,
)
from .schedule import Schedule, check_seed, train

NARROWEST, WIDEST = 8, 512  # units of each of the two hidden layers
NEAR_SHARE, AROUND_SHARE = 0.6, 0.25  # of the samples; the rest is uniform in the sampled box
RANDOM = Schedule(3000, 512, 150_000, 1.2e-3, omega=48.0)  # 5000 steps: a tenth less is lost
CONTINUED = replace(RANDOM, rate=4e-4)  # of the field's own network
COMPARED_CELLS = 128  # per axis of the meshes that are compared
MEASURE_SAMPLES = 20_000  # samples


@dataclass(frozen=True)
class Consolidation:
    """A field without detail, and what was lost: see the module's docstring."""

    field: Field
    report: dict[str, Any]


def consolidate(
    field: Field, width: int, *, seed: int = 0, progress: Progress = silent
) -> Consolidation:
    """A network of two hidden layers of `width` units fitted to `field`.

    It starts from the field's own network where that has this width. The same seed gives the same
    weights. SculptError for a width or a seed that is none, or a field without surface.
    """
    check_seed(seed)
    if not NARROWEST <= width <= WIDEST:
        raise SculptError("A network is {} to {} units wide, not {}.", NARROWEST, WIDEST, width)
    start = time.monotonic()
    field = field.to("cpu")
    own = field.network.widths == (width, width)
    schedule = CONTINUED if own else RANDOM
    random = torch.Generator().manual_seed(seed)
    network = field.network if own else Siren.random((width,) * 2, (schedule.omega, OMEGA), random)
    proxy = extract(field, COMPARED_CELLS, sub_progress(progress, 0.0, 0.05))
    with one_thread():
        learner = Learner(
            _samples(field, proxy, schedule.samples, seed), network, schedule.batch, seed
        )
        train(learner, schedule, sub_progress(progress, 0.1, 0.9))
    plain = Field(learner.network)
    after = extract(plain, COMPARED_CELLS, sub_progress(progress, 0.9, 1.0))
    surface = sample_surface(field, proxy, MEASURE_SAMPLES, seed + 1)
    found = find_surface(plain, surface.points)
    report = {
        "distance_mean": float(found.distance.mean()),
        "distance_p95": float(np.percentile(found.distance, 95)),
        "distance_max": float(found.distance.max()),
        "normal_deg": float(angles(found.normals, surface.normals).mean()),
        "components_before": components(proxy),
        "components": components(after),
        "seconds": time.monotonic() - start,
    }
    return Consolidation(plain, report)


def _samples(field: Field, proxy: Proxy, count: int, seed: int) -> TrainingSamples:
    """`count` points near the surface and in the box, with the field there."""
    random = np.random.default_rng(seed)
    near, around = int(NEAR_SHARE * count), int(AROUND_SHARE * count)
    surface = sample_surface(field, proxy, near + around, seed)
    spread = np.repeat([NEAR_DEVIATION, AROUND_DEVIATION], [near, around])[:, None]
    beside = surface.points + spread * random.standard_normal((near + around, 3))
    points = np.concatenate(
        [beside, random.uniform(-SAMPLED_BOX, SAMPLED_BOX, (count - near - around, 3))]
    )
    points = points.clip(-SAMPLED_BOX, SAMPLED_BOX)
    return arranged(points, *values_and_gradients(field, points), np.arange(count) < near + around)
