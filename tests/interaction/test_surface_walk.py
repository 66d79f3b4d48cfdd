# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks on surfaces: igl's closest points are the reference, and seams are drawn by hand."""

import igl
import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.interaction.nearest_points import finish, nearest
from neural_sculpt_addon.interaction.surface_walk import Seams, dense_samples, twins, walk


def grid(count: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit square of count x count squares, two triangles each."""
    x, y = np.meshgrid(*[np.linspace(0, 1, count + 1)] * 2, indexing="ij")
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = np.arange((count + 1) ** 2, dtype=np.int32).reshape(count + 1, -1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    return points, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def places(points: np.ndarray, triangles: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The points (P, 3) with these weights (P, 3) in these triangles (P, 3)."""
    return (weights[:, :, None] * points[triangles]).sum(axis=1)


@pytest.mark.parametrize("shape", [trimesh.creation.icosphere(3), trimesh.creation.box()])
def test_a_walk_from_the_nearest_sample_ends_at_the_closest_point(shape: trimesh.Trimesh) -> None:
    positions, triangles = shape.vertices.astype(np.float32), shape.faces.astype(np.int32)
    points, faces = trimesh.sample.sample_surface(shape, 3000, seed=1)
    outward = np.random.default_rng(1).uniform(0, 0.05, (len(points), 1))  # where one is closest
    points = (points + outward * shape.face_normals[faces]).astype(np.float32)
    samples, owners = finish(dense_samples(positions, triangles, 0.04))
    start = owners[nearest(points, samples)]
    triangle, weights = finish(walk(points, start, positions, triangles, finish(twins(triangles))))
    found = places(positions, triangles[triangle], weights)
    away = np.linalg.norm(found - points, axis=1)
    squared = igl.point_mesh_squared_distance(points.astype(float), shape.vertices, shape.faces)[0]
    least = np.sqrt(squared)
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(away, least, atol=1e-5)


def test_samples_lie_in_their_triangles_and_no_farther_apart_than_asked() -> None:
    positions, triangles = grid(1)
    samples, owners = finish(dense_samples(positions, triangles, 0.1))
    assert len(samples) == 2 + 2 * 16**2  # a diagonal of 1.41 is halved four times
    np.testing.assert_allclose(samples[:2], [[2 / 3, 1 / 3, 0], [1 / 3, 2 / 3, 0]], atol=1e-6)
    np.testing.assert_array_equal(owners, np.where(samples[:, 0] > samples[:, 1], 0, 1))
    many = np.random.default_rng(0).random((500, 2))
    to_samples = np.linalg.norm(many[:, None] - samples[:, :2], axis=2).min(axis=1)
    assert to_samples.max() < 0.1
    assert len(finish(dense_samples(positions, triangles, 1.0))[0]) == 2


def test_at_a_corner_its_weight_is_exactly_one() -> None:
    positions, triangles = grid(6)
    middles = positions[triangles].mean(axis=1)
    start = np.linalg.norm(middles - positions[:, None], axis=2).argmin(axis=1)
    triangle, weights = finish(
        walk(positions, start, positions, triangles, finish(twins(triangles)))
    )
    assert set(np.unique(weights)) == {0.0, 1.0}
    corner = triangles[triangle, weights.argmax(axis=1)]
    np.testing.assert_array_equal(corner, np.arange(len(positions)))


def test_edges_have_two_sides_where_two_faces_of_one_turn_meet() -> None:
    # two triangles on edge 0-1, a third on edge 0-2, and one that is turned over on edge 1-2
    triangles = np.array(
        [[0, 1, 2], [1, 0, 3], [2, 1, 4], [1, 2, 5], [2, 0, 6], [2, 0, 7]], np.int32
    )
    found = finish(twins(triangles))
    pairs = {(i, int(j)) for i, j in enumerate(found) if j >= 0}
    assert pairs == {(0, 3), (3, 0)}  # 1-2 has three triangles, and so has 2-0


def test_a_walk_does_not_cross_a_seam() -> None:
    """A square whose values jump by 5 at x = 1/2: from either side all is found on that side."""
    positions, triangles = grid(8)
    edges, corners = finish(twins(triangles)), positions[triangles]
    left = corners[:, :, 0].mean(axis=1) < 0.5
    values = (corners[:, :, :1] + np.where(left, 0, 5)[:, None, None]).reshape(-1, 1)
    rng = np.random.default_rng(3)
    points = np.zeros((400, 3), np.float32)
    points[:, :2] = rng.random((400, 2)) * (0.4, 1) + (0.3, 0)
    middles = corners.mean(axis=1)
    for side, offset, lowest, highest in ((left, 0, 0, 0.5), (~left, 5, 0.5, 1)):
        own = np.flatnonzero(side)
        start = own[nearest(points, np.ascontiguousarray(middles[own]))]
        triangle, weights = finish(walk(points, start, positions, triangles, edges, Seams(values)))
        assert side[triangle].all()
        found = (weights * values.reshape(-1, 3)[triangle]).sum(axis=1)
        np.testing.assert_allclose(found, points[:, 0].clip(lowest, highest) + offset, atol=1e-5)


def test_values_that_differ_by_rounding_are_no_seam() -> None:
    positions, triangles = grid(4)
    edges = finish(twins(triangles))
    values = positions[triangles][:, :, :1].reshape(-1, 1)
    values += np.random.default_rng(4).uniform(-1e-6, 1e-6, values.shape).astype(np.float32)
    some = np.arange(len(values))
    some = some[edges >= 0]
    assert not Seams(values).cross(some, edges[some]).any()
    assert Seams(some_jump(values)).cross(some, edges[some]).any()


def some_jump(values: np.ndarray) -> np.ndarray:
    """The same but at the first triangle."""
    other = values.copy()
    other[:3] += 0.5
    return other
