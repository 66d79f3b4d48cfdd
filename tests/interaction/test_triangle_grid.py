# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays and nearest points on triangles in a grid, by closed forms and by libigl."""

import unittest

import igl
import numpy as np

from tests.interaction.support import module

Grid = module("interaction.triangle_grid").TriangleGrid.of
RADIUS = 0.6


def sphere(count: int) -> tuple[np.ndarray, np.ndarray]:
    """A cube of 12 x count x count triangles, blown up to a sphere."""
    line = np.linspace(-1, 1, count + 1)
    u, v = (side.ravel() for side in np.meshgrid(line, line, indexing="ij"))
    place = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
    a, b, c, d = (place[i : i + count, j : j + count] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    face = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    points, triangles = [], []
    for axis in range(3):
        for sign in (-1, 1):
            triangles.append(face + len(points) * len(u))
            points.append(np.roll(np.stack([0 * u + sign, u, sign * v], axis=1), axis, axis=1))
    flat = np.vstack(points)
    flat *= RADIUS / np.linalg.norm(flat, axis=1, keepdims=True)
    return flat.astype(np.float32), np.vstack(triangles).astype(np.int32)


def uneven() -> tuple[np.ndarray, np.ndarray]:
    """A fine sphere beside a plate of two triangles that are far larger than all others."""
    points, triangles = sphere(20)
    plate = np.array([[-2, -2, -1], [2, -2, -1], [2, 2, -1], [-2, 2, -1]], np.float32)
    two = np.array([[0, 1, 2], [0, 2, 3]], np.int32) + len(points)
    return np.vstack([points, plate]), np.vstack([triangles, two])


class Rays(unittest.TestCase):
    def setUp(self) -> None:
        self.random = np.random.default_rng(5)

    def test_meets_a_sphere_where_the_formula_says(self) -> None:
        grid = Grid(*sphere(60))
        met = 0
        for _ in range(300):
            start = 2 * unit(self.random)
            ahead = -start / 2 + 0.2 * self.random.normal(size=3)
            ahead /= np.linalg.norm(ahead)
            middle = start @ ahead
            depth = middle**2 - (4 - RADIUS**2)
            found = grid.cast(start, 7 * ahead)
            if depth > 0.01:
                expected = start - (middle + np.sqrt(depth)) * ahead
                np.testing.assert_allclose(found[0], expected, atol=5e-3)
                np.testing.assert_allclose(found[1], expected / RADIUS, atol=0.05)
                met += 1
            elif depth < -0.01:
                self.assertIsNone(found)
        self.assertGreater(met, 100)

    def test_meets_what_libigl_meets(self) -> None:
        for points, triangles in (sphere(12), sphere(1), uneven()):
            grid, given = Grid(points, triangles), (points.astype(float), triangles.astype(int))
            met = 0
            for _ in range(200):
                start = 3 * unit(self.random)
                ahead = -start + self.random.normal(size=3)  # some pass by
                found, hits = grid.cast(start, ahead), igl.ray_mesh_intersect(start, ahead, *given)
                if not hits:
                    self.assertIsNone(found)
                    continue
                met += 1
                face, distance, _, _ = hits[0]
                a, b, c = points[triangles[face]].astype(float)
                normal = np.cross(b - a, c - a)
                normal /= np.linalg.norm(normal)
                np.testing.assert_allclose(found[0], start + distance * ahead, atol=1e-4)
                np.testing.assert_allclose(found[1], normal, atol=1e-3)
            self.assertGreater(met, 20)
            self.assertLess(met, 200)

    def test_no_ray_slips_through_edges_and_corners(self) -> None:
        points, triangles = sphere(15)
        grid = Grid(points, triangles)
        middles = points[triangles[:, :2]].mean(axis=1)
        for target in np.vstack([points[::7], middles[::7]]).astype(float):
            place, _ = grid.cast(3 * target, -target)
            np.testing.assert_allclose(place, target, atol=1e-5)

    def test_along_an_axis_and_beside(self) -> None:
        grid = Grid(*sphere(16))
        np.testing.assert_allclose(grid.cast((0, 0, 5), (0, 0, -1))[0], (0, 0, RADIUS), atol=1e-6)
        self.assertIsNone(grid.cast((0, 0, 5), (0, 0, 1)))
        self.assertIsNone(grid.cast((0.7, 0, 5), (0, 0, -1)))

    def test_from_within_it_meets_the_inside(self) -> None:
        place, normal = Grid(*sphere(16)).cast((0, 0, 0), (0, 0, 1))
        np.testing.assert_allclose(place, (0, 0, RADIUS), atol=1e-6)
        self.assertGreater(normal[2], 0.9)


class Laid(unittest.TestCase):
    def test_near_a_sphere_they_lie_on_it(self) -> None:
        count = 60
        size = 2 * RADIUS / count  # of the largest triangles
        towards = np.array([unit(np.random.default_rng(seed)) for seed in range(200)])
        laid, normals = Grid(*sphere(count)).lay(towards * np.linspace(0.3, 0.9, 200)[:, None])
        np.testing.assert_allclose(np.linalg.norm(laid, axis=1), RADIUS, atol=size**2)
        np.testing.assert_allclose(laid, RADIUS * towards, atol=size / 2)
        np.testing.assert_allclose(normals, towards, atol=0.05)

    def test_on_triangles_they_stay(self) -> None:
        points, triangles = uneven()
        inside = points[triangles[:-2:9]].mean(axis=1)
        np.testing.assert_allclose(Grid(points, triangles).lay(inside)[0], inside, atol=1e-6)

    def test_far_from_all_they_come_near(self) -> None:
        count = 60
        laid, _ = Grid(*sphere(count)).lay([(0, 0, 5), (4, 0, 0)])
        expected = [(0, 0, RADIUS), (RADIUS, 0, 0)]
        np.testing.assert_allclose(laid, expected, atol=2 * RADIUS / count)

    def test_beyond_an_edge_they_end_on_it(self) -> None:
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
        grid = Grid(corners, np.array([[0, 1, 2]], np.int32))
        outside = [(0.5, -1, 1), (-1, 0.25, -2), (2, 2, 0), (-1, -1, 0), (3, -1, 0), (0.2, 0.2, 1)]
        expected = [(0.5, 0, 0), (0, 0.25, 0), (0.5, 0.5, 0), (0, 0, 0), (1, 0, 0), (0.2, 0.2, 0)]
        np.testing.assert_allclose(grid.lay(outside)[0], expected, atol=1e-6)


def unit(random: np.random.Generator) -> np.ndarray:
    """A direction (3,)."""
    direction = random.normal(size=3)
    return direction / np.linalg.norm(direction)
