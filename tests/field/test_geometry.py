# SPDX-License-Identifier: GPL-3.0-or-later
"""Angles against those by which vectors were turned."""

import itertools

import numpy as np
import pytest

from neural_sculpt_addon.field.geometry import all_true, angles, lengths, search_tree, unit

SMALL = np.geomspace(1e-6, 0.1, 26)  # radians
TURNS = np.concatenate([[0], SMALL, np.linspace(0.1, 3, 30), np.pi - SMALL[::-1], [np.pi]])


def turned(seed):
    """Unit vectors (N, 3), and the same turned by TURNS in planes drawn at random."""
    first, other = np.random.default_rng(seed).normal(size=(2, len(TURNS), 3))
    first /= np.linalg.norm(first, axis=1)[:, None]
    across = np.cross(first, other)
    across /= np.linalg.norm(across, axis=1)[:, None]
    return first, np.cos(TURNS)[:, None] * first + np.sin(TURNS)[:, None] * across


@pytest.mark.parametrize("seed", range(5))
def test_angles_are_those_of_the_turn(seed):
    a, b = turned(seed)
    np.testing.assert_allclose(np.radians(angles(a, b)), TURNS, atol=1e-14)
    np.testing.assert_allclose(np.radians(angles(b, a)), TURNS, atol=1e-14)
    np.testing.assert_allclose(np.radians(angles(7 * a, b / 300)), TURNS, atol=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_angles_of_rounded_normals_are_off_by_no_more_than_their_rounding(seed):
    """A float32 component of a unit vector is off by 3e-8 at most, so a vector by 5e-8."""
    a, b = (vectors.astype(np.float32) for vectors in turned(seed))
    assert np.abs(np.radians(angles(a, b)) - TURNS).max() < 1.1e-7
    assert (angles(a, a) == 0).all()
    np.testing.assert_allclose(angles(a, -a), 180)


def test_nothing_is_across_everything():
    a, _ = turned(0)
    np.testing.assert_allclose(angles(a, np.zeros_like(a)), 90)


def test_lengths_and_units():
    vectors = np.array([[3, 4, 0], [0, 0, -2], [0, 0, 0]], np.float32)
    assert lengths(vectors).tolist() == [[5], [2], [0]]
    np.testing.assert_allclose(unit(vectors), [[0.6, 0.8, 0], [0, 0, -1], [0, 0, 0]], rtol=1e-6)


def test_the_nearest_point_is_found():
    points, asked = np.random.default_rng(1).uniform(size=(2, 300, 3))
    every = np.linalg.norm(asked[:, None] - points, axis=2)
    distance, nearest = search_tree(points).query(asked)
    assert (nearest == every.argmin(axis=1)).all()
    np.testing.assert_allclose(distance, every.min(axis=1))


def test_rows_that_are_true_throughout():
    flags = np.array(list(itertools.product([True, False], repeat=3)))
    np.testing.assert_array_equal(all_true(flags), [True] + 7 * [False])
    assert all_true(flags[:0]).shape == (0,)
