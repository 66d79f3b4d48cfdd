# SPDX-License-Identifier: GPL-3.0-or-later
"""The same mesh in another order, in which neighbours are near to each other."""

import numpy as np
import trimesh

from neural_sculpt_addon.field.mesh.morton_order import morton_order


def shuffled(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A sphere without any order, and a vertex that no triangle has."""
    generator = np.random.default_rng(seed)
    sphere = trimesh.creation.icosphere(4, radius=0.8)
    place = generator.permutation(len(sphere.vertices))
    vertices = np.empty((len(place) + 1, 3), np.float32)
    vertices[place], vertices[-1] = sphere.vertices, 0.0
    triangles = place[generator.permutation(sphere.faces)].astype(np.int32)
    return vertices, triangles


def corners(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Of each triangle its corners' places, the triangles sorted by these (F, 9)."""
    flat = vertices[triangles].reshape(-1, 9)
    return flat[np.lexsort(flat.T)]


def test_it_is_the_same_mesh():
    vertices, triangles = shuffled(5)
    order, after = morton_order(vertices, triangles)
    assert (after.dtype, after.shape) == (np.int32, triangles.shape)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(vertices)))
    np.testing.assert_array_equal(corners(vertices[order], after), corners(vertices, triangles))


def test_vertices_come_as_triangles_come_to_them():
    vertices, triangles = shuffled(6)
    order, after = morton_order(vertices, triangles)
    met = list(dict.fromkeys(after.ravel().tolist()))
    assert met == list(range(len(vertices) - 1))
    assert order[-1] == len(vertices) - 1


def test_neighbours_are_near():
    """The way from triangle to triangle is that of a curve, and no longer across the sphere."""
    vertices, triangles = shuffled(7)
    order, after = morton_order(vertices, triangles)
    ways = [
        np.linalg.norm(np.diff(v[t].mean(axis=1), axis=0), axis=1).mean()
        for v, t in ((vertices, triangles), (vertices[order], after))
    ]
    assert ways[0] > 0.5
    assert ways[1] < 0.08


def test_there_may_be_nothing():
    order, after = morton_order(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    assert (order.shape, after.shape) == ((0,), (0, 3))
