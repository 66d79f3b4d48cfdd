# SPDX-License-Identifier: GPL-3.0-or-later
"""The freehand recorder: even spacing, the last point, very long strokes, rope, simplification."""

import unittest

import numpy as np

from tests.blender.geometry import to_path
from tests.interaction.support import module

RECORDER = module("interaction.recorder")


class Recorder(unittest.TestCase):
    def test_points_are_a_spacing_apart(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.1)
        for x in np.linspace(0, 1, 1001).tolist():
            recorder.add((x, 0.0, 0.0))
        steps = np.linalg.norm(np.diff(recorder.points, axis=0), axis=1)
        self.assertGreaterEqual(steps.min(), 0.1)
        self.assertLess(steps.max(), 0.102)

    def test_the_last_point_is_kept_with_the_last_pressure(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.1)
        recorder.add((0.0, 0.0, 0.0), 0.5)
        self.assertFalse(recorder.add((0.05, 0.0, 0.0)))
        recorder.finish((0.05, 0.0, 0.0))
        self.assertEqual(recorder.points, [(0.0, 0.0, 0.0), (0.05, 0.0, 0.0)])
        self.assertEqual(recorder.pressures, [0.5, 0.5])

    def test_the_last_point_takes_the_place_of_one_beside_it(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.1)
        for x in (0.0, 0.1, 0.2):
            recorder.add((x, 0.0, 0.0))
        recorder.finish((0.21, 0.0, 0.0))
        self.assertEqual([x for x, _, _ in recorder.points], [0.0, 0.1, 0.21])

    def test_a_click_is_one_point(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.1)
        recorder.add((0.0, 0.0, 0.5))
        recorder.finish((0.0, 0.0, 0.5))
        self.assertEqual(len(recorder.points), 1)

    def test_lifted_off_the_surface(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.1)
        recorder.add((0.0, 0.0, 0.5))
        recorder.finish(None)
        self.assertEqual(len(recorder.points), 1)

    def test_a_long_stroke_stays_bounded_and_whole(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.001)
        for t in np.linspace(0, 6.28, 5000).tolist():
            recorder.add((float(np.cos(t)), float(np.sin(t)), 0.0), t)
        self.assertLessEqual(len(recorder.points), RECORDER.MOST_RECORDED)
        self.assertEqual(len(recorder.points), len(recorder.pressures))
        self.assertEqual(recorder.points[0], (1.0, 0.0, 0.0))
        reached = np.arctan2(*reversed(recorder.points[-1][:2]))
        self.assertAlmostEqual(reached, 0.0, delta=0.03)

    def test_simplifying_keeps_ends_corners_and_the_line(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.01)
        corner = [(t, 0.0, 0.0) for t in np.linspace(0, 1, 50)]
        corner += [(1.0, t, 0.0) for t in np.linspace(0.02, 1, 50)]
        for x, y, z in corner:
            recorder.keep((float(x), float(y), z), float(y))
        before = np.array(recorder.points)
        recorder.simplify(0.001)
        self.assertEqual(recorder.points, [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)])
        self.assertEqual(recorder.pressures, [0.0, 0.0, 1.0])
        self.assertLessEqual(to_path(before, np.array(recorder.points)).max(), 0.001)


class Stabilizer(unittest.TestCase):
    def test_stands_still_until_the_rope_is_tight(self) -> None:
        pen = RECORDER.Stabilizer(30.0, (0.0, 0.0))
        self.assertEqual(pen.pull((29.0, 0.0)), (0.0, 0.0))
        x, y = pen.pull((80.0, 0.0))
        self.assertAlmostEqual(x, 50.0)
        self.assertEqual(y, 0.0)

    def test_smooths_what_trembles(self) -> None:
        pen = RECORDER.Stabilizer(30.0, (0.0, 0.0))
        drawn = [pen.pull((float(x), 8.0 * (-1) ** x)) for x in range(0, 400, 3)]
        self.assertLess(np.ptp([y for _, y in drawn[40:]]), 4.0)

    def test_without_a_rope_it_is_the_mouse(self) -> None:
        pen = RECORDER.Stabilizer(0.0, (0.0, 0.0))
        np.testing.assert_allclose(pen.pull((3.0, 4.0)), (3.0, 4.0))
