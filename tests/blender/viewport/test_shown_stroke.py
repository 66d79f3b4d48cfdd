# SPDX-License-Identifier: GPL-3.0-or-later
"""The stroke that is shown while it is drawn is made anew when it or the surface changes."""

from dataclasses import replace

import bpy
import numpy as np
from harness import SculptCase, module

overlay = module("blender.viewport.overlay")
Stroke = module("stroke.stroke").Stroke
Brush = module("stroke.brush").Brush


class ShownStroke(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.addCleanup(overlay.hide_stroke)
        bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.6)
        self.ob = bpy.context.active_object
        for _ in range(2):  # some Blenders evaluate a new object twice
            bpy.context.view_layer.update()
            module("blender.scene.mesh.seen_surface").grid_of(self.ob)
        angle = np.linspace(-0.4, 0.4, 5)
        points = 0.6 * np.stack([np.sin(angle), -np.cos(angle), 0 * angle], 1)
        self.stroke = Stroke(points, Brush(0.1, 0.03))

    def shown(self, stroke: object, chosen: int | None = None) -> tuple[object, ...]:
        overlay.show_stroke(self.ob, stroke, editing=True, chosen=chosen)
        self.assertEqual(overlay.shown_stroke().chosen, chosen)
        return overlay.shown_stroke().ribbons

    def test_the_same_stroke_is_not_made_again(self) -> None:
        first = self.shown(self.stroke)
        self.assertIs(self.shown(replace(self.stroke), chosen=2), first)

    def test_another_one_is(self) -> None:
        first = self.shown(self.stroke)
        longer = np.vstack([self.stroke.points, [(0.4, -0.44, 0.0)]])
        changes = ({"points": longer}, {"brush": Brush(0.1, -0.03)}, {"mirror": frozenset("Z")})
        for change in changes:
            self.assertIsNot(self.shown(replace(self.stroke, **change)), first)

    def test_it_follows_the_surface(self) -> None:
        reach = np.linalg.norm(self.shown(self.stroke)[0].points, axis=-1).max()
        for vertex in self.ob.data.vertices:
            vertex.co *= 1.05
        self.ob.data.update()
        bpy.context.view_layer.update()
        grown = np.linalg.norm(self.shown(self.stroke)[0].points, axis=-1).max()
        self.assertAlmostEqual(grown / reach, 1.05, delta=0.01)
