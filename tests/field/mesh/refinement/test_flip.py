"""Flips of edges within coarse triangles."""

import numpy as np

from neural_sculpt_addon.field.mesh.refinement.flip import find_poor, flip
from neural_sculpt_addon.field.mesh.refinement.subdivide import names

NONE = -1


def test_the_worse_diagonal_of_a_thin_pair_is_exchanged():
    """Of a kite the long diagonal makes two thin triangles, the short one two good ones."""
    vertices = np.array([[0, -1, 0], [0, 1, 0], [0.1, 0, 0], [-0.1, 0, 0]], np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (4, 1))
    triangles = np.array([[0, 2, 1], [0, 1, 3]], np.int32)
    assert find_poor(triangles, vertices, normals).all()
    flip(triangles, np.zeros(2, np.int32), vertices, normals, np.full(4, NONE, np.int64), 0)
    edges = {frozenset((t[i], t[i - 1])) for t in triangles.tolist() for i in range(3)}
    assert frozenset((2, 3)) in edges
    assert frozenset((0, 1)) not in edges


def test_two_coarse_triangles_never_get_an_edge_beside_the_one_they_share():
    """The middle of their common edge is so far off that in each, by itself, an edge from one of
    its ends to the other would be better; four triangles would have that one."""
    vertices = np.array(
        [[0, 0, 0], [1, 0, 0], [0.5, 0.03, 0], [0.5, -0.03, 0], [0.5, 0, 0.5]], np.float32
    )
    normals = np.tile(np.float32([0, 0, 1]), (5, 1))
    triangles = np.array([[0, 4, 2], [4, 1, 2], [4, 0, 3], [1, 4, 3]], np.int32)
    triangles = np.ascontiguousarray(triangles[:, ::-1])
    parents = np.array([0, 0, 1, 1], np.int32)
    sides = np.full(5, NONE, np.int64)
    free = triangles.copy()
    flip(free, parents, vertices, normals, sides, 0)
    assert (np.isin(free, (0, 1)).sum(axis=1) == 2).any()  # it would be there
    sides[4] = names(np.array([[0, 1]], np.int32))[0]
    flip(triangles, parents, vertices, normals, sides, 4)
    assert not (np.isin(triangles, (0, 1)).sum(axis=1) == 2).any()


def test_an_edge_between_two_coarse_triangles_stays():
    vertices = np.array([[0, -1, 0], [0, 1, 0], [0.1, 0, 0], [-0.1, 0, 0]], np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (4, 1))
    triangles = np.array([[0, 2, 1], [0, 1, 3]], np.int32)
    before, parents = triangles.copy(), np.array([0, 1], np.int32)
    flip(triangles, parents, vertices, normals, np.full(4, NONE, np.int64), 0)
    np.testing.assert_array_equal(triangles, before)
