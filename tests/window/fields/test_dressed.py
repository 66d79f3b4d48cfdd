# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh with two materials, a UV map, a vertex group and a parent becomes a field by the dialog; a
neural stroke, a stroke of Blender's own brush and undo leave it all on it."""

import bpy
import numpy as np
from drawing import (
    PICTURES,
    SECONDS,
    WindowCase,
    choose_tool,
    enter_sculpt_mode,
    field,
    middle,
    operate,
    still_picture,
    undo,
)
from harness import long, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

SIZE = 0.7
EDGE = 0.1  # longer than any edge, of a sphere of radius 1
COLORS = {"Clay": (0.1, 0.3, 0.8, 1.0), "Iron": (0.8, 0.25, 0.1, 1.0)}


class Dressed(WindowCase):
    absorbs_live = True

    @long
    def test_all_stays_on_it(self) -> Steps:
        dress()
        hand.view_area().spaces.active.shading.color_type = "MATERIAL"
        yield from hand.show_tab("Neural Sculpt")
        hand.move(middle())
        yield 3 * hand.DRAWN
        operate(bpy.ops.neural_sculpt.from_mesh, preset="DRAFT")
        hand.save_png(PICTURES / "dressed_dialog.png", (yield from still_picture()))
        hand.tap("RET", middle())
        yield from hand.until(lambda: len(bpy.data.objects) > 2, SECONDS, "a field")
        yield from self.idle()
        self.size = SIZE
        self.check(0)
        choose_tool()
        yield from self.draw(self.arc(0.2))
        self.check(1)
        yield from enter_sculpt_mode()
        yield from self.native(-0.4)
        yield from self.strokes_are(2)
        self.check(2)
        hand.save_png(PICTURES / "dressed.png", (yield from still_picture()))
        for count in (1, 0):
            yield from undo()
            while len(field().neural_sculpt.strokes) != count:  # modes and tools are steps, too
                yield from undo()
            self.check(count)
        hand.save_png(PICTURES / "dressed_undone.png", (yield from still_picture()))

    def check(self, strokes: int) -> None:
        """Materials, map and weights tell where on the sphere a place was."""
        ob, mesh = field(), field().data
        self.assertEqual(len(ob.neural_sculpt.strokes), strokes)
        self.assertEqual(ob.parent.name, "Parent")
        np.testing.assert_allclose(ob.matrix_world.translation, (0, 0, 0), atol=1e-5)
        points = vertices(ob)
        there = points / np.linalg.norm(points, axis=1, keepdims=True)
        self.assertEqual([material.name for material in mesh.materials], [*COLORS])
        corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        index = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", index)
        height = there[corners].reshape(-1, 3, 3).mean(axis=1)[:, 2]
        self.assertTrue((index[height > EDGE] == 1).all() and (index[height < -EDGE] == 0).all())
        uvs = np.empty(2 * len(corners), np.float32)
        mesh.uv_layers["Front"].data.foreach_get("uv", uvs)
        self.assertLess(np.abs(uvs.reshape(-1, 2) - there[corners][:, [0, 2]]).max(), EDGE / 2)
        group = ob.vertex_groups["High"]
        weights = [group.weight(i) for i in range(0, len(points), 20)]
        self.assertLess(np.abs(np.array(weights) - (1 + there[::20, 2]) / 2).max(), EDGE / 2)


def dress() -> None:
    """A sphere whose upper half is iron, mapped from the front, with weights that rise, a parent,
    and a shape key, which no field can have."""
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=SIZE)
    source = bpy.context.active_object
    mesh, points = source.data, vertices(source) / SIZE
    for name, color in COLORS.items():
        material = bpy.data.materials.new(name)
        material.diffuse_color = color
        mesh.materials.append(material)
    for face in mesh.polygons:
        face.material_index = int(face.center.z > 0)
    mesh.uv_layers.active.name = "Front"
    corners = [loop.vertex_index for loop in mesh.loops]
    uvs = points[corners][:, [0, 2]].astype(np.float32)
    mesh.uv_layers["Front"].data.foreach_set("uv", uvs.ravel())
    group = source.vertex_groups.new(name="High")
    for i, z in enumerate(points[:, 2].tolist()):
        group.add([i], (1 + z) / 2, "REPLACE")
    source.parent = parent
    source.shape_key_add(name="Basis")
