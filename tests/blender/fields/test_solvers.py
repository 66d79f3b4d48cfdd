# SPDX-License-Identifier: GPL-3.0-or-later
"""What strokes change, detail or the network, and the way from one to the other."""

import json
from contextlib import suppress

import bpy
import numpy as np
from harness import (
    SculptCase,
    add,
    arc,
    brush_settings,
    collection,
    field,
    long,
    module,
    state,
    stroke,
    undo,
    vertices,
)

ops = bpy.ops.neural_sculpt
RADIUS, INTENSITY = 0.2, 0.05


class Solvers(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")
        self.size = np.linalg.norm(vertices(self.ob), axis=1).mean()

    def stroke(self, tilt: float = 0.0) -> None:
        stroke(arc(self.ob, tilt=tilt), radius=RADIUS, intensity=INTENSITY)

    def top(self) -> float:
        """Height above the sphere, in intensities."""
        return (np.linalg.norm(vertices(field("Sphere")), axis=1).max() - self.size) / INTENSITY

    @long
    def test_from_detail_to_a_network(self) -> None:
        self.stroke()
        self.assertFalse(ops.choose_solver.poll())
        ops.apply_to_base()
        self.assert_fails("Consolidate it first", ops.choose_solver, solver="NETWORK")
        before = state(self.ob)
        ops.consolidate(width=128)
        group = self.ob.neural_sculpt
        self.assertGreater(json.loads(group.report)["distance_mean"], 0)
        header = module("blender.scene.field_header").header_of(self.ob)
        self.assertEqual((header.widths, header.detail), ((128, 128), 0))
        self.assertAlmostEqual(self.top(), 1.0, delta=0.2)
        self.assertEqual(ops.export(filepath=str(self.folder / "a.pth")), {"FINISHED"})
        ops.choose_solver(solver="NETWORK")
        undo()
        undo()
        self.assertEqual(state(field("Sphere")), before)

    def test_not_while_a_stroke_is_on_its_way(self) -> None:
        """It would be detail of a network."""
        with self.as_in_a_window():
            self.stroke()
            with suppress(RuntimeError):
                ops.choose_solver(solver="NETWORK")
            self.finish()
            self.stroke(1.0)
            self.finish()
        group = field("Sphere").neural_sculpt
        self.assertEqual(group.solver, "LOCAL")
        self.assertEqual([bool(item.layer) for item in group.strokes], [True, True])

    @long
    def test_strokes_of_a_network(self) -> None:
        ops.choose_solver(solver="NETWORK")
        self.stroke()
        group = field("Sphere").neural_sculpt
        self.assertAlmostEqual(self.top(), 1.0, delta=0.2)
        self.assertEqual(group.strokes[0].layer, b"")
        self.assertGreater(len(group.weights), 0)
        self.assertFalse(ops.absorb.poll())
        drawn = group.weights
        brush_settings().kind = "SMOOTH"
        self.assert_fails("Detail", ops.stroke, points=collection(arc(self.ob, tilt=1.0)))
        self.assertEqual(group.weights, drawn)
        ops.mute_stroke()
        self.assertEqual(group.weights, b"")
        self.assertAlmostEqual(self.top(), 0.0, delta=0.1)
        ops.mute_stroke()
        self.assertEqual(group.weights, drawn)
        ops.apply_to_base()
        self.assertEqual((group.base_weights, group.weights), (drawn, b""))
