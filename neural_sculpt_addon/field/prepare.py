# SPDX-License-Identifier: GPL-3.0-or-later
"""All that the unedited network determines and every edit of it needs.

Made once per revision, while the artist draws, and kept by the worker.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..stroke.progress import Progress, silent
from .evaluate import values
from .network import Siren
from .proxy import Proxy, extract
from .surface import Samples, sample_surface, spatial_order

CELLS = 128
SURFACE_SAMPLES = 40_000
SHELL = 0.01  # standard deviation of the distance of shell points from the surface
BOX_SAMPLES = 20_000
SAFE = 0.01  # of |f|, at which a change of it hardly makes a surface


class Values(NamedTuple):
    """Points and what the unedited field is there."""

    points: NDArray[np.float32]  # (N, 3)
    values: NDArray[np.float32]  # (N,)

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "Values":
        """The chosen points."""
        return Values(self.points[chosen], self.values[chosen])


@dataclass(frozen=True)
class Preparation:
    """What is known of one state of the weights before a stroke is drawn on it.

    surface: (SURFACE_SAMPLES,) uniform by area, in spatial order
    shell:   one point beside each of them, off the surface
    box:     (BOX_SAMPLES,) uniform in [-1, 1]^3, in spatial order
    doubt:   (BOX_SAMPLES,) how much farther the surface is from these than |f| says: where it is
             large, an edit soon makes a surface that nobody asked for
    """

    network: Siren
    proxy: Proxy
    surface: Samples
    shell: Values
    box: Values
    doubt: NDArray[np.float32]


def prepare(network: Siren, seed: int = 0, progress: Progress = silent) -> Preparation:
    """Extract the proxy and sample surface and space. SculptError when there is no surface."""
    random = np.random.default_rng(seed)
    proxy = extract(network, CELLS, lambda part, text: progress(0.8 * part, text))

    def check() -> None:
        progress(0.8, "Sampling")

    surface = sample_surface(network, proxy, SURFACE_SAMPLES, seed, check)
    surface = surface.where(spatial_order(surface.points))
    offset = random.normal(0, SHELL, (SURFACE_SAMPLES, 1))
    shell = (surface.points + offset * surface.normals).astype(np.float32)
    box = random.uniform(-1, 1, (BOX_SAMPLES, 3)).astype(np.float32)
    box = box[spatial_order(box)]
    far = Values(box, values(network, box))
    doubt = KDTree(surface.points).query(box)[0] / (np.abs(far.values) + SAFE)
    shell = Values(shell, values(network, shell))
    return Preparation(network, proxy, surface, shell, far, doubt.astype(np.float32))
