# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Model by a click: its magnifying glass shows where the last stroke turned the normals
of the untouched surface most."""

import bpy
import numpy as np
from drawing import (
    PICTURES,
    RADIUS,
    SECONDS,
    WindowCase,
    changed,
    click,
    corner,
    field,
    still_picture,
    uncovered,
)
from geometry import to_path
from harness import module, state
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from mathutils import Quaternion, Vector

BACK = Quaternion((0.0, 0.0, 0.7071068, 0.7071068))
TOWARDS = Vector((0, 0, 1))  # the viewer, in the view's own axes


class Worst(WindowCase):
    def test_the_magnifying_glass(self) -> Steps:
        """From behind, where the stroke is not seen: the view turns to the place, which has a ring;
        the second click takes that away."""
        bpy.context.preferences.system.viewport_aa = "5"  # or some pictures have an outline
        yield from self.add()
        path = self.arc()
        yield from self.draw(path)
        yield from hand.until(lambda: field().neural_sculpt.report, SECONDS, "a report")
        yield from hand.show_tab("Neural Sculpt")
        reports, ring = module("blender.session.reports"), module("blender.viewport.worst_place")
        place = np.array(reports.worst_places(reports.report_of(field()))[0])
        self.assertGreater(to_path(place[None], path)[0], RADIUS)
        button = yield from self.button(ring, tuple(place))
        before = state(field())
        hand.look(BACK)
        yield from click(button)
        self.assertTrue(ring.is_shown(field()))
        hand.move(corner())
        shown = yield from still_picture()
        hand.save_png(PICTURES / "worst_place.png", shown)
        self.assertGreater((hand.view().region_3d.view_rotation @ TOWARDS).dot(Vector(place)), 0)
        (seen,) = hand.to_window([place])
        yield from click(button)
        self.assertFalse(ring.is_shown(field()))
        hand.move(corner())
        plain = yield from still_picture()
        left, bottom, right, top = changed(plain, shown, uncovered())
        self.assertAlmostEqual((left + right) / 2, seen[0], delta=4)
        self.assertAlmostEqual((bottom + top) / 2, seen[1], delta=4)
        self.assertEqual(state(field()), before)

    def button(self, ring: object, place: tuple[float, ...]) -> Steps:
        """Where the magnifying glass is: what changes in the panels when it is pressed."""
        pictures = []
        for _ in range(2):
            hand.move(corner())
            hand.region("UI").tag_redraw()
            pictures.append((yield from still_picture("UI")))
            ring.show(field(), [place])
        ring.hide()
        left, bottom, right, top = changed(*pictures, hand.region("UI"))
        return (left + right) / 2, (bottom + top) / 2
