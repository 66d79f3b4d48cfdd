# SPDX-License-Identifier: GPL-3.0-or-later
"""The freehand recorder: even spacing, the last point, very long strokes."""

import unittest

import numpy as np
from harness import module

RECORDER = module("blender.recorder")


class Recorder(unittest.TestCase):
    def test_points_are_a_spacing_apart(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.1)
        for x in np.linspace(0, 1, 1001).tolist():
            recorder.add((x, 0.0, 0.0))
        steps = np.linalg.norm(np.diff(recorder.points, axis=0), axis=1)
        self.assertGreaterEqual(steps.min(), 0.1)
        self.assertLess(steps.max(), 0.102)

    def test_the_last_point_is_kept(self) -> None:
        recorder = RECORDER.StrokeRecorder(0.1)
        recorder.add((0.0, 0.0, 0.0))
        self.assertFalse(recorder.add((0.05, 0.0, 0.0)))
        recorder.finish((0.05, 0.0, 0.0), 0.5)
        self.assertEqual(recorder.points, [(0.0, 0.0, 0.0), (0.05, 0.0, 0.0)])
        self.assertEqual(recorder.pressures, [1.0, 0.5])

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
        self.assertLessEqual(len(recorder.points), RECORDER.MOST_POINTS)
        self.assertEqual(len(recorder.points), len(recorder.pressures))
        self.assertEqual(recorder.points[0], (1.0, 0.0, 0.0))
        reached = np.arctan2(*reversed(recorder.points[-1][:2]))
        self.assertAlmostEqual(reached, 0.0, delta=0.03)
