# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons as triangles: together they are the polygon, its area, its way to turn and its edges."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from neural_sculpt_addon.field.mesh.polygons import MOST_CORNERS, triangulated


def one(points: np.ndarray) -> np.ndarray:
    """The triangles of a polygon (N, 2) or (N, 3)."""
    points = np.pad(points, [(0, 0), (0, 3 - points.shape[1])])
    return triangulated(points, np.arange(len(points)), np.array([len(points)]))


def areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Signed areas of triangles in the plane."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    u, v = b - a, c - a
    return (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2


def shoelace(points: np.ndarray) -> float:
    x, y = points.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def outline(triangles: np.ndarray) -> set[tuple[int, int]]:
    """The directed edges of triangles that have no other beside them."""
    edges = Counter(tuple(t[[i, i - 2]].tolist()) for t in triangles for i in range(3))
    return {(a, b) for a, b in edges if edges[a, b] != edges[b, a]}


def check(points: np.ndarray) -> None:
    """A polygon in the plane that does not cross itself becomes its triangles, and so it does in
    space, whatever its place."""
    turned = Rotation.from_euler("xyz", [0.3, 1.1, 2.0]).as_matrix()
    ring = {(i, (i + 1) % len(points)) for i in range(len(points))}
    for each in (points, np.pad(points, [(0, 0), (0, 1)]) @ turned.T + [3, -2, 5]):
        triangles = one(each)
        assert triangles.shape == (len(points) - 2, 3)
        sizes = areas(points, triangles) * np.sign(shoelace(points))
        slack = 1e-6 * abs(shoelace(points))
        assert sizes.min() >= -slack
        assert sizes.sum() == pytest.approx(abs(shoelace(points)))
        assert outline(triangles) == ring


@given(radii=st.lists(st.floats(0.05, 1), min_size=4, max_size=40), flip=st.booleans())
def test_polygons_around_a_point(radii, flip):
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    points = np.array(radii)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    check(points[::-1] if flip else points)


@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(0.01, 1)), min_size=2, max_size=30),
    st.integers(0, 60),
)
def test_bands_that_go_up_and_down(band, first):
    """Floors and heights above them, from left to right and back."""
    low, high = np.array(band).T
    x = np.arange(len(band))
    ring = np.concatenate([np.stack([x, low], 1), np.stack([x, low + high], 1)[::-1]])
    check(np.roll(ring, first, axis=0))


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=3, max_size=12), st.data())
def test_whatever_it_is_there_are_triangles(corners, data):
    """Corners that are repeated, lie on a line, or make a polygon that crosses itself: signed areas
    add up to the polygon's."""
    points = np.array(corners)
    points = points[data.draw(st.lists(st.integers(0, len(points) - 1), min_size=3, max_size=15))]
    triangles = one(points)
    assert triangles.shape == (len(points) - 2, 3)
    assert areas(points, triangles).sum() == pytest.approx(shoelace(points), abs=1e-9)


@pytest.mark.parametrize("first", range(4))
def test_an_arrow_of_four_corners(first):
    """Area by hand: a triangle of 2 by 2 less one of 2 by 1."""
    points = np.roll(np.array([(0, 0), (2, 1), (0, 2), (1, 1)], float), first, axis=0)
    sizes = areas(points, one(points))
    assert sizes.min() > 0
    assert sizes.sum() == pytest.approx(1)


def test_a_hole_that_a_bridge_joins_to_the_outline():
    """A square of 2 with a hole of 1."""
    outer, inner = [(0, 0), (2, 0), (2, 2), (0, 2), (0, 0)], [(0.5, 0.5), (0.5, 1.5)]
    points = np.array([*outer, *inner, (1.5, 1.5), (1.5, 0.5), (0.5, 0.5)])
    sizes = areas(points, one(points))
    assert sizes.min() >= 0
    assert sizes.sum() == pytest.approx(3)
    middles = points[one(points)].mean(axis=1)[sizes > 0]
    assert (np.abs(middles - 1).max(axis=1) > 0.5).all()


def test_a_concave_polygon_that_is_not_quite_flat():
    """An L of area 3 whose corners are off its plane by up to a hundredth."""
    flat = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    heights = np.random.default_rng(0).uniform(-0.01, 0.01, (6, 1))
    for first in range(6):
        points = np.roll(np.hstack([flat, heights]), first, axis=0)
        sizes = areas(points[:, :2], one(points))
        assert sizes.min() > -1e-9
        assert sizes.sum() == pytest.approx(3)


def test_convex_polygons_are_fans_in_the_order_of_the_file():
    angle = 2 * np.pi * np.arange(6) / 6
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    corners = np.array([0, 1, 2, 3, 4, 5, 0, 1, 3, 2, 3, 5, 4, 3, 2])
    triangles = triangulated(points, corners, np.array([6, 0, 3, 2, 4]))
    fan = [(0, i, i + 1) for i in range(1, 5)]
    assert triangles.tolist() == [[*t] for t in (*fan, (0, 1, 3), (5, 4, 3), (5, 3, 2))]


def test_corners_that_are_not_there_stay():
    triangles = triangulated(np.zeros((3, 3)), np.array([0, 1, 2, 7]), np.array([4]))
    assert triangles.max() == 7


@given(st.integers(4, 200))
def test_places_that_are_no_numbers(count):
    assume(count % 3)
    assert len(one(np.full((count, 3), np.nan))) == count - 2


@pytest.mark.parametrize("kind", ["star", "junk"])
def test_thousands_of_corners(kind):
    """A tenth of the most that may be, in a second."""
    count = MOST_CORNERS // 10
    angle = 2 * np.pi * np.arange(count) / count
    points = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points[::2] *= 0.5
    if kind == "junk":
        points = np.random.default_rng(0).normal(size=(count, 2))
    sizes = areas(points, one(points))
    assert sizes.sum() == pytest.approx(shoelace(points))
    assert kind == "junk" or sizes.min() > 0


def test_more_corners_than_that_are_refused_where_they_are_concave():
    count = MOST_CORNERS + 2
    angle = 2 * np.pi * np.arange(count) / count
    points = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert areas(points, one(points)).sum() == pytest.approx(np.pi)
    points[::2] *= 0.5
    with pytest.raises(ValueError, match="concave faces have too many corners"):
        one(points)
