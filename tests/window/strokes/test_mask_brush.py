# SPDX-License-Identifier: GPL-3.0-or-later
"""A mask painted with Blender's own brush, and a stroke drawn across it."""

import bpy
import numpy as np
from drawing import (
    INTENSITY,
    NEAR,
    RADIUS,
    SECONDS,
    STILL,
    WindowCase,
    choose_tool,
    enter_sculpt_mode,
    field,
    operate,
    redo,
    undo,
)
from geometry import to_path
from harness import module, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

SIZE = 110  # pixels
KEPT = 0.95  # masked all but in full


def choose_mask_brush() -> None:
    """Take one in hand; the test brings its own, as Debian packs 4.3 without any."""
    choose_tool("builtin.brush")
    brush = bpy.data.brushes.new("Masking", mode="SCULPT")
    kind = "sculpt_brush_type" if hasattr(brush, "sculpt_brush_type") else "sculpt_tool"
    setattr(brush, kind, "MASK")
    brush.strength, brush.size = 1.0, SIZE
    brush.asset_mark()
    given = {"asset_library_type": "LOCAL", "relative_asset_identifier": "Brush/Masking"}
    operate(bpy.ops.brush.asset_activate, "EXEC_DEFAULT", **given)
    settings = bpy.context.tool_settings
    unified = getattr(settings.sculpt, "unified_paint_settings", None)
    (unified or settings.unified_paint_settings).size = SIZE


def masks() -> np.ndarray:
    """(V,)"""
    painted = module("blender.scene.mesh.brush_attributes").read(field().data)
    return painted.get(".sculpt_mask", np.zeros(len(vertices(field()))))


class Masks(WindowCase):
    def test_a_stroke_across_a_painted_mask(self) -> Steps:
        """It is there on both sides of the masked band, and not in it; so is the mask, and undo
        and redo bring back both."""
        yield from self.add()
        yield from enter_sculpt_mode()
        choose_mask_brush()
        yield 3 * hand.DRAWN
        meridian = [(0, -self.size * np.cos(t), self.size * np.sin(t)) for t in (-0.8, 0.8)]
        line = np.linspace(*hand.to_window(meridian), 12)
        for way in (line, line[::-1]):
            yield from hand.drag(map(tuple, way), pause=0.03)
            yield 3 * hand.DRAWN
        yield from hand.until(lambda: masks().max() > KEPT, SECONDS, "a mask")
        painted, before = masks(), vertices(field())
        choose_tool()
        yield 3 * hand.DRAWN
        path = self.arc(spread=0.7)
        yield from self.draw(path)
        self.assertEqual(len(field().neural_sculpt.strokes), 1)
        mask, heights, points = masks(), self.heights(), vertices(field())
        distance = to_path(points, path)
        self.assertLess(np.abs(heights[mask > KEPT]).max(), STILL)
        self.assertGreater((mask > KEPT).sum(), 0.8 * (painted > KEPT).sum())
        for side in (-1, 1):
            beside = (distance < RADIUS) & (points[:, 0] * side > 0.2) & (mask == 0)
            self.assertAlmostEqual(heights[beside].max() / INTENSITY, 1, delta=0.15)
        self.assertTrue((distance[mask > KEPT] < NEAR * RADIUS).any())
        yield from undo()
        np.testing.assert_array_equal(masks(), painted)
        np.testing.assert_array_equal(vertices(field()), before)
        yield from redo()
        np.testing.assert_array_equal(masks(), mask)
        np.testing.assert_array_equal(vertices(field()), points)
