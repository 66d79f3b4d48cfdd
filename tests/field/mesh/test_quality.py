"""Quality of triangles."""

import numpy as np
import pytest

from neural_sculpt_addon.field.levels import (
    Level,
    cells_of,
    centres,
    linear,
    quantised,
    spacing,
)
from neural_sculpt_addon.field.mesh.quality import find_poor
from tests.field.analytic import plane


@pytest.mark.parametrize(
    ("angle", "poor"), [(1, True), (5, True), (7, True), (12, False), (30, False), (60, False)]
)
def test_triangles_with_an_angle_of_less_than_some_eight_degrees_are_poor(angle, poor):
    """Two long sides with that angle between them, and the same triangle at any size and place."""
    turn = np.radians(angle)
    corners = np.array([[0, 0, 0], [1, 0, 0], [np.cos(turn), np.sin(turn), 0]])
    normals = np.tile(np.float32([0, 0, 1]), (3, 1))
    triangle = np.array([[0, 1, 2]], np.int32)
    for size in (1.0, 0.01):
        vertices = (0.3 + size * corners).astype(np.float32)
        assert find_poor(plane(), triangle, vertices, normals)[0] == poor


def test_a_triangle_that_looks_the_other_way_is_poor():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0]], np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (3, 1))
    triangles = np.array([[0, 1, 2], [0, 2, 1]], np.int32)
    np.testing.assert_array_equal(find_poor(plane(), triangles, vertices, normals), [False, True])


@pytest.mark.parametrize("lean", [20, 65])
@pytest.mark.parametrize("up", [1, -1])
def test_where_corners_lean_the_field_in_the_middle_says_which_way_a_triangle_looks(lean, up):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0]], np.float32)
    turn = np.radians(lean)
    normals = np.tile(np.float32([np.sin(turn), 0, np.cos(turn)]), (3, 1))
    triangle = np.array([[0, 1, 2]], np.int32)
    poor = find_poor(plane((0.0, 0.0, float(up))), triangle, vertices, normals)[0]
    assert poor == (lean == 65 and up == -1)


def test_what_lies_between_agreeing_corners_is_seen():
    """A plane with a dent that turns the field over in the middle of a triangle of three cells."""
    node = np.zeros((1, 3), np.float32)
    cell = spacing(7)
    dent = {7: Level(linear(cells_of(node, 7), 7), quantised(np.full(1, -0.02)))}
    place = centres(cells_of(node, 7), 7)[0]
    at = place - np.float32([0, 0, 0.5 * cell])  # f falls upward here, by 1 - 0.75^2 * 0.02 / h
    field = plane(offset=float(at[2])).plus(dent)
    corners = np.array([[-1, -0.6, 0], [1, -0.6, 0], [0, 1.2, 0]], np.float32)
    up = np.tile(np.float32([0, 0, 1]), (3, 1))
    triangle = np.array([[0, 1, 2]], np.int32)
    for size, poor in ((1.8, True), (1.2, False)):
        vertices = at + np.float32(size * cell) * corners
        assert find_poor(field, triangle, vertices, up)[0] == poor
