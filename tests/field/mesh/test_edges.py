# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges against trimesh's and against the corners that they join."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.field.mesh.edges import find_edges

OPEN = np.array([[0, 1, 2], [2, 1, 3], [4, 3, 1]], np.int32)
THREE_AT_ONE_EDGE = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32)


@pytest.mark.parametrize(
    "triangles",
    [
        trimesh.creation.icosphere(3).faces.astype(np.int32),
        trimesh.creation.torus(1.0, 0.3).faces.astype(np.int32),
        OPEN,
        THREE_AT_ONE_EDGE,
        OPEN + np.int32(2**31 - 5),  # too large for what small ones are packed into
        np.zeros((0, 3), np.int32),
    ],
)
def test_each_edge_once_and_every_corner_has_its_own(triangles):
    edges, of_corners = find_edges(triangles)
    assert (edges.dtype, of_corners.dtype) == (np.int32, np.int32)
    wanted = {frozenset(edge) for edge in trimesh.geometry.faces_to_edges(triangles).tolist()}
    assert {frozenset(edge) for edge in edges.tolist()} == wanted
    assert len(edges) == len(wanted)
    joined = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1)  # (F, 3, 2)
    np.testing.assert_array_equal(np.sort(edges[of_corners], axis=-1), np.sort(joined, axis=-1))
