# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh with an opening becomes a field by the dialog, and the panel says what became of it."""

import bpy
import numpy as np
from drawing import PICTURES, SECONDS, WindowCase, field, middle, operate, still_picture
from harness import long, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from test_notice import reports


class OpenMesh(WindowCase):
    @long
    def test_a_tube_that_is_filled_is_told(self) -> Steps:
        bpy.ops.mesh.primitive_cylinder_add(radius=0.5, depth=1.4, end_fill_type="NOTHING")
        yield from hand.show_tab("Neural Sculpt")
        operate(bpy.ops.neural_sculpt.from_mesh, "EXEC_DEFAULT", preset="DRAFT")
        yield from hand.until(lambda: len(bpy.data.objects) > 1, SECONDS, "a field")
        yield from self.idle()
        yield 0.5
        self.assertIn("Openings closed by a film: 2", reports())
        operate(bpy.ops.neural_sculpt.show_worst)
        panel = yield from still_picture("UI")
        hand.save_png(PICTURES / "from_mesh_panel.png", panel)

    @long
    def test_a_tube_gets_a_thickness_by_the_dialog(self) -> Steps:
        bpy.ops.mesh.primitive_cylinder_add(radius=0.5, depth=1.4, end_fill_type="NOTHING")
        source = bpy.context.active_object
        name, size = source.name, max(source.dimensions)
        hand.move(middle())
        yield 3 * hand.DRAWN
        operate(bpy.ops.neural_sculpt.from_mesh, preset="DRAFT", open_parts="THICKNESS")
        dialog = yield from still_picture()
        hand.save_png(PICTURES / "from_mesh_dialog.png", dialog)
        hand.tap("RET", middle())
        yield from hand.until(lambda: len(bpy.data.objects) > 1, SECONDS, "a field")
        yield from self.idle()
        self.assertEqual(field().name, f"{name} Field")
        inner = np.linalg.norm(vertices(field())[:, :2], axis=1) * field().matrix_world[0][0]
        self.assertAlmostEqual(inner.min(), 0.5 - 0.01 * size, delta=0.01)
