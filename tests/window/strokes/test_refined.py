# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes by hand that are finer than the resolution, on a field as it is added."""

import bpy
import harness
import numpy as np
from drawing import WindowCase, field
from geometry import to_path
from harness import brush_settings, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

RADIUS, INTENSITY = 0.02, -0.012
RESOLUTION = 128


class Refined(WindowCase):
    def test_thin_strokes_on_a_refined_proxy(self) -> Steps:
        """They are as deep as asked along all of their middle, in few triangles, one upon another,
        and each is one step of undo."""
        bpy.context.preferences.addons[harness.EXTENSION].preferences.resolution = RESOLUTION
        yield from self.add()
        count = len(field().data.polygons)
        states = [state(field())]
        brush = brush_settings()
        brush.radius, brush.intensity = RADIUS, INTENSITY
        level = self.arc(spread=0.3)
        across = level[:, [2, 1, 0]]
        for path in (level, across):
            yield from self.draw(path)
            states.append(state(field()))
            points = vertices(field())
            heights = np.linalg.norm(points, axis=1) - self.size
            middle = to_path(points * (self.size / (self.size + heights))[:, None], path[2:-2])
            reached = heights[middle < 0.1 * RADIUS] / INTENSITY
            self.assertGreater(len(reached), 20)
            self.assertGreater(reached.min(), 0.85)
        self.assertLess(len(field().data.polygons), 1.2 * count)
        yield from self.undo_and_redo(states)
        hand.look(distance=0.8)
        field().select_set(False)
        hand.view_area().spaces.active.overlay.show_wireframes = True
        yield 3 * hand.DRAWN
