"""Quality of triangles."""

import numpy as np
import pytest

from neural_sculpt_addon.field.mesh.refinement.quality import find_poor


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
        assert find_poor(triangle, vertices, normals)[0] == poor


def test_a_triangle_that_looks_the_other_way_is_poor():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0]], np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (3, 1))
    triangles = np.array([[0, 1, 2], [0, 2, 1]], np.int32)
    np.testing.assert_array_equal(find_poor(triangles, vertices, normals), [False, True])
