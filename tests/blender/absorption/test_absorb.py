# SPDX-License-Identifier: GPL-3.0-or-later
"""Native edits of a proxy are noticed, and absorbed into the field as one undo step."""

import bpy
import numpy as np
from bpy.types import Object
from harness import (
    SculptCase,
    add,
    arc,
    collection,
    field,
    in_world,
    long,
    module,
    push_undo,
    state,
    stroke,
    undo,
    vertices,
)


def pull(ob: Object) -> np.ndarray:
    """Move the top of the proxy up, as a brush of Blender does; the new vertices (V, 3)."""
    points = vertices(ob)
    away = np.linalg.norm(points - points[points[:, 2].argmax()], axis=1) / 0.3
    points[:, 2] += 0.1 * np.clip(1 - away**2, 0, None) ** 2
    ob.data.vertices.foreach_set("co", points.ravel())
    ob.data.update()
    push_undo("Native Brush")
    return points


def straight_line() -> Object:
    """A curve before the front of the sphere, selected beside it."""
    curve = bpy.data.curves.new("Line", "CURVE")
    curve.splines.new("POLY").points.add(1)
    curve.splines[0].points.foreach_set("co", [0, -0.6, 0, 1, 0.1, -0.6, 0, 1])
    line = bpy.data.objects.new("Line", curve)
    bpy.context.collection.objects.link(line)
    line.select_set(True)
    return line


class Absorb(SculptCase):
    def test_a_native_edit_is_noticed_and_absorbed(self) -> None:
        edited = module("blender.scene.mesh.native_edits").edited
        ob = add("SPHERE")
        name = ob.name
        self.assertFalse(edited(ob))
        with self.assertRaisesRegex(RuntimeError, "as the field made it"):
            bpy.ops.neural_sculpt.absorb()
        stroke(arc(ob, tilt=2.0), radius=0.1, intensity=0.03)
        self.assertFalse(edited(ob))
        sculpted = pull(ob)
        self.assertTrue(edited(ob))
        drawn = state(ob)
        self.assertEqual(bpy.ops.neural_sculpt.absorb(), {"FINISHED"})
        self.assertFalse(edited(ob))
        second = ob.neural_sculpt.strokes[1]
        self.assertEqual(state(ob)[2][0], drawn[2][0], "the stroke is as it was")
        self.assertEqual((second.name, second.data), ("Sculpted", ""))
        self.assertNotEqual(second.layer, b"")
        self.assertAlmostEqual(vertices(ob)[:, 2].max(), sculpted[:, 2].max(), delta=0.01)
        bpy.ops.neural_sculpt.mute_stroke(uid=second.uid)
        self.assertLess(vertices(ob)[:, 2].max(), sculpted[:, 2].max() - 0.05)
        undo()
        undo()
        ob = field(name)
        self.assertEqual(state(ob), drawn)
        self.assertTrue(edited(ob))
        np.testing.assert_array_equal(vertices(ob), sculpted)
        undo()
        self.assertFalse(edited(field(name)))

    @long
    def test_another_mesh_on_the_object_is_a_native_edit(self) -> None:
        edited = module("blender.scene.mesh.native_edits").edited
        ob = add("SPHERE")
        line = arc(ob)
        bpy.ops.mesh.primitive_cube_add(size=0.8)
        cube = bpy.context.active_object
        bpy.context.view_layer.objects.active, ob.data = ob, cube.data
        push_undo("Other Mesh")
        self.assertTrue(edited(ob))
        self.assert_fails("Absorb takes that into the field", stroke, points=line)
        self.assertIs(ob.data, cube.data)
        self.assertEqual(bpy.ops.neural_sculpt.absorb(), {"FINISHED"})
        self.assertFalse(edited(ob))
        self.assertEqual(len(cube.data.vertices), 8, "the cube has its mesh still")
        far = np.abs(vertices(ob)).max()
        self.assertAlmostEqual(far, 0.4, delta=0.02, msg="the field is the cube")

    def test_nothing_else_loses_a_native_edit(self) -> None:
        """Strokes and replays are refused; Remesh Proxy drops it."""
        ob = add("SPHERE")
        proxy = vertices(ob)
        stroke(arc(ob, tilt=2.0), radius=0.1, intensity=0.03)
        ops, (listed,) = bpy.ops.neural_sculpt, ob.neural_sculpt.strokes
        ops.mute_stroke(uid=listed.uid)
        line = straight_line()
        sculpted, before = pull(ob), state(ob)
        uid = ob.neural_sculpt.strokes[0].uid
        for operator, given in (
            (ops.stroke, {"points": collection(arc(ob))}),
            (ops.strokes_from_lines, {}),
            (ops.mute_stroke, {"uid": uid}),
        ):
            self.assert_fails("Absorb takes that into the field", operator, **given)
            self.assertEqual(state(ob), before)
        bpy.data.objects.remove(line)
        ops.delete_stroke(uid=uid)
        self.assertEqual(len(ob.neural_sculpt.strokes), 0)
        np.testing.assert_array_equal(vertices(ob), sculpted)
        ops.remesh(resolution=ob.neural_sculpt.resolution)
        self.assertFalse(module("blender.scene.mesh.native_edits").edited(ob))
        np.testing.assert_allclose(vertices(ob), proxy, atol=1e-5)

    def test_an_applied_scale_and_a_moved_origin_are_to_be_undone(self) -> None:
        """A new proxy has neither: the sphere has half of its size again, or lies elsewhere."""
        ops = bpy.ops.object
        for how in (
            lambda: ops.transform_apply(location=False, rotation=False, scale=True),
            lambda: ops.origin_set(type="ORIGIN_CURSOR"),
        ):
            ob = add("SPHERE")
            ob.location, ob.scale = (0, 0, 3), (2, 2, 2)
            bpy.context.view_layer.update()
            push_undo("Moved and scaled")
            seen = in_world(ob)
            how()
            push_undo("As it was asked for")
            bpy.context.view_layer.update()
            np.testing.assert_allclose(in_world(ob), seen, atol=1e-5)
            line = collection(arc(ob))
            self.assert_fails(
                "Apply or Set Origin, undo that", bpy.ops.neural_sculpt.stroke, points=line
            )
            undo()
            ob = bpy.context.active_object
            self.assertFalse(module("blender.scene.mesh.native_edits").edited(ob))
            np.testing.assert_array_equal(in_world(ob), seen)
            how()
            bpy.ops.neural_sculpt.remesh(resolution=ob.neural_sculpt.resolution)
            self.assertGreater(np.abs(in_world(ob) - seen).max(), 0.5)

    @long
    def test_other_topology_in_sculpt_mode(self) -> None:
        ob = add("TORUS")
        modifier = ob.modifiers.new("Subdivision", "SUBSURF")
        bpy.ops.object.modifier_apply(modifier=modifier.name)
        bpy.ops.object.mode_set(mode="SCULPT")
        self.assertEqual(bpy.ops.neural_sculpt.absorb(), {"FINISHED"})
        self.assertEqual(ob.mode, "SCULPT")
        self.assertFalse(module("blender.scene.mesh.native_edits").edited(ob))

    def test_dyntopo(self) -> None:
        """It owns the mesh: nothing else writes to it, and Absorb turns it off."""
        ob = add("SPHERE")
        bpy.ops.object.mode_set(mode="SCULPT")
        bpy.ops.sculpt.dynamic_topology_toggle()
        self.assert_fails("Dyntopo", bpy.ops.neural_sculpt.stroke, points=collection(arc(ob)))
        self.assertTrue(bpy.ops.neural_sculpt.absorb.poll())
        self.assert_fails("nothing to absorb", bpy.ops.neural_sculpt.absorb)
        self.assertFalse(ob.use_dynamic_topology_sculpting)
        self.assertEqual(ob.mode, "SCULPT")

    def test_dyntopo_while_a_stroke_waits(self) -> None:
        ob = add("SPHERE")
        before = state(ob)
        with self.as_in_a_window():
            stroke(arc(ob))
            bpy.ops.object.mode_set(mode="SCULPT")
            bpy.ops.sculpt.dynamic_topology_toggle()
            self.pump(lambda: "Dyntopo" in self.session.jobs[0].message)
            self.assertEqual(state(field(ob.name))[:5], before[:5])
            bpy.ops.sculpt.dynamic_topology_toggle()
            self.finish()
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertEqual(len(field(ob.name).neural_sculpt.strokes), 1)

    def test_a_proxy_that_left_the_box_stays_as_it_is(self) -> None:
        ob = add("SPHERE")
        points = 3 * vertices(ob)
        ob.data.vertices.foreach_set("co", points.ravel())
        self.assert_fails("leaves the box", bpy.ops.neural_sculpt.absorb)
        np.testing.assert_array_equal(vertices(ob), points)
