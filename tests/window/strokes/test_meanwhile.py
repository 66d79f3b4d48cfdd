# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does by keys and mouse while a stroke waits, and Blender's history afterwards.

The worker is stopped meanwhile, so that the stroke waits for as long as the test wants.
"""

from itertools import pairwise
from typing import NamedTuple

import bmesh
import bpy
import numpy as np
from drawing import (
    RADIUS,
    SECONDS,
    WindowCase,
    changed,
    choose_native_brush,
    choose_tool,
    corner,
    edited,
    enter_sculpt_mode,
    field,
    middle,
    moved_since,
    operate,
    redo,
    still_picture,
    undo,
)
from harness import brush_settings, long, module, state, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

BUTTON = 20  # pixels of a button without words
SCALE = 0.6  # of the interface, so that all panels are in sight


def move_aside() -> Steps:
    """Move what Blender holds by the mouse to the right, and confirm."""
    x, y = middle()
    for step in range(10, 101, 10):
        hand.move((x + step, y))
        yield hand.DRAWN
    hand.tap("RET", (x + 100, y))


class Seen(NamedTuple):
    """What an artist in Sculpt Mode has before the eyes."""

    field: tuple[object, ...]
    mesh: np.ndarray  # (V, 3)
    edited: bool  # by other brushes
    panels: np.ndarray  # a picture


class Meanwhile(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        view = bpy.context.preferences.view
        self.addCleanup(setattr, view, "ui_scale", view.ui_scale)
        view.ui_scale = SCALE

    def draw_and_wait(self, tilt: float = 0.0) -> Steps:
        """Draw a stroke that the worker does not hear of yet."""
        self.stop_worker()
        yield from hand.drag(hand.to_window(self.arc(tilt)))
        yield from hand.until(lambda: any(j.strokes for j in self.session.jobs), SECONDS, "a job")
        yield 3 * hand.DRAWN

    def listed(self) -> list[bool]:
        """Of each stroke in the list, whether it is muted."""
        return [item.muted for item in field().neural_sculpt.strokes]

    def has_preview(self) -> bool:
        return module("blender.scene.mesh.preview_attributes").is_previewed(field().data)

    @long
    def test_edit_stroke_escaped_and_undone(self) -> Steps:
        """Opened by its button, left by Esc: no undo or redo ever meets what a dialog has made."""
        yield from self.add()
        states = [state(field())]
        for tilt in (0.5, -0.5):
            yield from self.draw(self.arc(tilt))
            states.append(state(field()))
        yield from hand.show_tab("Neural Sculpt")
        button = yield from self.edit_button()
        for _ in range(2):
            before = yield from still_picture()
            hand.move(button)
            yield hand.DRAWN
            hand.tap("LEFTMOUSE", button)
            after = yield from still_picture()
            changed(before, after, hand.region())
            hand.tap("ESC", button)
            yield 3 * hand.DRAWN
            yield from self.undo_and_redo(states)

    def edit_button(self) -> Steps:
        """Where Edit Stroke is in the first row of the list: two buttons to the left of the one
        whose picture says whether the stroke is muted."""
        item, pictures = field().neural_sculpt.strokes[0], []
        for item.muted in (True, False):
            hand.region("UI").tag_redraw()
            pictures.append((yield from still_picture("UI")))
        _, bottom, right, top = changed(*pictures, hand.region("UI"))
        return right - 2.5 * BUTTON * SCALE, (bottom + top) / 2

    def test_undo_leaves_the_brush(self) -> Steps:
        """The wheel over the radius, F on the surface, a choice and a curve are no undo steps."""
        yield from self.add()
        before = state(field())
        yield from self.draw(self.arc(0.5))
        after = state(field())
        brush = brush_settings()
        brush.profile = "CURVE"
        module("blender.presets.curve_store").set_curve("profile", ((-1, 0), (0, 0.5), (1, 0)))
        hand.move(middle())
        hand.tap("F", middle())
        yield 3 * hand.DRAWN
        x, y = middle()
        hand.move((x + 40, y))
        yield hand.DRAWN
        hand.tap("LEFTMOUSE", (x + 40, y))
        yield 3 * hand.DRAWN
        self.assertGreater(brush.radius, 1.05 * RADIUS)
        set_by_hand = module("blender.scene.brush.current_brush").current_brush(bpy.context)
        for step, expected in ((undo, before), (redo, after), (undo, before)):
            yield from step()
            self.assertEqual(state(field()), expected)
            now = module("blender.scene.brush.current_brush").current_brush(bpy.context)
            self.assertEqual(now, set_by_hand)

    def test_edit_mode(self) -> Steps:
        """Tab while a stroke waits: no preview there, and the stroke comes after the next Tab."""
        yield from self.add()
        before = vertices(field())
        yield from self.draw_and_wait()
        self.assertTrue(self.has_preview())
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "EDIT", SECONDS, "Edit Mode")
        yield 3 * hand.DRAWN
        edited = bmesh.from_edit_mesh(field().data)
        np.testing.assert_array_equal([vertex.co[:] for vertex in edited.verts], before)
        self.go_on()
        job = self.session.jobs[0]
        yield from hand.until(lambda: "this mode" in job.message, SECONDS, "a result that waits")
        self.assertEqual(self.listed(), [])
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "OBJECT", SECONDS, "Object Mode")
        yield from self.strokes_are(1)
        self.assertEqual(self.listed(), [False])
        self.assert_raised(self.arc())

    def test_moved_in_edit_mode(self) -> Steps:
        """What is moved there stays, is a native edit, and the stroke is kept, muted."""
        yield from self.add()
        before = vertices(field())
        yield from self.draw_and_wait()
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "EDIT", SECONDS, "Edit Mode")
        yield 3 * hand.DRAWN
        hand.tap("A", middle())
        yield hand.DRAWN
        hand.tap("G", middle())
        yield 3 * hand.DRAWN
        yield from move_aside()
        yield 3 * hand.DRAWN
        there = bmesh.from_edit_mesh(field().data).verts  # without the preview, as it is there
        moved = np.array([vertex.co[:] for vertex in there], np.float32)
        hand.tap("TAB", middle())
        yield from hand.until(lambda: field().mode == "OBJECT", SECONDS, "Object Mode")
        self.assertTrue(edited())
        self.go_on()
        yield from hand.until(lambda: bool(self.session.last_error), SECONDS, "a message")
        self.assertIn("in the history, muted", self.session.last_error)
        self.assertEqual(self.listed(), [True])
        np.testing.assert_array_equal(vertices(field()), moved)
        shift = moved - before
        np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-5)
        self.assertGreater(shift[0, 0], 0.05)
        self.session.last_error = ""

    @long
    def test_linked_duplicate_while_a_stroke_waits(self) -> Steps:
        """The result is the first field's alone; undo and redo find both whole."""
        yield from self.add()
        before = vertices(field())
        yield from self.draw_and_wait()
        yield from self.duplicate_linked()
        self.go_on()
        yield from self.strokes_are(1)
        self.assert_raised(self.arc())
        after = vertices(field())
        for _ in range(2):
            yield from undo()
            self.assertEqual([ob.data for ob in bpy.data.objects], 2 * [field().data])
            np.testing.assert_array_equal(vertices(field()), before)
            yield from undo()
            self.assertEqual([*bpy.data.objects], [field()])
            np.testing.assert_array_equal(vertices(field()), before)
            yield from redo()
            yield from redo()
            first, second = bpy.data.objects
            np.testing.assert_array_equal(vertices(first), after)
            np.testing.assert_array_equal(vertices(second), before)
            self.assertEqual(len(second.neural_sculpt.strokes), 0)

    @long
    def test_linked_duplicate_while_a_stroke_is_measured(self) -> Steps:
        """Whatever comes late changes the mesh of neither."""
        yield from self.add()
        yield from hand.drag(hand.to_window(self.arc()))
        yield from hand.until(lambda: len(self.listed()) == 1, SECONDS, "a stroke")
        self.stop_worker()
        made = vertices(field())
        yield from self.duplicate_linked()
        self.go_on()
        yield from self.idle()
        for _ in range(2):
            yield from undo()
            self.assertEqual([*bpy.data.objects], [field()])
            np.testing.assert_array_equal(vertices(field()), made)
            yield from redo()
            self.assertEqual([ob.data for ob in bpy.data.objects], 2 * [field().data])
            np.testing.assert_array_equal(vertices(field()), made)

    def duplicate_linked(self) -> Steps:
        """Type Alt D, move the duplicate aside, and confirm."""
        hand.tap("D", middle(), ("alt",))
        yield 3 * hand.DRAWN
        yield from move_aside()
        yield from hand.until(lambda: len(bpy.data.objects) == 2, SECONDS, "a duplicate")
        yield 3 * hand.DRAWN

    def test_native_brush_while_a_stroke_waits(self) -> Steps:
        """The native stroke stays, and ours is muted in the list."""
        yield from self.add()
        yield from self.draw(self.arc(0.6))
        yield from enter_sculpt_mode()
        choose_tool()
        yield hand.DRAWN
        made = vertices(field())
        yield from self.draw_and_wait()
        self.assertTrue(self.has_preview())
        choose_native_brush()
        yield from hand.until(lambda: not self.has_preview(), SECONDS, "no preview")
        np.testing.assert_array_equal(vertices(field()), made)
        yield from self.native(-0.5)
        self.assertTrue(edited())
        sculpted = vertices(field())
        self.go_on()
        yield from hand.until(lambda: bool(self.session.last_error), SECONDS, "a message")
        self.assertIn("Absorb takes that into the field", self.session.last_error)
        self.assertEqual(self.listed(), [False, True])
        np.testing.assert_array_equal(vertices(field()), sculpted)
        self.session.last_error = ""

    @long
    def test_native_brush_while_an_absorb_waits(self) -> Steps:
        """Both native strokes stay, and the field takes neither."""
        yield from self.add()
        revision = field().neural_sculpt.revision
        yield from enter_sculpt_mode()
        yield from self.native(-0.5)
        self.stop_worker()
        operate(bpy.ops.neural_sculpt.absorb)
        yield from self.native(0.5)
        sculpted = vertices(field())
        self.go_on()
        yield from hand.until(lambda: bool(self.session.last_error), SECONDS, "a message")
        self.assertIn("sculpted by other brushes meanwhile", self.session.last_error)
        np.testing.assert_array_equal(vertices(field()), sculpted)
        self.assertEqual(self.listed(), [])
        self.assertEqual(field().neural_sculpt.revision, revision)
        self.assertTrue(edited())
        self.session.last_error = ""

    @long
    def test_sculpt_mode_is_stepped_through(self) -> Steps:
        """Native strokes, neural ones and Absorb: by Ctrl Z and Shift Ctrl Z mesh, list and panels
        become what they were. Between a native stroke and ours one of them does nothing."""
        yield from self.add()
        yield from hand.show_tab("Neural Sculpt")
        yield from enter_sculpt_mode()
        states = [(yield from self.seen())]
        acts = self.neural(0.6), self.native(-0.6), self.native(-0.9), self.absorbed()
        for act in (*acts, self.neural(0.9), self.native(0.6)):  # off the middle: the size stays
            yield from act
            states.append((yield from self.seen()))
        for step, expected in ((undo, states[::-1]), (redo, states)):
            for before, after in pairwise(expected):
                yield from step()
                if not moved_since(before.mesh):
                    yield from step()
                now = yield from self.seen()
                self.assertEqual(now.field, after.field)
                self.assertEqual(now.edited, after.edited)
                np.testing.assert_allclose(now.mesh, after.mesh, rtol=0, atol=1e-6)
                np.testing.assert_array_equal(now.panels, after.panels)

    def seen(self) -> Steps:
        """All that must agree, when nothing is left to do."""
        yield from self.idle()
        hand.move(corner())
        place = hand.region("UI")
        picture = yield from still_picture("UI")
        panels = picture[::-1][place.y : place.y + place.height, place.x : place.x + place.width]
        return Seen(state(field())[:5], vertices(field()), edited(), panels)

    def neural(self, tilt: float) -> Steps:
        choose_tool()
        yield hand.DRAWN
        yield from self.draw(self.arc(tilt))

    def absorbed(self) -> Steps:
        operate(bpy.ops.neural_sculpt.absorb)
        yield from self.idle()
