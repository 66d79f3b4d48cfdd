# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory across edits: the surface that all strokes so far asked for, told apart from what the
network made of it.

Untouched samples keep their places and the values beside them, however often the network is
edited; under a stroke they go where it moves them. So errors of many edits do not add up, and what
one edit left unfinished the next one finishes. Model space.
"""

from typing import TypeVar

import numpy as np
from scipy.spatial import KDTree

from .evaluate import values
from .network import Siren
from .prepare import SHELL, Preparation, Values
from .problem import Problem
from .projection import project
from .proxy import Proxy
from .surface import Samples

NEIGHBOURS = 6  # of a sample, between which another one finds room
FAR = 2.0  # radii; farther from the stroke the box keeps its values

T = TypeVar("T", Samples, Values)


def follow(problem: Problem, edited: Siren, proxy: Proxy) -> Preparation:
    """What is known of `edited`, with its `proxy`, after it was to solve `problem`."""
    before = problem.preparation
    random = np.random.default_rng(problem.seed)
    kept = problem.untouched(before.surface)
    moved = _move(problem, before.surface.where(~kept), random)
    surface = _join(before.surface.where(kept), moved)
    shell = Values(before.shell.points[kept], before.shell.values[kept])
    near = problem.distance(before.box.points) < FAR
    box = Values(before.box.points, before.box.values.copy())
    box.values[near] = values(edited, box.points[near])
    return Preparation(edited, proxy, surface, _join(shell, _beside(moved, surface, random)), box)


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
    middle = project(problem.network, (surface.points[missing] + surface.points[other]) / 2)
    more, _ = problem.displaced(Samples(middle.points, middle.normals))
    return _join(moved.where(stays), more)


def _beside(moved: Samples, surface: Samples, random: np.random.Generator) -> Values:
    """A point beside each of the samples `moved`, and its signed distance from `surface`."""
    offset = random.normal(0, SHELL, (len(moved.points), 1))
    points = (moved.points + offset * moved.normals).astype(np.float32)
    distance, nearest = KDTree(surface.points).query(points)
    out = ((points - surface.points[nearest]) * surface.normals[nearest]).sum(1)
    return Values(points, np.copysign(distance, out).astype(np.float32))


def _join(first: T, second: T) -> T:
    return type(first)(*(np.concatenate(arrays) for arrays in zip(first, second, strict=True)))
