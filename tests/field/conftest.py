# SPDX-License-Identifier: GPL-3.0-or-later
"""What several tests share: one edit of a sphere by the paper's solver."""

import os
from typing import NamedTuple

import numpy as np
import pytest
import torch

from neural_sculpt_addon.field import threads
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import Preparation, prepare
from neural_sculpt_addon.field.problem.problem import Problem
from neural_sculpt_addon.field.solve import paper
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball


class Sculpted(NamedTuple):
    """A belt around the equator of a sphere of radius 1/2, half finished."""

    preparation: Preparation
    stroke: Stroke
    problem: Problem
    field: Field


@pytest.fixture(autouse=True)
def seeded():
    """Each test finds torch's own generator the same: modules of torch.nn are made by it."""
    torch.manual_seed(0)


@pytest.fixture(scope="session")
def preparation():
    """Of a sphere whose network has units to spare for an edit."""
    return prepare(ball(0.5, spare=100))


@pytest.fixture(scope="session")
def ready():
    """Of the sphere of radius 0.6 that the add-on ships: a network of the usual size."""
    return prepare(primitive("sphere"))


@pytest.fixture(scope="session")
def sculpted(preparation):
    turn = np.linspace(0, 2 * np.pi, 25)[:-1]
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    stroke = Stroke(points, Brush(0.25, 0.04), closed=True, name="belt", seed=7)
    problem = pose(preparation, stroke)
    return Sculpted(preparation, stroke, problem, Field(paper.solve(problem, epochs=8)))


@pytest.fixture
def cores(monkeypatch):
    """Sets for how many cores the pool has threads."""

    def forget():
        threads.pool.cache_clear()
        threads.threads.cache_clear()

    def choose(number):
        monkeypatch.setattr(os, "cpu_count", lambda: number)
        forget()

    yield choose
    monkeypatch.undo()
    forget()
