# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory across edits: the surface that all strokes so far asked for, told apart from what the
network made of it.

Untouched samples keep their places and the values beside them, however often the network is
edited; under a stroke they go where it moves them. So errors of many edits do not add up, and what
one edit left unfinished the next one finishes. Model space.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from .evaluate import values
from .network import Siren
from .prepare import SHELL, Preparation, Values
from .problem import Problem
from .projection import project
from .proxy import Proxy
from .surface import Samples, spatial_order
from .threads import SEARCHED, in_pieces, join

NEIGHBOURS = 6  # of a sample, between which another one finds room
FAR = 2.0  # radii; farther from the stroke the box keeps its values


def follow(problem: Problem, edited: Siren, proxy: Proxy) -> Preparation:
    """What is known of `edited`, with its `proxy`, after it was to solve `problem`."""
    before = problem.preparation
    random = np.random.default_rng(problem.seed)
    kept = problem.known_untouched
    moved = _move(problem, before.surface.where(~kept), random)
    surface = join([before.surface.where(kept), moved])
    near = problem.distance(before.box.points) < FAR
    box = Values(before.box.points, before.box.values.copy())
    box.values[near] = values(edited, box.points[near])
    shell = join([before.shell.where(kept), _beside(problem, moved, surface, random)])
    order = spatial_order(surface.points)
    return Preparation(edited, proxy, surface.where(order), shell.where(order), box, before.doubt)


def _move(problem: Problem, surface: Samples, random: np.random.Generator) -> Samples:
    """Samples of the displaced surface, as dense as those of the surface before.

    Where it is compressed, samples are left out; where it is stretched, more are taken, each from
    the middle between two neighbours.
    """
    if len(surface.points) <= NEIGHBOURS:
        return problem.displaced(surface)[0]
    moved, stretch = problem.displaced(surface)
    stays = random.random(len(stretch)) < stretch
    missing = random.random(len(stretch)) < stretch - 1
    nearest = KDTree(surface.points).query(surface.points[missing], NEIGHBOURS + 1)
    other = random.permuted(np.asarray(nearest[1])[:, 1:], axis=1)[:, 0]
    middle = (surface.points[missing] + surface.points[other]) / 2

    def bring(part: slice) -> Samples:
        found = project(problem.network, middle[part])
        return Samples(found.points, found.normals)

    more, _ = problem.displaced(in_pieces(bring, len(middle), problem.check))
    return join([moved.where(stays), more])


def _beside(
    problem: Problem, moved: Samples, surface: Samples, random: np.random.Generator
) -> Values:
    """A point beside each of the samples `moved`, and its signed distance from `surface`."""
    offset = random.normal(0, SHELL, (len(moved.points), 1))
    points = (moved.points + offset * moved.normals).astype(np.float32)
    tree = KDTree(surface.points)

    def measure(part: slice) -> NDArray[np.float32]:
        distance, nearest = tree.query(points[part])
        out = ((points[part] - surface.points[nearest]) * surface.normals[nearest]).sum(1)
        return np.copysign(distance, out).astype(np.float32)

    return Values(points, in_pieces(measure, len(points), problem.check, size=SEARCHED))
