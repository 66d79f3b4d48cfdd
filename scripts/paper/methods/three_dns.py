# SPDX-License-Identifier: GPL-3.0-or-later
"""3DNS: point edits of a neural field by radial brushes, and strokes as many points.

P. Tzathas, P. Maragos, A. Roussos, "3D Neural Sculpting (3DNS): Editing Neural Signed Distance
Functions", WACV 2023, and the authors' code, from which these settings are:

- Brush: a polynomial of the distance rho from the interaction point in its tangent plane,
  s b(rho / r), linear, cubic or quintic. Samples are uniform on the tangent disk, brought to the
  surface by two steps x - f grad f / |grad f|, and displaced along the normal of the point.
- Preserve samples: a Markov chain on the surface. Each step moves a sample uniformly within 0.04 in
  its tangent plane, brings it back by seven such steps, and drops it where |f| stays above 0.009 or
  it left the box; lost ones are replaced by neighbours of others. 10 steps come before the first
  use. Those within r of the point are rejected.
- Interaction samples: 10 for each that was rejected, at least 1000.
- Loss: 1500 mean|f| + 50 mean(1 - cos) + 25 mean||grad f| - 1| on samples, and
  50 mean exp(-100 |f|) + 25 mean||grad f| - 1| on points of a box of half extent 1.15; Adam, rate
  1e-4, all samples drawn anew each epoch.

The paper compares strokes with it: points along the stroke, all their samples in one batch, 10,000
preserve samples and 10,000 of the box. That is `points`. Where disks overlap, the bumps of two
points ask for two different surfaces there, and the result is between them. `union` is the better
reading of "a union of points", and ours: a disk sample counts where its own point is the nearest,
so there is one target.

Chosen here, where the sources leave it open or where it is kinder to the baseline: the chain starts
from points of the box that are near the surface, evenly, not from all of it; f = 0 stands for the
1e-6 that seven steps leave; |f| is rounded to a parabola within 1.5e-3 of zero, as in our form of
the paper's solver; batches go through the product's evaluation and derivatives, on all cores.
Profiles other than the three polynomials are no radial brushes. Model space.
"""

import time
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field

import numpy as np
import torch
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.spatial import KDTree

from neural_sculpt_addon.field.checkpoint import to_bytes
from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.problem.placement import place_stroke
from neural_sculpt_addon.field.problem.prepare import CELLS
from neural_sculpt_addon.field.solve import paper
from neural_sculpt_addon.field.solve.adam import Adam
from neural_sculpt_addon.field.solve.paper import Part
from neural_sculpt_addon.stroke.stroke import Stroke

from ..measures.surface import Array, FieldSurface
from .methods import Result, Scene

PRESERVE, BOX = 10_000, 10_000  # samples, of the paper's comparison
HALF_EXTENT = 1.15
FACTOR, LEAST = 10, 1000  # interaction samples for each rejected one, and of a point at least
STEP = 0.04  # of the chain, at most
ACCEPTED = 0.009  # |f| of a sample
CHAIN_STEPS, DISK_STEPS, BURN_IN = 7, 2, 10
START = 0.05  # |f| of the points of the box from which the chain starts
CANDIDATES = 40_000  # of those at a time
VALUE, NORMAL, EIKONAL, BOUNDARY = 1500.0, 50.0, 25.0, 50.0
RATE = 1e-4

BRUSHES = {  # b(rho), rho in [0, 1]
    "linear": Polynomial([1, -1]),
    "cubic": Polynomial([1, 0, -3, 2]),
    "quintic": Polynomial([1, 0, 0, -10, 15, -6]),
}


def bring(shape: Field, points: Array, steps: int) -> tuple[Array, Array, Array]:
    """Points (N, 3) after so many steps by f along the unit gradient; |f| (N,) and normals (N, 3)
    before the last of them."""
    value, gradient = np.empty(len(points)), np.empty(points.shape)
    for _ in range(steps):
        value, gradient = values_and_gradients(shape, points)
        gradient /= np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12)
        points = points - value[:, None] * gradient
    return points, np.abs(value), gradient


def disk(normals: Array, count: int, random: np.random.Generator) -> Array:
    """`count` points (N, count, 3) uniform on the unit disks through the origin with `normals`."""
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    radius = np.sqrt(random.random((len(normals), count, 1)))
    turn = random.uniform(0, 2 * np.pi, (len(normals), count, 1))
    return radius * (np.cos(turn) * first[:, None] + np.sin(turn) * second[:, None])


class Chain:
    """The surface sampler: `points` (count, 3) and `normals` (count, 3) change with each step."""

    def __init__(self, shape: Field, count: int, random: np.random.Generator) -> None:
        """Samples after the first `BURN_IN` steps."""
        self._shape, self._count, self._random = shape, count, random
        self.points, self.normals = np.empty((2, 0, 3))
        while len(self.points) < count:
            start = random.uniform(-1, 1, (CANDIDATES, 3))
            self._accept(start[np.abs(values(shape, start)) < START])
        for _ in range(BURN_IN):
            self.step()

    def step(self) -> None:
        """Move all samples, and replace those that are lost."""
        moved = self.points + STEP * disk(self.normals, 1, self._random)[:, 0]
        self.points, self.normals = np.empty((2, 0, 3))
        self._accept(moved)
        while len(self.points) < self._count:
            some = self._random.integers(len(self.points), size=self._count - len(self.points))
            near = STEP * disk(self.normals[some], 1, self._random)[:, 0]
            self._accept(self.points[some] + near)

    def again(self, random: np.random.Generator) -> "Chain":
        """One that goes on from here and leaves this one where it is."""
        chain = copy(self)
        chain._random = random
        return chain

    def _accept(self, points: Array) -> None:
        points, value, normals = bring(self._shape, points, CHAIN_STEPS)
        good = (value < ACCEPTED) & (np.abs(points).max(axis=1) < 1)
        self.points = np.concatenate([self.points, points[good]])[: self._count]
        self.normals = np.concatenate([self.normals, normals[good]])[: self._count]


@dataclass(frozen=True)
class Points:
    """Interaction points along a stroke.

    places, normals: (K, 3); heights: (K,), of the bumps, signed; brush: b(rho)
    """

    places: Array
    normals: Array
    heights: Array
    radius: float
    brush: Polynomial

    @staticmethod
    def along(shape: Field, stroke: Stroke) -> "Points":
        """As many as the stroke has control points, evenly along it; the modulation scales them.

        ValueError when its profile is none of the three polynomials.
        """
        if stroke.brush.profile.name not in BRUSHES:
            raise ValueError("3DNS has radial brushes alone: linear, cubic and quintic.")
        path, u = place_stroke(shape, stroke), np.linspace(0, 1, len(stroke.points))
        places, normals = (
            np.stack([np.interp(u, path.u, axis) for axis in values.T], axis=1)
            for values in (path.points, path.normals)
        )
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        heights = stroke.brush.intensity * stroke.brush.modulation(u)
        brush = BRUSHES[stroke.brush.profile.name]
        return Points(places, normals, heights, stroke.brush.radius, brush)

    def samples(
        self, shape: Field, counts: NDArray[np.integer], union: bool, random: np.random.Generator
    ) -> tuple[Array, Array]:
        """`counts` (K,) samples of each bump: where the surface shall be (N, 3), its normals there.

        With h the height of the surface over the tangent plane of the point, the new surface is
        h + s b(rho / r) over it, and its normal n - grad h - (s / r) b'(rho / r) e_rho.
        """
        most = int(counts.max())
        flat = self.radius * disk(self.normals, most, random)  # (K, M, 3)
        own, taken = np.nonzero(np.arange(most) < counts[:, None])
        flat = flat[own, taken]  # (N, 3)
        if union:
            mine = KDTree(self.places).query(self.places[own] + flat)[1] == own
            own, flat = own[mine], flat[mine]
        upright = self.normals[own]
        points, _, normals = bring(shape, self.places[own] + flat, DISK_STEPS)
        rho = np.linalg.norm(flat, axis=1) / self.radius
        heights = self.heights[own]
        rise = heights / self.radius * self.brush.deriv()(rho)  # (N,)
        up = np.einsum("na,na->n", normals, upright)
        up = np.where(np.abs(up) < 1e-3, 1e-3, up)
        slope = upright - normals / up[:, None]  # grad h
        outward = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
        turned = upright - slope - rise[:, None] * outward
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        return points + (heights * self.brush(rho))[:, None] * upright, turned


@dataclass
class ThreeDns:
    """3DNS on a stroke of any number of points; one point is its own kind of edit."""

    name: str
    epochs: int
    union: bool = False
    preserve: int = PRESERVE
    box: int = BOX
    _chain: tuple[Field, Chain] | None = field(default=None, repr=False)

    def prepare(self, scene: Scene) -> None:
        """The chain, which depends on the unedited field alone."""
        if self._chain is None or self._chain[0] is not scene.field:
            self._chain = scene.field, Chain(scene.field, self.preserve, np.random.default_rng(0))

    def edit(self, scene: Scene, stroke: Stroke) -> Result:
        """The edit of one stroke."""
        self.prepare(scene)
        assert self._chain is not None
        started = time.perf_counter()
        chain = self._chain[1].again(np.random.default_rng((stroke.seed, 1)))
        edited = Field(self._solve(scene.field, chain, stroke))
        seconds = time.perf_counter() - started
        surface = FieldSurface(edited, extract(edited, CELLS), len(to_bytes(edited)))
        return Result(surface, seconds)

    def _solve(self, shape: Field, chain: Chain, stroke: Stroke) -> Siren:
        random = np.random.default_rng(stroke.seed)
        points = Points.along(shape, stroke)
        parameters = [p.clone().requires_grad_() for p in shape.network.parameters]
        network = shape.network.with_parameters(parameters)
        adam = Adam(parameters)
        for _ in range(self.epochs):
            chain.step()
            near = KDTree(points.places)
            kept = ~np.isfinite(near.query(chain.points, distance_upper_bound=points.radius)[0])
            within = KDTree(chain.points).query_ball_point(
                points.places, points.radius, return_length=True
            )
            counts = np.maximum(FACTOR * np.asarray(within), LEAST)  # (K,)
            targets, turned = points.samples(shape, counts, self.union, random)
            on = np.concatenate([chain.points[kept], targets])
            normals = np.concatenate([chain.normals[kept], turned])
            box = random.uniform(-HALF_EXTENT, HALF_EXTENT, (self.box, 3))
            parts = [p for whole in _weighed(on, normals, box) for p in whole.split(paper.BATCH)]
            adam.step(paper.derivatives(network, parts, lambda _: None), RATE)
        return shape.network.with_parameters([p.detach() for p in parameters])


def _weighed(on: Array, normals: Array, box: Array) -> Sequence[Part]:
    """Samples of the surface and of the box, each with its share of the loss."""
    count, off = len(on), len(box)
    return [
        Part(_tensor(on), _tensor(normals), VALUE / count, NORMAL / count, EIKONAL / count),
        Part(_tensor(box), None, BOUNDARY / off, 0.0, EIKONAL / off),
    ]


def _tensor(array: Array) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, np.float32))
