# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes with an alpha reach the surface that closed forms say."""

import numpy as np
import pytest

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.solve.resolution import resolution
from neural_sculpt_addon.stroke.alpha import Alpha, pixels_of
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke

RADIUS, HEIGHT = 0.2, 0.04
TOP = np.array([[0.0, 0.0, 0.6]])


def waves(count):
    """An image of waves from left to right, `count` of them."""
    x = (np.arange(128) + 0.5) / 128
    return pixels_of(np.tile(0.5 + 0.5 * np.cos(2 * np.pi * count * x), (128, 1)))


def surface_height(field, directions):
    """How far from the middle the surface lies in unit directions (N, 3), by bisection."""
    low, high = np.full(len(directions), 0.5), np.full(len(directions), 0.75)
    for _ in range(30):
        middle = (low + high) / 2
        inside = values(field, (middle[:, None] * directions).astype(np.float32)) < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return low


def test_a_dab_on_a_sphere_has_the_relief_of_its_image(ready):
    """Four waves across the dab, whose height is known at every angle from the top."""
    dab = Stroke(TOP, Brush(RADIUS, HEIGHT, alpha=Alpha(pixels=waves(4))))
    done = sculpt(ready, dab)
    report = done.report()
    assert report["tolerance_met"]
    assert report["untouched_normal_max"] < 0.5
    path = done.problem.placed[0].path
    u, v = path.tangents[0], path.laterals[0]
    turn, away = np.random.default_rng(5).uniform([0, 0], [2 * np.pi, 0.3], (300, 2)).T
    across = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    way = np.cos(away)[:, None] * path.normals + np.sin(away)[:, None] * across
    before = surface_height(ready.field, way)
    chord = 2 * 0.6 * np.sin(away / 2) / RADIUS
    t = np.minimum(chord, 1)
    profile = 1 - 10 * t**3 + 15 * t**4 - 6 * t**5
    relief = 0.5 + 0.5 * np.cos(4 * np.pi * (1 - chord * np.sin(turn)))
    expected = before + HEIGHT * profile * relief
    off = np.abs(surface_height(done.field, way) - expected)
    assert off.max() < 3e-3  # the field is not quite a sphere
    assert np.sqrt((off**2).mean()) < 6e-4
    assert (HEIGHT * profile * (1 - relief)).max() > 0.02


@pytest.mark.parametrize(("count", "finer"), [(1, 0), (11, 1), (22, 2)])
def test_a_fine_image_asks_for_a_fine_level(ready, count, finer):
    """Eleven waves across 0.4 rise within 0.018: 2 cells in that are of level 6.8."""
    dab = Stroke(TOP, Brush(RADIUS, 0.005, alpha=Alpha(pixels=waves(count))))
    assert resolution(pose(ready, dab)).wanted == 6 + finer


def test_an_image_that_the_budget_cannot_hold_is_told(ready):
    fine, coarse = Alpha(pixels=waves(40)), Alpha(pixels=waves(8))
    assert resolution(pose(ready, Stroke(TOP, Brush(0.5, 0.05, alpha=fine)))).is_limited
    assert not resolution(pose(ready, Stroke(TOP, Brush(0.1, 0.002, alpha=coarse)))).is_limited
    assert not resolution(pose(ready, Stroke(TOP, Brush(0.5, 0.05)))).is_limited


@pytest.mark.parametrize("solver", ["network", "paper"])
def test_the_other_solvers_take_it_as_well(preparation, solver):
    """A white image on the right half of a dab raises that half alone."""
    half = np.zeros((16, 16))
    half[:, 8:] = 1
    words = {"epochs": 20} if solver == "paper" else {}
    alpha = Alpha(pixels=pixels_of(half))
    dab = Stroke(TOP / 0.6 * 0.5, Brush(0.3, 0.05, alpha=alpha))
    done = sculpt(preparation, dab, solver=solver, **words)
    v = done.problem.placed[0].path.laterals[0]
    sides = TOP / 0.6 + np.array([[0.2], [-0.2]]) * v  # left, right
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    left, right = values(done.field, (0.5 * sides).astype(np.float32))
    assert right < left - 0.005
