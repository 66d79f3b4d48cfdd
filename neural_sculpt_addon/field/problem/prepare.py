# SPDX-License-Identifier: GPL-3.0-or-later
"""Edit context: what one state of the field determines, and strokes drawn on it need.

Only the proxy is made at once. Samples are drawn when a solver or a measure first asks for them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ...common.progress import Progress, silent
from ..evaluate import values
from ..field import Field
from ..mesh.proxy import Proxy, extract
from ..mesh.surface import Samples, SurfaceMesh, sample_surface, spatial_order

CELLS = 128  # per axis of the proxy; more find thinner parts, and take longer to march
SURFACE_SAMPLES = 40_000  # more hold the untouched surface more closely, and take longer to make
SHELL = 0.01  # standard deviation of the distance of shell points from the surface
BOX_SAMPLES = 20_000  # in the whole box, where nothing may appear: likewise
SAFE = 0.01  # of |f|, at which a change of it hardly makes a surface
SEED = 0  # of all samples, which so depend on the field alone


class Values(NamedTuple):
    """Points and what the unedited field is there."""

    points: NDArray[np.float32]  # (N, 3)
    values: NDArray[np.float32]  # (N,)

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "Values":
        """The chosen points."""
        return Values(self.points[chosen], self.values[chosen])


@dataclass(frozen=True)
class Preparation:
    """A field and its proxy on CELLS cells per axis."""

    field: Field
    proxy: Proxy

    @property
    def spacing(self) -> float:
        """Edge of a cell of the proxy, model units."""
        return self.proxy.active.spacing

    @property
    def mesh(self) -> SurfaceMesh:
        """The proxy's triangles, between samples of the surface."""
        proxy = self.proxy
        return SurfaceMesh(Samples(proxy.vertices, proxy.normals), proxy.triangles)

    @cached_property
    def surface(self) -> Samples:
        """(SURFACE_SAMPLES,) uniform by area, in spatial order."""
        surface = sample_surface(self.field, self.proxy, SURFACE_SAMPLES, SEED)
        return surface.where(spatial_order(surface.points))

    @cached_property
    def shell(self) -> Values:
        """One point beside each of the surface samples, off the surface."""
        offset = np.random.default_rng(SEED).normal(0, SHELL, (SURFACE_SAMPLES, 1))
        points = (self.surface.points + offset * self.surface.normals).astype(np.float32)
        return Values(points, values(self.field, points))

    @cached_property
    def box(self) -> Values:
        """(BOX_SAMPLES,) uniform in [-1, 1]^3, in spatial order."""
        points = np.random.default_rng(SEED).uniform(-1, 1, (BOX_SAMPLES, 3)).astype(np.float32)
        points = points[spatial_order(points)]
        return Values(points, values(self.field, points))

    @cached_property
    def underestimation(self) -> NDArray[np.float32]:
        """(BOX_SAMPLES,) distance of the surface from the box points by that which |f| says.

        Where it is large, a change of the network soon makes a surface that nobody asked for.
        """
        distance = KDTree(self.surface.points).query(self.box.points)[0]
        return (distance / (np.abs(self.box.values) + SAFE)).astype(np.float32)


def prepare(field: Field, progress: Progress = silent) -> Preparation:
    """Extract the proxy. SculptError when there is no surface."""
    return Preparation(field, extract(field, CELLS, progress))
