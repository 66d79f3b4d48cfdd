# SPDX-License-Identifier: GPL-3.0-or-later
"""A part of the surface as a finer mesh."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.progress import go_on
from neural_sculpt_addon.field.mesh.local_extraction import extract_near
from tests.field.analytic import ball

CELLS = 32


@pytest.mark.parametrize("times", [2, 4])
def test_a_cap_of_a_ball(times):
    start = np.float32([[0.5, 0, 0]])

    def is_near(points):
        return points[:, 0] > 0.3

    part = extract_near(ball(0.5), start, is_near, CELLS, times, go_on)
    vertices, normals = part.vertices
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.5, atol=1e-4)
    np.testing.assert_allclose(normals, 2 * vertices, atol=1e-3)
    mesh = trimesh.Trimesh(vertices, part.triangles, process=False)
    assert (mesh.face_normals * mesh.triangles_center).sum(axis=1).min() > 0
    assert mesh.edges_unique_length.max() < 2 / (CELLS * times) * np.sqrt(3)
    count = np.bincount(mesh.edges_unique_inverse)
    assert set(count) == {1, 2}
    rim = vertices[np.unique(mesh.edges_unique[count == 1])]
    fine = 2 / (CELLS * times)
    assert rim[:, 0].min() > 0.3 - 1 / CELLS
    assert rim[:, 0].max() < 0.3 + 1 / CELLS + 2 * fine
    height = 0.5 - rim[:, 0].mean()
    assert mesh.area == pytest.approx(2 * np.pi * 0.5 * height, rel=0.02)  # Archimedes
