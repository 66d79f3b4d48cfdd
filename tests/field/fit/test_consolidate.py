# SPDX-License-Identifier: GPL-3.0-or-later
"""Consolidation: a plain network takes the shape of a field with detail, and says what it lost."""

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.field.detail import Detail
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.fit.consolidate import consolidate
from neural_sculpt_addon.field.levels import Level, cells_of, centres, linear, quantised
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.projection import project

RADIUS = 0.6  # of the shipped sphere
PLACE = np.array([RADIUS, 0, 0])  # of a bump on it
HEIGHT, WIDTH = 0.06, 0.1


def bump(x):
    """What is taken from the sphere's distance at x (N, 3)."""
    return HEIGHT * np.exp(-np.sum((x - PLACE) ** 2, axis=1) / (2 * WIDTH**2))


@pytest.fixture(scope="module")
def bumpy():
    """The sphere with a bump of detail, whose coefficients are the bump's values: close enough."""
    axis = np.arange(-0.4, 0.4, 2.0**-5)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3) + PLACE
    cells = np.unique(cells_of(grid.astype(np.float32), 5), axis=0)
    index = linear(cells, 5)
    order = np.argsort(index)
    level = Level(index[order], quantised(-bump(centres(cells, 5)))[order])
    return Field(primitive("sphere").network, Detail.of({5: level}))


@pytest.fixture(scope="module")
def done(bumpy):
    return consolidate(bumpy, 128)


@pytest.mark.long
def test_the_network_takes_the_bump(done):
    assert not done.field.detail.levels
    assert done.field.network.widths == (128, 128)
    n = np.random.default_rng(0).normal([2, 0, 0], 1, (2000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    points = project(done.field, RADIUS * n, steps=10).points
    off = np.linalg.norm(points, axis=1) - RADIUS - bump(points)
    assert np.abs(off).mean() < 1e-3
    assert bump(points).max() > 0.9 * HEIGHT * np.exp(-((HEIGHT / WIDTH) ** 2) / 2)


@pytest.mark.long
def test_the_field_stays_a_distance_near_its_surface(done, bumpy):
    x = np.random.default_rng(1).uniform(-1, 1, (20_000, 3))
    before, after = bumpy.sample(x), done.field.sample(x)
    assert np.abs(before.f - after.f).mean() < 0.01
    near = np.abs(before.f) < 0.03
    cosine = np.sum(before.gradient * after.gradient, axis=1)[near]
    assert cosine.mean() == pytest.approx(1, abs=0.03)


@pytest.mark.long
def test_the_report_is_what_was_lost(done, bumpy):
    report = done.report
    assert (report["components_before"], report["components"]) == (1, 1)
    n = np.random.default_rng(2).normal(size=(4000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    before = project(bumpy, RADIUS * n, steps=10)
    after = project(done.field, before.points, steps=10)
    distance = np.linalg.norm(before.points - after.points, axis=1)
    angle = np.degrees(np.arccos(np.sum(before.normals * after.normals, axis=1).clip(-1, 1)))
    assert report["distance_mean"] == pytest.approx(distance.mean(), rel=0.2)
    assert report["distance_p95"] == pytest.approx(np.percentile(distance, 95), rel=0.3)
    assert report["distance_max"] < 0.01
    assert report["normal_deg"] == pytest.approx(angle.mean(), rel=0.2)
    assert report["normal_deg"] < 2


@pytest.mark.long
def test_another_width_starts_anew(bumpy):
    done = consolidate(bumpy, 48, seed=3)
    assert done.field.network.widths == (48, 48)
    assert done.report["components"] == 1
    assert done.report["distance_mean"] < 5e-3


@pytest.mark.parametrize("width", [-1, 0, 7, 513, 10**9])
def test_widths_that_are_none(bumpy, width):
    with pytest.raises(SculptError, match="units wide"):
        consolidate(bumpy, width)


def test_it_can_be_cancelled(bumpy):
    def progress(fraction, message):
        if fraction > 0.2:
            raise Cancelled

    with pytest.raises(Cancelled):
        consolidate(bumpy, 16, progress=progress)
