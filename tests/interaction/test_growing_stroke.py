# SPDX-License-Identifier: GPL-3.0-or-later
"""A stroke that grows on a mesh: at each point of its way the mesh is as if the stroke had been
drawn at once, and no move looks at more vertices than it may."""

import unittest
from dataclasses import replace

import numpy as np

from tests.blender.geometry import square
from tests.interaction.support import module

Displaced = module("interaction.displaced").Displaced
Brush = module("stroke.brush").Brush
Modulation = module("stroke.modulation").Modulation
Profile = module("stroke.profile").Profile
Direction = module("stroke.stroke").Direction
Ends = module("stroke.stroke").Ends
Kind = module("stroke.stroke").Kind
Stroke = module("stroke.stroke").Stroke

PIECE = module("interaction.base_surface").PIECE


def hills(count: int = 101) -> tuple[np.ndarray, np.ndarray]:
    """The square, with hills."""
    points, triangles = square(count)
    points[:, 2] = 0.1 * np.sin(4 * points[:, 0]) * np.cos(3 * points[:, 1])
    return points, triangles


def walk(generator: np.random.Generator, count: int, step: float = 0.05) -> np.ndarray:
    """Points (K, 3) of a winding way over the hills, which may cross itself."""
    angle = generator.uniform(0, 2 * np.pi) + np.cumsum(generator.normal(0, 0.35, count))
    at = np.cumsum(step * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
    x, y = np.abs((at + generator.uniform(-0.3, 0.3, 2) + 0.6) % 2.4 - 1.2).T - 0.6  # turns back
    return np.stack([x, y, 0.1 * np.sin(4 * x) * np.cos(3 * y)], axis=1)


def at_once(points: np.ndarray, triangles: np.ndarray, *strokes: object) -> tuple:
    shape = Displaced(points, triangles)
    for stroke in strokes:
        shape.add(stroke)
    positions, normals = points.copy(), np.zeros_like(points)
    positions[shape.vertices], normals[shape.vertices] = shape.positions, shape.normals
    return positions, normals


class Growing(unittest.TestCase):
    def setUp(self) -> None:
        self.points, self.triangles = hills()

    def assert_as_at_once(self, shape: object, *strokes: object) -> None:
        positions, normals = at_once(self.points, self.triangles, *strokes)
        now = self.points.copy()
        now[shape.vertices] = shape.positions
        np.testing.assert_allclose(now, positions, rtol=0, atol=1e-6)
        turned = np.zeros_like(now)
        turned[shape.vertices] = shape.normals
        there = normals.any(axis=1)
        np.testing.assert_allclose(turned[there], normals[there], rtol=0, atol=1e-4)

    def grow(self, stroke: object, before: tuple = (), looks: tuple = (1, 7, 13, 99)) -> None:
        """Point by point; compared at some lengths and at the end."""
        shape = Displaced(self.points, self.triangles)
        for other in before:
            shape.add(other)
        count = len(stroke.points)
        for length in range(1, count + 1):
            words = ("radius_factors", "intensity_factors")
            factors = {w: getattr(stroke, w) for w in words if getattr(stroke, w) is not None}
            short = {word: values[:length] for word, values in factors.items()}
            grown = replace(stroke, points=stroke.points[:length], **short)
            if length == 1:
                shape.begin(grown)
            else:
                shape.change(grown)
            shape.advance()
            if length in looks or length == count:
                self.assert_as_at_once(shape, *before, grown)

    def test_any_stroke(self) -> None:
        for seed in range(6):
            generator = np.random.default_rng(seed)
            with self.subTest(seed=seed):
                self.grow(Stroke(walk(generator, 40), Brush(0.12, 0.05)))

    def test_profiles_ends_directions(self) -> None:
        way = walk(np.random.default_rng(1), 30)
        skew = Profile(points=((-1, 0), (-0.5, 1), (0.5, -1), (1, 0)))
        self.grow(Stroke(way, Brush(0.1, 0.05, skew), ends=Ends.FLAT))
        self.grow(Stroke(way, Brush(0.1, -0.05, skew), direction=Direction.STROKE))

    def test_mirrored(self) -> None:
        way = walk(np.random.default_rng(2), 30)
        self.grow(Stroke(way, Brush(0.15, 0.05), mirror=frozenset("XY")))

    def test_strength_by_the_length_and_pressure(self) -> None:
        generator = np.random.default_rng(3)
        way = walk(generator, 40)
        for name in ("exponential", "central"):
            self.grow(Stroke(way, Brush(0.1, 0.05, modulation=Modulation(name))))
        pressure = np.clip(0.2 + np.cumsum(generator.normal(0, 0.2, 40)), 0.05, 1.8)
        self.grow(
            Stroke(way, Brush(0.1, 0.05), radius_factors=pressure, intensity_factors=pressure)
        )

    def test_closed(self) -> None:
        way = walk(np.random.default_rng(4), 25)
        self.grow(Stroke(way, Brush(0.1, 0.05), closed=True))

    def test_two_points_are_no_ring(self) -> None:
        """A stroke with flat ends, marked closed: it ends in a plane at either of its points."""
        points, triangles = square()
        line = np.array([[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0]])
        shape = Displaced(points, triangles)
        shape.add(Stroke(line, Brush(0.2, 0.1), ends=Ends.FLAT, closed=True))
        moved = points[shape.vertices][shape.positions[:, 2] > 1e-6]
        self.assertGreater(np.abs(moved[:, 1]).max(), 0.15)
        self.assertLessEqual(np.abs(moved[:, 0]).max(), 0.3 + 1e-6)

    def test_upon_another_stroke(self) -> None:
        generator = np.random.default_rng(5)
        below = Stroke(walk(generator, 20), Brush(0.2, 0.06))
        self.grow(Stroke(walk(generator, 20), Brush(0.12, 0.05)), (below,))

    def test_points_are_dragged_and_removed_and_the_brush_changes(self) -> None:
        generator = np.random.default_rng(6)
        shape, way = Displaced(self.points, self.triangles), walk(generator, 6, 0.2)
        shape.begin(Stroke(way, Brush(0.1, 0.05)))
        for change in range(12):
            way = way.copy()
            if change % 4 == 3:
                way = np.delete(way, generator.integers(len(way)), axis=0)
            else:
                way[generator.integers(len(way)), :2] += generator.normal(0, 0.1, 2)
            stroke = Stroke(way, Brush(0.1 if change < 6 else 0.14, 0.05))
            shape.change(stroke)
            shape.advance()
            self.assert_as_at_once(shape, stroke)

    def test_where_images_meet_the_farthest_counts(self) -> None:
        """As in the field: the stroke on the plane of symmetry is not twice as high."""
        points, triangles = square()
        line = np.array([[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0]])
        stroke = Stroke(line, Brush(0.15, 0.06), mirror=frozenset("Y"))
        positions, _ = at_once(points, triangles, stroke)
        self.assertAlmostEqual(float(positions[:, 2].max()), 0.06, places=5)

    def test_between_points_far_apart_it_lies_on_the_surface(self) -> None:
        """Around a cylinder the straight way is far below: the surface is raised all the same."""
        angle, x = np.meshgrid(np.linspace(0, np.pi, 121), np.linspace(-0.5, 0.5, 41))
        points = np.stack([x, -0.5 * np.cos(angle), 0.5 * np.sin(angle)], axis=-1).reshape(-1, 3)
        corner = np.arange(points.size // 3, dtype=np.int32).reshape(angle.shape)
        a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
        triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        ends = np.array([[0, -0.5 * np.cos(t), 0.5 * np.sin(t)] for t in (0.4, np.pi - 0.4)])
        positions, _ = at_once(points.astype(np.float32), triangles, Stroke(ends, Brush(0.1, 0.05)))
        row = np.abs(points[:, 0]) < 1e-6
        between = row & (np.abs(points[:, 1]) < 0.5 * np.cos(0.4))
        height = np.linalg.norm(positions[:, 1:], axis=1) - 0.5
        np.testing.assert_allclose(height[between], 0.05, atol=0.002)

    def test_it_comes_onto_the_surface_from_beside(self) -> None:
        way = walk(np.random.default_rng(10), 20)
        way[:8, 2] += 1.0
        self.grow(Stroke(way, Brush(0.1, 0.05)))

    def test_other_kinds_move_nothing(self) -> None:
        shape = Displaced(self.points, self.triangles)
        shape.add(Stroke(walk(np.random.default_rng(7), 9), Brush(0.1, 0.5), kind=Kind.SMOOTH))
        self.assertEqual(len(shape.vertices), 0)


class Bounded(unittest.TestCase):
    """On 100,000 triangles: what a move looks at does not grow with the stroke or the radius."""

    MOST = 8000

    @classmethod
    def setUpClass(cls) -> None:
        cls.points, cls.triangles = hills(225)
        assert len(cls.triangles) > 100_000

    def draw(self, way: np.ndarray, brush: object, **words: object) -> tuple[object, list[int]]:
        shape, looked = Displaced(self.points, self.triangles), []
        for length in range(1, len(way) + 1):
            stroke = Stroke(way[:length], brush, **words)
            shape.begin(stroke) if length == 1 else shape.change(stroke)
            looked.append(shape.advance(self.MOST))
        return shape, looked

    def test_a_long_stroke_costs_no_more_at_its_end(self) -> None:
        way = walk(np.random.default_rng(8), 260, 0.015)
        shape, looked = self.draw(way, Brush(0.06, 0.02))
        self.assertIs(shape.seen, shape.strokes)
        self.assertLess(np.mean(looked[200:]), 2 * np.mean(looked[20:60]))
        self.assertLess(max(looked[5:]), 6000)

    def test_the_first_moves_sort_one_thing_each(self) -> None:
        """Triangles by either half of their numbers, then vertices: each takes longer than a move
        may."""
        images = {"mirror": frozenset("XYZ")}
        _, looked = self.draw(walk(np.random.default_rng(8), 4), Brush(0.1, 0.02), **images)
        count = len(self.points)
        self.assertEqual(looked[:3], [count // 4] * 3)
        self.assertLess(max(looked[3:]), self.MOST + 2 * PIECE)

    def test_a_wide_one_catches_up_when_it_rests(self) -> None:
        """Each move stops after a piece; what is seen meanwhile is whole."""
        way = walk(np.random.default_rng(9), 25, 0.02)
        for words in ({}, {"mirror": frozenset("XYZ")}):
            shape, looked = self.draw(way, Brush(0.6, 0.05), **words)
            self.assertLess(max(looked[3:]), self.MOST + 2 * PIECE)
            self.assertIsNot(shape.seen, shape.strokes)
            moves = 0
            while shape.seen is not shape.strokes:
                self.assertLess(shape.advance(self.MOST), self.MOST + 2 * PIECE)
                moves += 1
            self.assertGreater(moves, 1)
            positions, _ = at_once(self.points, self.triangles, shape.strokes[0])
            now = self.points.copy()
            now[shape.vertices] = shape.positions
            np.testing.assert_allclose(now, positions, rtol=0, atol=1e-6)
