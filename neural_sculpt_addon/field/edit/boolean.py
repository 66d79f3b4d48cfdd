# SPDX-License-Identifier: GPL-3.0-or-later
"""Booleans: union, difference and intersection of a field with another solid, blended.

    min(f, g) -> points all over its surface -> the layer that leads there (see `absorb`)

g is the other solid's field, or the signed distance to its mesh. With f and -g, the minimum makes
the others: difference = -min(-f, g), intersection = -min(-f, -g). Where f and g differ by less than
the blend radius k, the minimum is the quadratic one of Quilez ("Smooth minimum", 2013),

    min(f, g) - (k - |f - g|)^2 / 4k

which fills a union's corner by at most k / 4 and rounds off that of the others. Model space. See
docs/method.md, section 6.
"""

import time
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from ...common.errors import SculptError
from ...common.progress import Progress, silent, sub_progress
from ...common.text import Text
from ..evaluate import values, values_and_gradients
from ..field import Field
from ..fit.mesh_cleanup import clean
from ..fit.mesh_distance import MeshDistance
from ..mesh.edges import find_edges
from ..mesh.proxy import Proxy, extract
from ..projection import project
from .absorb import Absorbed, find_moved, finished
from .absorption import Absorption
from .gone import CELLS, find_gone
from .patch import Patch

BLEND_CELLS, BLEND_FINEST = 256, 7
"""Cells per axis of the mesh that is taken in, and the level that takes it in: the mesh has four
samples, vertices and middles of edges, for each face of a cell of that level."""

LEAVES = Text(
    "The result would leave the box of the field. Join the two as meshes and make a new field of"
    " them (Neural Field from Mesh), or move the other object."
)


class Operation(StrEnum):
    """What becomes of a field A and another solid B."""

    UNION = "union"
    DIFFERENCE = "difference"
    INTERSECTION = "intersection"


class Valued(NamedTuple):
    """A solid at some points."""

    value: NDArray[np.float32]  # (N,), negative inside
    gradient: NDArray[np.float32]  # (N, 3)


Solid = Callable[[NDArray[np.float32]], Valued]
"""A solid at points (N, 3) of the space of the field that it is combined with."""


def mesh_solid(vertices: ArrayLike, triangles: ArrayLike, progress: Progress = silent) -> Solid:
    """The inside of a mesh, `vertices` (V, 3) and `triangles` (F, 3).

    SculptError when it has none, see `clean` and `MeshDistance`.
    """
    mesh = clean(vertices, triangles)
    distance = MeshDistance(mesh, np.random.default_rng(0), progress)

    def solid(points: NDArray[np.float32]) -> Valued:
        found = distance((points - mesh.center) / mesh.scale)
        value = (mesh.scale * found.value).astype(np.float32)
        return Valued(value, found.gradient.astype(np.float32))

    return solid


def field_solid(field: Field, matrix: ArrayLike) -> Solid:
    """The inside of a field whose model space `matrix` (4, 4) maps into the other one's.

    Beyond its box there is only outside. SculptError when the matrix flattens it.
    """
    to_other = np.asarray(matrix, float)
    size = abs(float(np.linalg.det(to_other[:3, :3]))) ** (1 / 3)
    if not np.isfinite(to_other).all() or size < np.finfo(np.float32).eps:
        raise SculptError("The other object is scaled to nothing. Give it a size.")
    back = np.linalg.inv(to_other)

    def solid(points: NDArray[np.float32]) -> Valued:
        there = points @ back[:3, :3].T + back[:3, 3]
        inside = there.clip(-1, 1)
        value, gradient = values_and_gradients(field, inside)
        beyond = there - inside  # (N, 3)
        far = np.linalg.norm(beyond, axis=1)
        out = far > 0
        value[out] = np.maximum(value[out], 0) + far[out]
        gradient[out] = beyond[out] / far[out, None]
        gradient = size * (gradient @ back[:3, :3])
        return Valued((size * value).astype(np.float32), gradient.astype(np.float32))

    return solid


def show(
    field: Field,
    solid: Solid,
    operation: str,
    blend: float = 0.0,
    *,
    cells: int = 64,
    progress: Progress = silent,
) -> Proxy:
    """A coarse mesh of what `combine` would come to, which takes the same and raises the same; only
    whether it is the field itself is not looked at."""
    return _extract(_combined(field, solid, operation, blend), cells, progress)


def combine(
    field: Field,
    solid: Solid,
    operation: str,
    blend: float = 0.0,
    *,
    preview: Callable[[Proxy], None] | None = None,
    preview_cells: int = 64,
    progress: Progress = silent,
) -> Absorbed:
    """The `field` combined with another solid.

    operation: an `Operation`
    blend:     radius k of the blend, 0 for a crease
    preview:   is given a coarse mesh of the result as soon as there is one

    SculptError when the result leaves the box, is nothing, or is the field itself.
    """
    start = time.monotonic()
    both = _combined(field, solid, operation, blend)
    if preview is not None:
        preview(_extract(both, preview_cells, sub_progress(progress, 0.0, 0.1)))
    mesh = _extract(both, BLEND_CELLS, sub_progress(progress, 0.1, 0.4))
    patch = _patch(field, both, mesh)
    gone = find_gone(field, patch, CELLS, sub_progress(progress, 0.4, 0.45))
    if not patch.moved.any() and not gone.pieces:
        raise SculptError(
            "This Boolean changes nothing: the other object adds nothing to the field, and takes"
            " nothing away, or is too small. Move it, scale it up, or choose another operation."
        )

    def signed(points: NDArray[np.float32], *_: NDArray[Any]) -> NDArray[np.float32]:
        return values(both, points)

    rng = np.random.default_rng(0)
    share = sub_progress(progress, 0.45, 0.8)
    solution = Absorption(field, patch, signed, BLEND_FINEST, rng, share, gone=gone.pieces)
    return finished(field, solution, patch, gone, start, sub_progress(progress, 0.8, 1.0))


@dataclass(frozen=True)
class _Combined(Field):
    """A field that is combined with a solid, evaluated as any field is.

    first, other: signs of both, of which and of whose result the minimum is taken
    """

    _: KW_ONLY
    solid: Solid
    first: int
    other: int
    blend: float

    def value(self, x: Tensor) -> Tensor:
        """The smooth minimum (N,) at points x (N, 3)."""
        g = torch.from_numpy(self.solid(x.cpu().numpy()).value).to(x.device)
        return self._least(super().value(x), g)[0]

    def value_and_gradient(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """The same and its gradient (N, 3)."""
        f, slope = super().value_and_gradient(x)
        g, other = (torch.from_numpy(part).to(x.device) for part in self.solid(x.cpu().numpy()))
        value, share = self._least(f, g)
        return value, slope + share[:, None] * (self.first * self.other * other - slope)

    def _least(self, f: Tensor, g: Tensor) -> tuple[Tensor, Tensor]:
        """The smooth minimum (N,) and the share (N,) that the solid has in it."""
        f, g = self.first * f, self.other * g
        apart = f - g
        share = (apart > 0).to(f.dtype)
        value = torch.minimum(f, g)
        if self.blend:
            near = (1 - apart.abs() / self.blend).clamp(min=0)  # (N,)
            value -= self.blend / 4 * near**2
            share += (0.5 - share) * near
        return self.first * value, share


def _combined(field: Field, solid: Solid, operation: str, blend: float) -> _Combined:
    """SculptError when there is no such operation, or blend radius."""
    if operation not in list(Operation):
        raise SculptError(
            "There is no operation {}; choose one of {}.",
            f"{operation!r:.60}",
            ", ".join(Operation),
        )
    if not 0 <= blend <= 1:
        raise SculptError("A blend radius is a number from 0 to 1, not {}.", f"{blend!r:.60}")
    return _Combined(
        field.network,
        field.detail,
        solid=solid,
        first=1 if operation == Operation.UNION else -1,
        other=-1 if operation == Operation.INTERSECTION else 1,
        blend=blend,
    )


def _patch(field: Field, both: _Combined, mesh: Proxy) -> Patch:
    """The vertices of a mesh of both, and the middles of its edges brought to their surface."""
    moved = find_moved(field, mesh.vertices, mesh.triangles)
    edges, _ = find_edges(mesh.triangles[moved[mesh.triangles].any(axis=1)])
    middles = project(both, mesh.vertices[edges].mean(axis=1)).points
    points = np.concatenate([mesh.vertices, middles])
    _, gradients = values_and_gradients(both, points)
    return Patch(points, gradients, np.append(moved, np.ones(len(middles), bool)))


def _extract(both: _Combined, cells: int, progress: Progress) -> Proxy:
    proxy = extract(both, cells, progress)
    if np.abs(proxy.vertices).max() >= 1:
        raise SculptError(LEAVES)
    return proxy
