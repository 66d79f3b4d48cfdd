# SPDX-License-Identifier: GPL-3.0-or-later
"""Schedule of a fit: how many steps, at which learning rate, and the loop that takes them.

The learning rate falls along a cosine to zero, for at a high rate the weights tremble around their
best. So when the artist ends a fit early, it falls to zero within SETTLING steps.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from ...common.errors import SculptError
from ...common.progress import Progress
from ...common.text import Text
from ..network import Siren

SETTLING = 120  # steps after an early end: fewer leave the weights trembling, more are waited for
PREVIEW_SECONDS = 0.6  # between two previews
SMOOTHING = 0.95  # weight of the steps before in the running mean of the error that is told

Preview = Callable[[Siren, float], None]
"""Called with a copy of the network as it is now, and its error in model units."""


def check_seed(seed: int) -> None:
    """SculptError unless random numbers can be drawn from the seed, those of torch too."""
    if not 0 <= seed < 2**63:
        raise SculptError("The seed is {}; it must be from 0 to 2^63 - 1.", f"{seed!s:.100}")


@dataclass(frozen=True)
class Schedule:
    """The constants of a fit by steps.

    steps:   number of steps
    batch:   samples of a step
    samples: samples that are drawn once for all steps
    rate:    learning rate of the first step
    omega:   of a new network's first layer; a high one holds more detail, but needs more steps to
             calm down far from the surface
    """

    steps: int
    batch: int
    samples: int
    rate: float
    omega: float = 30.0


class Learner(Protocol):
    """What takes the steps."""

    network: Siren

    def step(self, rate: float) -> float:
        """One step of learning rate `rate`; the error before it, model units."""
        ...


def train(
    learner: Learner,
    schedule: Schedule,
    progress: Progress,
    preview: Preview = lambda *_: None,
    enough: Callable[[], bool] = lambda: False,
) -> None:
    """Take the steps of the schedule, or fewer where the artist ends them.

    enough: asked before every step; once it is true, the learning rate falls to zero and all ends

    Cancelled when `progress` raises it.
    """
    error, shown = math.nan, time.monotonic()
    for step in range(schedule.steps):
        rate = schedule.rate * cosine(step / schedule.steps)
        if enough():
            for settling in range(SETTLING):
                learner.step(rate * cosine(settling / SETTLING))
            return
        latest = learner.step(rate)
        error = latest if step == 0 else SMOOTHING * error + (1 - SMOOTHING) * latest
        progress((step + 1) / schedule.steps, Text("Fitting, error {}", f"{error:.4f}"))
        if time.monotonic() - shown > PREVIEW_SECONDS:
            tensors = [tensor.clone() for tensor in learner.network.parameters]
            preview(learner.network.with_parameters(tensors), error)
            shown = time.monotonic()


def cosine(fraction: float) -> float:
    """The share of the first learning rate that is left after `fraction` of the steps."""
    return 0.5 * (1 + math.cos(math.pi * fraction))
