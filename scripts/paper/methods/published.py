# SPDX-License-Identifier: GPL-3.0-or-later
"""One epoch of the paper's method as it is published, stage by stage, for table 4.

Samples are drawn and projected again in each epoch, although the unedited network, which determines
them, does not change. The surface sampler is that of 3DNS. All the rest, projection steps included,
is done by the functions of this project: a batch goes to all cores in parts that fit the cache,
with one torch thread each. torch's own threads took 2.6 times the processor time on a busy machine.

sample surface  perturb: move the samples in their tangent planes. project: bring them back by seven
                steps. filter: drop those that are off the surface or out of the box
discard         samples that lie under the stroke
sample stroke   tube: offsets, 99 x 101. project: as above. brush: displacement and normals
inference       value and gradient of the network that learns; normals, which the paper lists apart,
                come with it in closed form
loss, backward  and the step of Adam
"""

import numpy as np
import torch
from scipy.spatial import KDTree

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.problem.copies import displaced
from neural_sculpt_addon.field.problem.problem import Problem
from neural_sculpt_addon.field.solve import paper
from neural_sculpt_addon.field.solve.adam import Adam
from neural_sculpt_addon.field.threads import parallel
from neural_sculpt_addon.stroke.displacement import displace

from ..measures.stages import Stopwatch
from ..measures.surface import Array
from .three_dns import ACCEPTED, CHAIN_STEPS, STEP, Chain, bring, disk

ROWS, COLUMNS = 99, 101
PRESERVE, BOX = 10_000, 10_000
RATE = 1e-4
PAPER = {  # ms of an epoch on an RTX 4070
    "sample surface: perturb": 1.0,
    "sample surface: project": 9.0,
    "sample surface: filter": 2.5,
    "discard stroke samples": 2.5,
    "sample stroke: tube": 1.8,
    "sample stroke: project": 8.8,
    "sample stroke: brush": 2.1,
    "inference and normals": 1.3 + 1.2,
    "loss": 1.6,
    "backward": 11.7,
}


class Published:
    """The method on one problem."""

    def __init__(self, problem: Problem) -> None:
        """Draw the first samples, which is not timed."""
        self._problem, self._random = problem, np.random.default_rng(problem.seed)
        chain = Chain(problem.field, PRESERVE, self._random)
        self._points, self._normals = chain.points, chain.normals
        self._path = KDTree(problem.placed[0].path.points)
        self._parameters = [p.clone().requires_grad_() for p in problem.field.network.parameters]
        self._network: Siren = problem.field.network.with_parameters(self._parameters)
        self._adam = Adam(self._parameters)

    @property
    def field(self) -> Field:
        """What has been learned so far."""
        return Field(self._network.with_parameters([p.detach() for p in self._parameters]))

    def epoch(self, watch: Stopwatch) -> None:
        """One epoch."""
        kept = self._surface(watch)
        tube = self._stroke(watch)
        with watch.stage("loss"):
            box = 2 * self._random.random((BOX, 3)) - 1
            on, held = ([_tensor(array) for array in pair] for pair in (tube, kept))
            parts = paper.weigh(on, held, _tensor(box))
            parts = [some for whole in parts for some in whole.split(paper.BATCH)]
        self._learn(watch, parts)

    def _surface(self, watch: Stopwatch) -> Samples:
        """Preserve samples beside the stroke."""
        shape = self._problem.field
        with watch.stage("sample surface: perturb"):
            moved = self._points + STEP * disk(self._normals, 1, self._random)[:, 0]
        with watch.stage("sample surface: project"):
            points, value, normals = bring(shape, moved, CHAIN_STEPS)
        with watch.stage("sample surface: filter"):
            good = np.flatnonzero((value < ACCEPTED) & (np.abs(points).max(axis=1) < 1))
            again = np.concatenate(
                [good, self._random.choice(good, PRESERVE - len(good), replace=True)]
            )
            self._points, self._normals = points[again], normals[again]
        with watch.stage("discard stroke samples"):
            reach = self._problem.stroke.brush.radius
            near = np.isfinite(self._path.query(self._points, distance_upper_bound=reach)[0])
            return Samples(self._points[~near], self._normals[~near])

    def _stroke(self, watch: Stopwatch) -> Samples:
        """Targets of the tube."""
        (stroke, path), shape = self._problem.placed[0], self._problem.field
        with watch.stage("sample stroke: tube"):
            rows = np.linspace(0, len(path.points) - 1, ROWS).round().astype(int)
            aside = self._random.uniform(-1, 1, (ROWS, COLUMNS, 1)) * stroke.brush.radius
            places = path.points[rows, None] + aside * path.laterals[rows, None]  # (R, C, 3)
        with watch.stage("sample stroke: project"):
            points, _, normals = bring(shape, places.reshape(-1, 3), CHAIN_STEPS)
        with watch.stage("sample stroke: brush"):
            samples = Samples(points.astype(np.float32), normals.astype(np.float32))
            there = displace(stroke, path, *samples)
            return displaced(shape, stroke, path, samples, there)[0]

    def _learn(self, watch: Stopwatch, parts: list[paper.Part]) -> None:
        network = self._network
        with watch.stage("inference and normals"):
            found = parallel(lambda part: network.value_and_gradient(part.points), parts)
        with watch.stage("loss"):
            losses = [paper.loss_of(*pair, part) for pair, part in zip(found, parts, strict=True)]
        with watch.stage("backward"):
            slopes = parallel(lambda one: torch.autograd.grad(one, self._parameters), losses)
            self._adam.step([torch.stack(each).sum(0) for each in zip(*slopes, strict=True)], RATE)


def _tensor(array: Array) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, np.float32))
