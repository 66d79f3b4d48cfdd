# SPDX-License-Identifier: GPL-3.0-or-later
"""All that the unedited network determines and every edit of it needs.

Made once per revision, while the artist draws, and kept by the worker.
"""

from dataclasses import dataclass

from ..stroke.progress import Progress, silent
from .network import Siren
from .proxy import Proxy, extract
from .surface import Samples, sample_surface

SURFACE_SAMPLES = 40_000
CELLS = 128


@dataclass(frozen=True)
class Preparation:
    """What is known of one state of the weights before a stroke is drawn on it."""

    network: Siren
    proxy: Proxy
    surface: Samples  # (SURFACE_SAMPLES,), uniform by area


def prepare(network: Siren, seed: int = 0, progress: Progress = silent) -> Preparation:
    """Extract the proxy and sample the surface of `network`. SculptError when it has none."""
    proxy = extract(network, CELLS, progress)
    return Preparation(network, proxy, sample_surface(network, proxy, SURFACE_SAMPLES, seed))
