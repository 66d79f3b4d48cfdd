# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit asks of the network: where the zero set shall be after the stroke.

The tube moves to its targets, the preserve set stays where it is. Mirror images of a stroke are
solved together; where they overlap, the larger displacement wins.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..stroke.displacement import displace
from ..stroke.path import Path
from ..stroke.stroke import Ends, Stroke
from .lay import lay
from .network import Siren
from .prepare import Preparation
from .surface import Samples
from .tube import COLUMNS, ROWS, Tube, sample_tube


class Laid(NamedTuple):
    """One copy of a stroke and its path on the surface."""

    stroke: Stroke
    path: Path


@dataclass(frozen=True)
class Problem:
    """An edit to be solved.

    tube:     target samples of the displaced surface
    preserve: samples of the untouched surface, which must stay
    seed:     of all random numbers that the solver draws
    """

    network: Siren
    tube: Samples
    preserve: Samples
    seed: int


def pose(preparation: Preparation, stroke: Stroke, laid: tuple[Laid, ...]) -> Problem:
    """The problem that `stroke`, laid on the surface by `lay_copies`, poses.

    SculptError when the stroke is too thin or too sharply bent for any sample to lie in it.
    """
    tubes = sample_tubes(preparation.network, laid)
    target = Samples(
        np.concatenate([tube.target.points for tube in tubes]),
        np.concatenate([tube.target.normals for tube in tubes]),
    )
    untouched = ~touched(laid, preparation.surface)
    return Problem(preparation.network, target, preparation.surface.where(untouched), stroke.seed)


def lay_copies(network: Siren, stroke: Stroke) -> tuple[Laid, ...]:
    """The stroke and its mirror images, laid on the surface. SculptError when one misses it."""
    return tuple(Laid(copy, lay(network, copy)) for copy in stroke.copies())


def sample_tubes(
    network: Siren,
    laid: tuple[Laid, ...],
    rows: int = ROWS,
    columns: int = COLUMNS,
    jitter: np.random.Generator | None = None,
) -> list[Tube]:
    """The tube of each copy, without the samples that another copy displaces farther."""
    tubes = []
    for mine in laid:
        tube = sample_tube(network, mine.stroke, mine.path, rows, columns, jitter)
        amount = np.abs(tube.displacement.amount)
        for other in laid:
            if other is not mine:
                theirs = displace(other.stroke, other.path, *tube.surface)
                amount = np.where(np.abs(theirs.amount) > amount, np.inf, amount)
        tubes.append(tube.where(np.isfinite(amount)))
    return tubes


def touched(laid: tuple[Laid, ...], surface: Samples) -> NDArray[np.bool_]:
    """Which surface samples (N,) the stroke may move; what lies beyond a flat end, it may not."""
    inside = np.zeros(len(surface.points), bool)
    for stroke, path in laid:
        displacement = displace(stroke, path, *surface)
        near = displacement.nearness <= 1
        if stroke.ends is Ends.FLAT and len(path.points) > 1:
            near &= ~displacement.beyond
        inside |= near
    return inside


def nearness(laid: tuple[Laid, ...], surface: Samples) -> NDArray[np.float64]:
    """Distance (N,) of surface samples from the nearest copy of the stroke, in its radii."""
    return np.min([displace(*one, *surface).nearness for one in laid], axis=0)
