# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own sculpt brush on a proxy is noticed, guarded, and absorbed."""

import bpy
import numpy as np
from drawing import (
    STILL,
    WindowCase,
    choose_tool,
    edited,
    enter_sculpt_mode,
    field,
    operate,
)
from harness import state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from mathutils.bvhtree import BVHTree
from test_first_use import corners
from test_notice import reports


class NativeBrush(WindowCase):
    def test_native_brush(self) -> Steps:
        """A stroke is refused while that would be lost; Absorb makes it a layer of its own."""
        yield from self.add()
        yield from self.draw(self.arc(0.6))
        yield from enter_sculpt_mode()
        made = vertices(field())
        self.assertFalse(edited())
        yield from self.native(-0.5)
        self.assertTrue(edited())
        sculpted = vertices(field())
        tree = BVHTree.FromPolygons(sculpted.tolist(), corners(field()).tolist())
        self.assertGreater(worst(made, tree), 1.5 * STILL)
        before = state(field())
        choose_tool()
        yield from hand.show_tab("Neural Sculpt")
        yield from hand.drag(hand.to_window(self.arc()), pause=0.02)
        yield 3 * hand.DRAWN
        self.assertFalse(self.session.jobs)
        self.assertEqual(state(field()), before)
        operate(bpy.ops.neural_sculpt.absorb)
        yield from self.strokes_are(2)
        self.assertEqual(field().mode, "SCULPT")
        self.assertFalse(edited())
        self.assertLess(worst(vertices(field()), tree), STILL)
        self.assertIn("Absorb takes that into the field", reports())


def worst(points: np.ndarray, tree: BVHTree) -> float:
    """How far points (N, 3) are from a surface, of the worst hundredth the nearest."""
    return float(np.quantile([tree.find_nearest(point)[3] for point in points.tolist()], 0.99))
