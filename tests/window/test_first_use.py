# SPDX-License-Identifier: GPL-3.0-or-later
"""From a fresh Blender to a sculpted Suzanne, as the README tells it: seven presses of a button or
a key, which are counted, the stroke's own among them.

1. Press Delete: the cube, which is selected, is gone.
2. Click Add in the header of the viewport,
3. then Neural Field,
4. then Suzanne.
5. Click the last tool of the toolbar, Neural Stroke.
6. Press the numeric keypad's period, which is View, Frame Selected: she fills the view.
   Draw over her head with the left mouse button.
"""

from unittest.mock import patch

import bpy
import harness
import numpy as np
import simulated_input as hand
from drawing import (
    RESOLUTION,
    SECONDS,
    WindowCase,
    changed,
    choose_tool,
    field,
    middle,
    still_picture,
)
from harness import brush_settings, to_path, vertices
from mathutils.bvhtree import BVHTree
from simulated_input import Pixel, Steps

ADD = (284, 41)  # of the header's menu, from the upper left
ROW = 20  # pixels of a menu's entry
PRESSES = 8
"""As many at most, of the mouse's buttons and of keys, until the first stroke is done."""
FOREHEAD = np.array(  # model space
    [
        *((-0.137, -0.171, 0.517), (-0.054, -0.162, 0.536), (0.026, -0.148, 0.548)),
        *((0.104, -0.131, 0.553), (0.18, -0.112, 0.55), (0.252, -0.087, 0.539)),
        *((0.317, -0.054, 0.518), (0.376, -0.012, 0.487)),
    ]
)


class FirstUse(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        bpy.context.preferences.addons[harness.EXTENSION].preferences.resolution = RESOLUTION
        bpy.context.preferences.view.smooth_view = 0

    def count_presses(self) -> list[str]:
        """What is pressed from now on."""
        presses, event = [], hand.event

        def counted(kind: str, value: str, *given: object) -> None:
            if value == "PRESS":
                presses.append(kind)
            event(kind, value, *given)

        self.enterContext(patch.object(hand, "event", counted))
        return presses

    def test_first_use(self) -> Steps:
        tool = yield from self.tool_button()
        presses = self.count_presses()
        hand.tap("DEL", middle())
        yield from hand.until(lambda: "Cube" not in bpy.data.objects, SECONDS, "no cube")
        height = hand.screen_pixels().shape[0]
        left, bottom, right, _ = yield from self.opened((ADD[0], height - ADD[1]))
        entry = (left + right) / 2, bottom + 0.7 * ROW
        left, bottom, right, top = yield from self.opened(entry, beyond=right)
        suzanne = (left + right) / 2, top - (top - bottom) * 4.5 / 6  # the fifth of six entries
        yield from click(suzanne)
        yield from hand.until(any_field, SECONDS, "Suzanne")
        yield from self.idle()
        self.assertEqual(field().name, "Suzanne")
        yield from click(tool)
        hand.move(middle())
        away = hand.view().region_3d.view_distance
        hand.tap("NUMPAD_PERIOD", middle())
        yield from hand.until(
            lambda: hand.view().region_3d.view_distance != away, SECONDS, "Suzanne in a frame"
        )
        yield from still_picture()
        before, triangles = vertices(field()), corners(field())
        yield from self.draw(FOREHEAD)
        self.assertLessEqual(len(presses), PRESSES, presses)
        clicks = [kind for kind in presses if kind == "LEFTMOUSE"]
        self.assertEqual(len(clicks), 5, "four clicks and the stroke")
        tree = BVHTree.FromPolygons(before.tolist(), triangles.tolist())
        self.check(tree)

    def check(self, tree: BVHTree) -> None:
        """The surface is higher along the stroke, and nowhere else."""
        brush = brush_settings()
        found = [tree.find_nearest(p) for p in vertices(field()).tolist()]
        nearest = np.array([place for place, _, _, _ in found])
        moved = np.array([distance for _, _, _, distance in found])
        away = to_path(nearest, FOREHEAD)
        inner = to_path(nearest, FOREHEAD[1:-1]) < 0.35 * brush.radius
        self.assertGreater(inner.sum(), 5)
        self.assertAlmostEqual(moved[inner].max() / brush.intensity, 1.0, delta=0.2)
        self.assertLess(moved[away > 1.5 * brush.radius].max(), 0.01)

    def tool_button(self) -> Steps:
        """Where the toolbar has our tool: what changes in the picture when it is chosen."""
        yield 3 * hand.DRAWN
        pictures = []
        for name in ("builtin.cursor", "neural_sculpt.tool"):
            choose_tool(name)
            pictures.append((yield from still_picture()))
        choose_tool("builtin.select_box")
        left, bottom, right, _ = changed(*pictures, hand.region("TOOLS"))
        return (left + right) / 2, bottom + ROW / 2

    def opened(self, place: Pixel, beyond: int = 0) -> Steps:
        """Click where a menu opens: its left, bottom, right, top, to the right of `beyond`."""
        before = yield from still_picture()
        yield from click(place)
        after = yield from still_picture()
        return changed(before[:, beyond:], after[:, beyond:], hand.region(), beyond)


def any_field() -> bool:
    """Whether there is a field."""
    return any(ob.neural_sculpt.revision for ob in bpy.data.objects)


def corners(ob: bpy.types.Object) -> np.ndarray:
    """Triangles (F, 3) of a proxy."""
    flat = np.empty(len(ob.data.loops), np.int32)
    ob.data.loops.foreach_get("vertex_index", flat)
    return flat.reshape(-1, 3)


def click(place: Pixel) -> Steps:
    """Click with the left button."""
    hand.move(place)
    yield hand.DRAWN
    hand.tap("LEFTMOUSE", place)
    yield 2 * hand.DRAWN
