# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of Blender's own brushes are absorbed by themselves, each as one entry and one step."""

import os
import signal
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import bpy
import numpy as np
from bpy.types import Object
from harness import (
    EXTENSION,
    SculptCase,
    add,
    arc,
    field,
    long,
    module,
    push_undo,
    redo,
    state,
    stroke,
    undo,
    vertices,
)

ASSET = "brushes/essentials_brushes-mesh_sculpt.blend/Brush/"


def view() -> dict[str, object]:
    """The 3D viewport that a brush is used in."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    return {"window": window, "area": area, "region": region}


def brush(name: str, right: float = 0.0, apart: float = 8.0) -> None:
    """A short stroke with one of Blender's brushes over the front of the sphere, as by hand; its
    places are so many pixels `apart`."""
    context = view()
    x, y = context["region"].width / 2 + right, context["region"].height / 2
    known = bpy.types.OperatorStrokeElement.bl_rna.properties.keys()
    points = []
    for step in range(5):
        mouse = (x + apart * step, y)
        angle = right / 60 + 0.03 * step
        place = 0.6 * np.sin(angle), -0.6 * np.cos(angle), 0.0
        given = {
            **{"name": "", "location": place, "mouse": mouse, "mouse_event": mouse},
            **{"pressure": 1.0, "size": 40.0, "pen_flip": False, "x_tilt": 0, "y_tilt": 0},
            **{"time": float(step), "is_start": step == 0},
        }
        points.append({key: value for key, value in given.items() if key in known})
    with bpy.context.temp_override(**context):
        take(name)
        settings = bpy.context.tool_settings
        unified = getattr(settings.sculpt, "unified_paint_settings", None)
        (unified or settings.unified_paint_settings).size = 60
        bpy.ops.sculpt.brush_stroke("EXEC_DEFAULT", True, stroke=points)


def take(name: str) -> bool:
    """Take one of Blender's brushes, where it can be had: 4.3 reads them in a window alone."""
    taken = bpy.ops.brush.asset_activate(
        asset_library_type="ESSENTIALS", relative_asset_identifier=ASSET + name
    )
    return taken == {"FINISHED"}


class BrushCase(SculptCase):
    """A sphere field in Sculpt Mode, and what the timer does when a stroke has ended."""

    def setUp(self) -> None:
        super().setUp()
        if bpy.app.version < (4, 3):
            self.skipTest("this Blender's brushes are no assets")
        self.live = module("blender.session.absorption.live")
        self.results = module("blender.session.absorption.brush_results")
        self.addCleanup(self.live.forget)
        bpy.context.preferences.addons[EXTENSION].preferences.resolution = 96
        add("SPHERE").scale = (8, 8, 8)  # so that a brush covers a part of it
        bpy.context.view_layer.update()
        bpy.ops.object.mode_set(mode="SCULPT")
        with bpy.context.temp_override(**view()):
            if not take("Clay"):
                self.skipTest("this Blender has its brushes in a window alone")
        push_undo("Sculpt Mode")
        self.live.look()

    def ob(self) -> Object:
        return field("Sphere")

    def names(self) -> list[str]:
        return [item.name for item in self.ob().neural_sculpt.strokes]

    def look(self) -> None:
        """What the timer does when a stroke has ended."""
        self.live.look()

    def rest(self) -> None:
        """What the timer does when the artist rests."""
        go_on = module("blender.session.absorption.renewal").go_on
        self.pump(lambda: go_on() is None)
        module("blender.scene.kept_steps").settle()

    def assert_is(self, sculpted: np.ndarray) -> None:
        """The proxy is what was sculpted (V, 3), on the field."""
        off = np.linalg.norm(vertices(self.ob()) - sculpted, axis=1)
        self.assertLess(off.sum() / max(1, (off > 0).sum()), 3e-4)

    def edited(self) -> bool:
        return module("blender.scene.mesh.native_edits").edited(self.ob())


class Live(BrushCase):
    def test_a_stroke_is_an_entry_and_an_undo_step(self) -> None:
        states = [state(self.ob())]
        with self.as_in_a_window():
            for name, right in (("Clay", 0), ("Grab", -60), ("Smooth", 10)):
                before = vertices(self.ob())
                brush(name, right)
                sculpted = vertices(self.ob())
                self.assertTrue(self.edited())
                self.look()
                self.finish()
                self.assertFalse(self.edited())
                moved = (sculpted != before).any(axis=1)
                self.assert_is(sculpted)
                np.testing.assert_array_equal(vertices(self.ob())[~moved], before[~moved])
                states.append(state(self.ob()))
        self.assertEqual(self.names(), ["Clay", "Grab", "Smooth"])
        self.undo_and_redo(states, lambda: state(self.ob()))

    def test_strokes_in_quick_succession_are_absorbed_in_order(self) -> None:
        states = [state(self.ob())]
        with self.as_in_a_window():
            for name, right in (("Clay", -40), ("Grab", 40), ("Clay", 0)):
                brush(name, right)
                self.look()
            sculpted = vertices(self.ob())
            self.finish()
        self.assertEqual(self.names(), ["Clay", "Grab", "Clay"])
        self.assertFalse(self.edited())
        self.assert_is(sculpted)
        made = state(self.ob())
        for count in (2, 1, 0):
            undo()
            self.assertEqual(len(self.names()), count)
            self.assertFalse(self.edited())
        self.assertEqual(state(self.ob()), states[0])
        for _ in range(3):
            redo()
        self.assertEqual(state(self.ob()), made)

    def test_a_mask_changes_nothing_and_stays(self) -> None:
        with self.as_in_a_window():
            brush("Clay", -60)
            self.look()
            brush("Mask", 60)
            self.look()
            mask = self.mask()
            self.assertGreater(mask.max(), 0)
            self.finish()
            self.assertEqual(self.names(), ["Clay"])
            np.testing.assert_array_equal(self.mask(), mask)
            brush("Grab", 0)
            self.look()
            self.finish()
        self.assertEqual(self.names(), ["Clay", "Grab"])
        np.testing.assert_array_equal(self.mask(), mask)

    def mask(self) -> np.ndarray:
        attribute = self.ob().data.attributes[".sculpt_mask"]
        values = np.empty(len(attribute.data), np.float32)
        attribute.data.foreach_get("value", values)
        return values

    def test_undo_while_a_stroke_is_on_its_way(self) -> None:
        """It takes back the stroke. What is there then waits for the next one, where to take
        it in would cut off what can be redone."""
        before = state(self.ob())
        with self.as_in_a_window():
            brush("Clay", -40)
            once = vertices(self.ob())
            self.look()
            brush("Grab", 40)
            twice = vertices(self.ob())
            self.look()
            undo()
            for there, names in ((once, ["Clay"]), (twice, ["Clay", "Grab"]), (once, ["Clay"])):
                np.testing.assert_array_equal(vertices(self.ob()), there)
                self.look()
                self.finish()
                self.assertEqual(self.names(), names)
                (redo if there is once else undo)()
            for _ in range(2):
                undo()
            self.assertEqual(state(self.ob()), before)
            for _ in range(2):
                redo()
            np.testing.assert_array_equal(vertices(self.ob()), twice)
            undo()
            brush("Smooth", 0)
            self.look()
            self.finish()
        self.assertEqual(self.names(), ["Clay", "Smooth"])
        self.assertFalse(self.edited())
        for count in (1, 0):
            undo()
            self.assertEqual(len(self.names()), count)
            self.assertFalse(self.edited())
        self.assertEqual(state(self.ob()), before)

    @long
    def test_undo_while_brush_and_neural_strokes_are_on_their_way(self) -> None:
        """One press takes back one of them, one more brings it back, and nothing is muted. What
        waits cuts not off what can be redone before the artist goes on."""
        orders = {
            "clay neural undo": ["Clay"],
            "clay neural undo redo": ["Clay", "Neural"],
            "neural clay undo": [],
            "neural clay undo redo": ["Clay", "Neural"],
            "neural clay undo grab": ["Grab", "Neural"],
            "neural clay undo finish redo": ["Clay", "Neural"],
            "neural clay undo undo redo redo": ["Clay", "Neural"],
            "neural clay undo undo finish redo finish redo": ["Clay", "Neural"],
            "neural clay undo undo redo undo redo redo": ["Clay", "Neural"],
            "neural clay undo undo redo two": ["Neural", "Two"],
            "neural clay undo undo grab undo redo": ["Grab"],
            "neural clay grab undo undo undo redo redo redo": ["Clay", "Grab", "Neural"],
            "clay neural grab undo": ["Clay"],
            "clay neural grab undo redo": ["Clay", "Grab", "Neural"],
            "clay neural undo undo redo redo": ["Clay", "Neural"],
            "clay grab undo absorb": ["Clay"],
            "clay undo redo absorb": ["Clay"],
        }
        before = state(self.ob())
        steps = {
            "clay": lambda: brush("Clay", -40),
            "grab": lambda: brush("Grab", 40),
            "neural": lambda: stroke(arc(self.ob(), tilt=0.4), radius=0.1, name="Neural"),
            "two": lambda: stroke(arc(self.ob(), tilt=2.0), radius=0.1, name="Two"),
            "undo": undo,
            "redo": redo,
            "absorb": bpy.ops.neural_sculpt.absorb,
            "finish": self.finish,
        }
        for order, expected in orders.items():
            with self.subTest(order), self.as_in_a_window():
                for word in order.split():
                    steps[word]()
                    self.look()
                self.finish()
                self.assertEqual(self.names(), expected)
                self.assertFalse(any(item.muted for item in self.ob().neural_sculpt.strokes))
                self.assertEqual(self.session.last_error, "")
                done = order.split()
                strokes = sum(word in ("clay", "grab", "neural", "two") for word in done)
                for _ in range(strokes - done.count("undo") + done.count("redo")):
                    undo()
                self.assertEqual(state(self.ob()), before)

    def test_a_stroke_meanwhile_waits_for_the_first(self) -> None:
        """A brush at work keeps results back; its stroke is absorbed on top."""
        with self.as_in_a_window():
            brush("Clay", -40)
            self.look()
            with patch.object(self.results, "is_at_work", lambda: True):
                self.finish()
                self.assertEqual(self.names(), [])
                brush("Grab", 40)
            sculpted = vertices(self.ob())
            self.look()
            self.finish()
        self.assertEqual(self.names(), ["Clay", "Grab"])
        self.assert_is(sculpted)

    def test_what_was_sculpted_before_the_result_is_not_lost(self) -> None:
        with self.as_in_a_window():
            brush("Clay", -40)
            self.look()
            brush("Grab", 40)  # and nobody has looked
            sculpted = vertices(self.ob())
            self.finish()
            np.testing.assert_array_equal(vertices(self.ob()), sculpted)
            self.look()
            self.finish()
        self.assertEqual(self.names(), ["Clay", "Grab"])
        self.assertFalse(self.edited())

    @long
    def test_another_topology_is_absorbed_as_a_whole(self) -> None:
        stroke(arc(self.ob(), tilt=2.0), radius=0.1, intensity=0.03)
        with self.as_in_a_window():
            self.look()
            bpy.ops.object.mode_set(mode="OBJECT")
            modifier = self.ob().modifiers.new("Subdivision", "SUBSURF")
            bpy.ops.object.modifier_apply(modifier=modifier.name)
            bpy.ops.object.mode_set(mode="SCULPT")
            push_undo("Subdivide")
            self.look()
            self.finish()
        self.assertEqual(len(self.names()), 2)
        self.assertEqual(self.names()[1], "Sculpted")
        self.assertFalse(self.edited())

    def test_a_stretched_proxy_is_made_anew(self) -> None:
        with self.as_in_a_window():
            for _ in range(2):  # the second on the result of the first
                points = vertices(self.ob())
                share = np.linalg.norm(points - points[points[:, 1].argmin()], axis=1) / 0.12
                points[:, 1] -= 0.1 * np.clip(1 - share**2, 0, None) ** 2
                self.ob().data.vertices.foreach_set("co", points.ravel())
                self.look()
            self.finish()
        self.assertEqual(len(self.names()), 2)
        self.assertFalse(self.edited())
        self.assertLess(vertices(self.ob())[:, 1].min(), -0.75)

    def test_it_can_be_switched_off(self) -> None:
        self.ob().neural_sculpt.live = False
        with self.as_in_a_window():
            brush("Clay")
            self.look()
            self.assertFalse(self.session.jobs)
        self.assertTrue(self.edited())
        bpy.ops.neural_sculpt.absorb()
        self.assertFalse(self.edited())

    def test_an_answer_about_other_vertices_leaves_the_brush_stroke(self) -> None:
        before = state(self.ob())
        with self.as_in_a_window():
            brush("Clay")
            sculpted = vertices(self.ob())
            self.look()
            job = self.session.jobs[0]
            believed = job.apply

            def apply(result: Any) -> None:
                arrays = {**result.arrays, "snapped": np.zeros((1, 3), np.float32)}
                believed(replace(result, arrays=arrays))

            job.apply = apply
            self.finish()
            self.assertIn("other vertices", self.session.last_error)
            np.testing.assert_array_equal(vertices(self.ob()), sculpted)
            self.assertEqual(self.names(), [])
            self.assertTrue(self.edited())
            self.look()
            brush("Grab", 40)
            self.look()
            self.finish()
        self.assertEqual(self.names(), ["Grab"])
        self.assertFalse(self.edited())
        undo()
        self.assertEqual(state(self.ob()), before)

    def test_what_is_cancelled_is_absorbed_with_the_next_stroke(self) -> None:
        with self.as_in_a_window():
            brush("Clay", -40)
            self.look()
            self.session.cancel()
            self.assertFalse(self.live.is_on_its_way(self.ob()))
            self.look()
            self.assertFalse(self.session.jobs)
            brush("Grab", 40)
            sculpted = vertices(self.ob())
            self.look()
            self.finish()
        self.assertEqual(self.names(), ["Grab"])
        self.assertFalse(self.edited())
        self.assert_is(sculpted)

    def test_a_worker_that_dies_costs_nothing(self) -> None:
        with self.as_in_a_window():
            brush("Clay", -40)
            self.look()
            brush("Grab", 40)
            self.look()
            self.pump(lambda: self.session.jobs[0].status == "running")
            os.kill(self.session.client.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
            self.finish()
        self.assertEqual(self.names(), ["Clay", "Grab"])
