# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching cubes on a list of cells against scikit-image on the whole array."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree
from skimage.measure import marching_cubes

from neural_sculpt_addon.field.mesh.extraction.lattice import CORNERS, ActiveCells
from neural_sculpt_addon.field.mesh.extraction.march import march


def noise(cells, seed=0, scale=1.0):
    """A lattice (n, n, n) of random values with a ring of ones."""
    lattice = np.ones((cells + 3,) * 3, np.float32)
    shape = (cells + 1,) * 3
    lattice[1:-1, 1:-1, 1:-1] = np.random.default_rng(seed).normal(0, scale, shape)
    return lattice


def active_cells(lattice):
    n = len(lattice) - 1
    corners = np.stack([lattice[i : i + n, j : j + n, k : k + n] for i, j, k in CORNERS])
    inside = corners <= 0
    cells = inside.any(axis=0) & ~inside.all(axis=0)
    index = np.ravel_multi_index(np.nonzero(cells), lattice.shape).astype(np.int32)
    return ActiveCells(len(lattice) - 3, index, corners[:, cells])


@pytest.mark.parametrize("seed", range(4))
def test_noise_is_triangulated_as_by_scikit_image(seed):
    lattice = noise(14, seed)
    mesh = march(active_cells(lattice))
    expected, triangles, _, _ = marching_cubes(lattice, 0.0, method="lorensen")
    assert (len(mesh.vertices), len(mesh.triangles)) == (len(expected), len(triangles))
    expected = np.clip((expected - 1) * 2 / 14 - 1, -1, 1)  # the ring is drawn onto the box
    distance, _ = KDTree(expected).query(mesh.vertices)
    assert distance.max() <= 0.02 * 2 / 14 + 1e-6  # which vertices keep from the lattice's points
    found = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    oracle = trimesh.Trimesh(expected, triangles, process=False)
    assert found.is_watertight and found.is_winding_consistent
    assert found.volume == pytest.approx(oracle.volume, rel=5e-3)
    assert found.body_count == oracle.body_count


def test_every_edge_has_two_triangles_and_its_own_name():
    mesh = march(active_cells(noise(30)))
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert (np.diff(mesh.edges) > 0).all()
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.vertices)))


def test_a_plane_gives_its_normal_and_exact_places():
    n = 11  # 8 cells
    x, y, z = np.meshgrid(*[np.arange(n) / 4 - 1.25] * 3, indexing="ij")
    lattice = (0.48 * x + 0.6 * y + 0.64 * z).astype(np.float32)
    for axis in range(3):
        np.moveaxis(lattice, axis, 0)[[0, -1]] = 1.0
    mesh = march(active_cells(lattice))
    inner = ~mesh.held.any(axis=1) & (np.abs(mesh.vertices) < 0.75).all(axis=1)
    assert inner.sum() > 20
    assert np.allclose(mesh.normals[inner], [0.48, 0.6, 0.64], atol=1e-5)
    assert np.abs(mesh.vertices[inner] @ [0.48, 0.6, 0.64]).max() < 0.02 * 0.25
