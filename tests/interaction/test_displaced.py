# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices displaced before the worker has the stroke, on a square where all heights are known."""

import gc
import tracemalloc
import unittest
import weakref

import numpy as np

from tests.blender.geometry import square, to_path
from tests.interaction.support import module

Brush = module("stroke.brush").Brush
Ends = module("stroke.stroke").Ends
Profile = module("stroke.profile").Profile
Stroke = module("stroke.stroke").Stroke
LINE = np.array([[-0.3, 0.11, 0.0], [0.0, 0.11, 0.0], [0.3, 0.11, 0.0]])


def displaced(points: np.ndarray, triangles: np.ndarray, strokes: list):
    result = module("interaction.displaced").Displaced(points, triangles)
    for each in strokes:
        result.add(each)
    return result


def moved(points: np.ndarray, result) -> np.ndarray:
    after = points.copy()
    after[result.vertices] = result.positions
    return after


class Displaced(unittest.TestCase):
    def test_by_the_profile_and_nowhere_else(self) -> None:
        points, triangles = square()
        drawn = Stroke(LINE, Brush(0.15, 0.06, Profile("linear")), ends=Ends.FLAT)
        after = moved(points, displaced(points, triangles, [drawn]))
        x, y, _ = points.T
        height = 0.06 * np.maximum(1 - np.abs(y - 0.11) / 0.15, 0) * (np.abs(x) <= 0.3001)
        sure = np.abs(np.abs(x) - 0.3) > 0.001  # of the side of a flat end
        np.testing.assert_allclose(after[sure, 2], height[sure], atol=1e-6)
        np.testing.assert_array_equal(after[:, :2], points[:, :2])

    def test_round_ends_dabs_and_carving(self) -> None:
        points, triangles = square()
        for path in (LINE, LINE[:1]):
            drawn = Stroke(path, Brush(0.2, -0.1, Profile("linear")))
            after = moved(points, displaced(points, triangles, [drawn]))
            distance = to_path(points, np.vstack([path, path[-1:] + np.array(1e-9)]))
            np.testing.assert_allclose(
                after[:, 2], -0.1 * np.maximum(1 - distance / 0.2, 0), atol=1e-6
            )

    def test_what_is_dropped_unfinished_is_gone_at_once(self) -> None:
        """And does not wait for Python to collect garbage, which it does seldom."""
        points, triangles = square()
        drawn = Stroke(LINE, Brush(0.15, 0.06, Profile("linear")))
        gc.disable()
        self.addCleanup(gc.enable)
        is_whole = False
        for pieces in range(200):
            result = displaced(points, triangles, [])
            result.begin(drawn)
            for _ in range(pieces):
                result.advance(1)
            is_whole = result.seen is result.strokes
            there = weakref.ref(result)
            del result
            self.assertIsNone(there(), pieces)
            if is_whole:
                break
        self.assertTrue(is_whole)
        self.assertGreater(pieces, 5)

    def test_one_stroke_upon_another(self) -> None:
        points, triangles = square()
        drawn = Stroke(LINE, Brush(0.3, 0.01, Profile("linear")))
        once = moved(points, displaced(points, triangles, [drawn]))[:, 2]
        twice = moved(points, displaced(points, triangles, [drawn, drawn]))[:, 2]
        np.testing.assert_allclose(twice, 2 * once, atol=1e-3)
        self.assertAlmostEqual(twice.max(), 0.02, delta=1e-3)

    def test_mirror_images(self) -> None:
        points, triangles = square()
        drawn = Stroke(LINE, Brush(0.1, 0.05), mirror=frozenset("Y"))
        after = moved(points, displaced(points, triangles, [drawn]))[:, 2].reshape(81, 81)
        np.testing.assert_allclose(after, after[:, ::-1], atol=1e-6)
        self.assertAlmostEqual(after.max(), 0.05, delta=1e-3)

    def test_turned_images(self) -> None:
        points, triangles = square()
        drawn = Stroke(LINE + np.array((0.3, 0.2, 0)), Brush(0.1, 0.05), radial=(1, 1, 4))
        after = moved(points, displaced(points, triangles, [drawn]))[:, 2].reshape(81, 81)
        np.testing.assert_allclose(after, np.rot90(after), atol=1e-6)
        self.assertEqual(after[45, 45], 0)  # at (0.1, 0.1)
        self.assertAlmostEqual(after[55, 55], 0.05, delta=1e-3)  # at (0.3, 0.3)

    def test_copies_are_taken_up_one_by_one(self) -> None:
        """What a copy needs to know of the mesh is some hundred bytes a vertex: no piece of work
        asks for that of several, which takes longer than a move of the pen may."""
        points, triangles = square(201)
        drawn = Stroke(LINE + np.array((0.3, 0.2, 0)), Brush(0.05, 0.02), radial=(1, 1, 16))
        result = module("interaction.displaced").Displaced(points, triangles)
        result.begin(drawn)
        pieces = []
        tracemalloc.start()
        try:
            while result.seen is not result.strokes:
                tracemalloc.reset_peak()
                before = tracemalloc.get_traced_memory()[0]
                result.advance(1)
                pieces.append(tracemalloc.get_traced_memory()[1] - before)
        finally:
            tracemalloc.stop()
        self.assertLess(max(pieces), 400 * len(points))
        self.assertGreater(len(pieces), 16)
        after = moved(points, result)[:, 2]
        self.assertAlmostEqual(after.max(), 0.02, delta=1e-3)

    def test_where_images_overlap_the_larger_displacement_wins(self) -> None:
        points, triangles = square()
        drawn = Stroke(
            np.array([[0.1, 0, 0]]), Brush(0.3, 0.05, Profile("linear")), radial=(1, 1, 4)
        )
        after = moved(points, displaced(points, triangles, [drawn]))[:, 2]
        middles = np.array([[0.1, 0], [0, 0.1], [-0.1, 0], [0, -0.1]])
        distance = np.linalg.norm(points[:, None, :2] - middles, axis=2).min(axis=1)
        np.testing.assert_allclose(after, 0.05 * np.maximum(1 - distance / 0.3, 0), atol=1e-6)

    def test_normals_are_those_of_the_displaced_surface(self) -> None:
        points, triangles = square(321)
        drawn = Stroke(LINE, Brush(0.2, 0.05, Profile("cubic")), ends=Ends.FLAT)
        result = displaced(points, triangles, [drawn])
        x, y, _ = points[result.vertices].T
        inner = np.abs(x) < 0.28
        v = (y - 0.11) / 0.2
        slope = 0.05 / 0.2 * -6 * v * (1 - np.abs(v)) * (np.abs(v) < 1)  # of 1 - v^2 (3 - 2 |v|)
        expected = np.stack([0 * x, -slope, np.ones_like(x)], axis=1)
        expected /= np.linalg.norm(expected, axis=1, keepdims=True)
        np.testing.assert_allclose(result.normals[inner], expected[inner], atol=0.02)

    def test_only_the_sheet_that_was_drawn_on(self) -> None:
        points, triangles = square()
        both = np.vstack([points, points - (0, 0, np.float32(0.05))]).astype(np.float32)
        sheets = np.vstack([triangles, triangles[:, ::-1] + np.int32(len(points))])
        result = displaced(both, sheets, [Stroke(LINE, Brush(0.15, 0.06))])
        below = moved(both, result)[len(points) :]
        np.testing.assert_array_equal(below, both[len(points) :])

    def test_a_stroke_beside_the_surface_moves_nothing(self) -> None:
        points, triangles = square()
        result = displaced(
            points, triangles, [Stroke(LINE + np.array((0, 0, 0.7)), Brush(0.1, 0.05))]
        )
        self.assertEqual(len(result.vertices), 0)
