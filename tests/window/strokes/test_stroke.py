# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes by hand: drawn, cancelled, undone, saved."""

from functools import partial

import bpy
import numpy as np
from drawing import (
    INTENSITY,
    RADIUS,
    SECONDS,
    WindowCase,
    choose_tool,
    corner,
    field,
    middle,
    operate,
    redo,
    undo,
)
from harness import brush_settings, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from mathutils import Matrix
from test_lines import LAYER, grease_pencil


class Strokes(WindowCase):
    def test_freehand(self) -> Steps:
        yield from self.add()
        path = self.arc()
        yield from self.draw(path)
        self.assert_raised(path)

    def test_button(self) -> Steps:
        """The button Draw Stroke, with any tool; a press beside the field is not for it."""
        yield from self.add()
        choose_tool("builtin.select_box")
        operate(bpy.ops.neural_sculpt.draw)
        yield from hand.drag([corner(), (corner()[0] + 5, corner()[1] + 5)])
        self.assertEqual(len(field().neural_sculpt.strokes), 0)
        path = self.arc()
        yield from self.draw(path)
        self.assert_raised(path)

    def test_escape(self) -> Steps:
        yield from self.add()
        before = state(field())
        points = hand.to_window(self.arc())
        hand.press(points[0])
        for point in points[1:]:
            hand.move(point)
        yield hand.DRAWN
        hand.tap("ESC", points[-1])
        yield hand.DRAWN
        hand.release(points[-1])
        yield hand.DRAWN
        yield from hand.drag([corner(), middle()])  # begins off the surface
        yield from self.idle()
        self.assertEqual(state(field()), before)

    def test_right_mouse_button(self) -> Steps:
        """Gives the stroke up as Esc does, drawn or clicked."""
        yield from self.add()
        before = state(field())
        points = hand.to_window(self.arc())
        for begin in (hand.press, partial(hand.tap, "P")):
            hand.move(points[0])
            begin(points[0])
            for point in points[1:]:
                hand.move(point)
            yield hand.DRAWN
            hand.tap("RIGHTMOUSE", points[-1])
            yield hand.DRAWN
            hand.release(points[-1])
            yield hand.DRAWN
            hand.tap("RET", points[-1])
            yield from self.idle()
            self.assertEqual(state(field()), before)

    def test_what_cannot_be_sculpted_is_not_moved(self) -> Steps:
        """A locked field, and an object that is none: the drag of the tool is not Blender's."""
        yield from self.add()
        path = hand.to_window(self.arc())
        field().shape_key_add(name="Basis")
        yield from hand.drag(path, pause=0.02)
        yield 3 * hand.DRAWN
        self.assertEqual(tuple(field().location), (0, 0, 0))
        bpy.data.objects.remove(field())
        bpy.ops.mesh.primitive_uv_sphere_add(radius=self.size)
        yield hand.DRAWN
        yield from hand.drag(path, pause=0.02)
        yield 3 * hand.DRAWN
        self.assertEqual(tuple(bpy.context.view_layer.objects.active.location), (0, 0, 0))
        self.assertFalse(self.session.jobs)

    def test_shift_smooths(self) -> Steps:
        """What was raised goes down under a stroke across it; once more is back at Ctrl Z."""
        yield from self.add()
        path = self.arc()
        yield from self.draw(path)
        raised = state(field())
        before = self.height_at(path[7])
        brush_settings().radius = 2 * RADIUS  # what is finer goes
        yield from hand.drag(hand.to_window(path), ("shift",))
        yield from self.strokes_are(2)
        self.assertEqual(field().neural_sculpt.strokes[1].name, "Smooth")
        self.assertLess(self.height_at(path[7]), before - 0.1 * INTENSITY)
        yield from undo()
        self.assertEqual(state(field()), raised)

    def height_at(self, place: np.ndarray) -> float:
        """Of the vertex that is nearest to a place, its distance to the middle."""
        points = vertices(field())
        return float(np.linalg.norm(points[np.linalg.norm(points - place, axis=1).argmin()]))

    def test_control_points(self) -> Steps:
        """Begun with P, clicked, one of them dragged, confirmed with Enter."""
        yield from self.add()
        path = self.arc()
        clicks = hand.to_window(path[::7])
        aside = hand.to_window(self.arc(0.4)[7:8])[0]
        yield from self.set_points((clicks[0], aside, clicks[2]))
        yield from hand.drag([aside, clicks[1]], pause=0.05)
        self.assertEqual(len(field().neural_sculpt.strokes), 0)
        hand.tap("RET", clicks[2])
        yield from self.strokes_are(1)
        self.assert_raised(path)

    def test_points_edited_again(self) -> Steps:
        """A stroke with a bend is sculpted; then its middle point is dragged away."""
        yield from self.add()
        path = self.arc()
        clicks = hand.to_window(path[::7])
        aside = hand.to_window(self.arc(0.4)[7:8])[0]
        yield from self.set_points((clicks[0], aside, clicks[2]))
        hand.tap("RET", clicks[2])
        yield from self.strokes_are(1)
        bent = state(field())
        uid = field().neural_sculpt.strokes[0].uid
        operate(bpy.ops.neural_sculpt.draw, uid=uid)
        yield hand.DRAWN
        yield from hand.drag([aside, clicks[1]], pause=0.05)
        self.assertEqual(state(field()), bent)
        hand.tap("RET", clicks[1])
        yield from hand.until(lambda: state(field()) != bent, SECONDS, "a replay")
        yield from self.idle()
        self.assertEqual([item.uid for item in field().neural_sculpt.strokes], [uid])
        self.assert_raised(path)
        yield from undo()
        self.assertEqual(state(field()), bent)

    def test_inverted(self) -> Steps:
        yield from self.add()
        path = self.arc()
        yield from self.draw(path, ("ctrl",))
        self.assert_raised(path, by=-INTENSITY)

    def test_symmetry(self) -> Steps:
        """The mirror flags of the mesh repeat a stroke on the other side."""
        yield from self.add()
        field().data.use_mirror_z = True
        path = self.arc(0.5)
        yield from self.draw(path)
        self.assert_raised(path, path * [1, 1, -1])

    def test_radial_symmetry_of_sculpt_mode(self) -> Steps:
        """Blender's own setting repeats a stroke around the axis that looks at the artist; the
        brush is shown at each place."""
        yield from self.add()
        bpy.ops.object.mode_set(mode="SCULPT")
        yield hand.DRAWN
        choose_tool()
        mesh = field().data
        newer = hasattr(mesh, "radial_symmetry")
        settings = mesh if newer else bpy.context.scene.tool_settings.sculpt
        settings.radial_symmetry = (1, 4, 1)
        path = self.arc(0.5, spread=0.3)
        yield from self.draw(path)
        x, y, z = path.T
        turned = ((x, y, z), (z, y, -x), (-x, y, -z), (-z, y, x))
        self.assert_raised(*(np.stack(each, axis=1) for each in turned))

    def test_sculpt_mode(self) -> Steps:
        yield from self.add()
        bpy.ops.object.mode_set(mode="SCULPT")
        yield hand.DRAWN
        choose_tool()
        path = self.arc()
        yield from self.draw(path)
        self.assertEqual(field().mode, "SCULPT")
        self.assert_raised(path)

    def test_grease_pencil(self) -> Steps:
        """A line of the selected grease pencil, a little above the surface, becomes a stroke."""
        yield from self.add()
        brush_settings().pressure_intensity = False  # the line is not everywhere as thick
        ob, path = field(), self.arc(0.5)
        above = 1.05 * path - np.array(LAYER.translation)
        grease_pencil(above.astype(np.float32), matrix=Matrix())
        hand.window().view_layer.objects.active = ob
        operate(bpy.ops.neural_sculpt.strokes_from_lines)
        yield from self.strokes_are(1)
        self.assert_raised(path)

    def test_history(self) -> Steps:
        """The first of two strokes is muted, then taken in again as a groove."""
        yield from self.add()
        paths = self.arc(-0.4), self.arc(0.4)
        for path in paths:
            yield from self.draw(path)
        uid = field().neural_sculpt.strokes[0].uid
        operate(bpy.ops.neural_sculpt.mute_stroke, uid=uid)
        yield from self.idle()
        self.assert_raised(paths[1])
        operate(bpy.ops.neural_sculpt.edit_stroke, "EXEC_DEFAULT", uid=uid, intensity=-INTENSITY)
        yield from self.idle()
        operate(bpy.ops.neural_sculpt.mute_stroke, uid=uid)
        yield from self.idle()
        self.assert_raised(*paths, by=(-INTENSITY, INTENSITY))

    def test_undo_and_redo(self) -> Steps:
        """Three strokes and a native move between them, one by one and back."""
        yield from self.add()
        states = [state(field())]
        for tilt in (0.0, 0.5):
            yield from self.draw(self.arc(tilt))
            states.append(state(field()))
        hand.tap("G", middle())
        for key, text in (("X", ""), ("ZERO", "0"), ("PERIOD", "."), ("THREE", "3"), ("RET", "")):
            yield hand.DRAWN
            hand.tap(key, middle(), text=text)
        yield from hand.until(lambda: field().location.x > 0.29, SECONDS, "a moved object")
        yield 2 * hand.DRAWN
        hand.window().view_layer.update()
        self.assertAlmostEqual(field().location.x, 0.3, places=5)
        states.append(state(field()))
        path = self.arc(-0.5)
        yield from self.draw(path + np.array([0.3, 0, 0]))
        states.append(state(field()))
        self.assert_raised(self.arc(), self.arc(0.5), path)
        for expected in states[-2::-1]:
            yield from undo()
            self.assertEqual(state(field()), expected)
        self.assert_untouched()
        for expected in states[1:]:
            yield from redo()
            self.assertEqual(state(field()), expected)

    def test_save_and_reload(self) -> Steps:
        yield from self.add()
        yield from self.draw(self.arc())
        before, path = state(field()), str(self.folder / "stroke.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        yield hand.DRAWN
        bpy.ops.wm.open_mainfile(filepath=path)
        yield hand.DRAWN
        self.assertEqual(state(field()), before)
        hand.look()
        second = self.arc(0.5)
        yield from self.draw(second)
        self.assert_raised(self.arc(), second)
        self.assertEqual(len(np.unique(vertices(field()), axis=0)), len(vertices(field())))
