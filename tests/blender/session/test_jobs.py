# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs in flight, as in a window: queue, cancel, undo, a killed worker, another file."""

import os
import threading
import time

import bpy
import numpy as np
from harness import (
    RESOLUTION,
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
    strokes_of,
    undo,
    vertices,
)

RADIUS, INTENSITY = 0.15, 0.06


class Jobs(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")
        self.before = state(self.ob)

    def stroke(self, tilt: float = 0.0, name: str = "") -> None:
        points = arc(field("Sphere"), tilt=tilt)
        result = stroke(points, radius=RADIUS, intensity=INTENSITY, name=name)
        self.assertEqual(result, {"FINISHED"})

    def remesh(self) -> None:
        """A job that the worker does quickly."""
        self.assertEqual(bpy.ops.neural_sculpt.remesh(resolution=40), {"FINISHED"})

    def move(self) -> None:
        """Something else that the artist does."""
        field("Sphere").location.x += 1.0
        bpy.context.view_layer.update()
        push_undo("Move")

    def top(self, tilt: float = 0.0) -> float:
        """Height of the sphere in the middle of the stroke that is turned by `tilt`."""
        points = vertices(field("Sphere"))
        middle = np.array([0, np.sin(-tilt), np.cos(tilt)])
        size = np.linalg.norm(points, axis=1)
        return float(size[(points @ middle) / size > 0.997].mean())

    def names(self) -> list[str]:
        return [kept["name"] for kept in strokes_of(field("Sphere"))]

    def muted(self) -> list[bool]:
        return [item.muted for item in field("Sphere").neural_sculpt.strokes]

    def settled(self) -> tuple[object, ...]:
        """The field, without the mesh that shows what is still to come."""
        return state(field("Sphere"))[:5]

    def wait_for_progress(self) -> None:
        self.pump(lambda: not self.session.jobs or self.session.jobs[0].fraction > 0)
        self.assertTrue(self.session.jobs, "it ended before it could be disturbed")

    def test_in_a_window_a_stroke_waits_for_the_one_before(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.stroke(1.2, name="Two")
            self.assertEqual(len(self.session.jobs), 2)
            self.wait_for_progress()
            self.assertEqual(self.settled(), self.before[:5], "operators return at once")
            self.finish()
        self.assertEqual(self.names(), ["One", "Two"])
        np.testing.assert_allclose(self.top(), self.top(1.2), atol=0.3 * INTENSITY)
        undo()
        self.assertEqual(self.names(), ["One"])
        self.assertGreater(self.top(), self.top(1.2) + 0.5 * INTENSITY)
        undo()
        self.assertEqual(state(field("Sphere")), self.before)

    def test_no_other_thread_runs_python(self) -> None:
        """Up to Blender 5.0 one that does in the midst of an operator can crash it."""
        with self.as_in_a_window():
            self.stroke()
            self.wait_for_progress()
            self.assertEqual([thread.name for thread in threading.enumerate()], ["MainThread"])
            self.finish()

    def test_cancel(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.stroke(1.2, name="Two")
            self.wait_for_progress()
            bpy.ops.neural_sculpt.cancel()
            self.assertFalse(self.session.jobs)
            self.assertEqual(self.session.last_error, "")
            self.assertEqual(state(self.ob), self.before)
            self.remesh()
            self.finish()
        self.assertEqual(self.ob.neural_sculpt.resolution, 40)
        self.assertEqual(self.names(), [])

    def test_a_stroke_drawn_over_one_that_is_cancelled_is_laid_on_what_is_there(self) -> None:
        points = arc(self.ob)
        with self.as_in_a_window():
            stroke(points, radius=0.1, intensity=0.1, name="One")
            stroke(points * (1 + 0.1 / 0.6), radius=0.05, intensity=0.03, name="Two")
            self.session.cancel_job(self.session.jobs[0])
            self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.names(), ["Two"])
        self.assertAlmostEqual(self.top(), 0.6 + 0.03, delta=0.015)

    def test_nothing_to_cancel(self) -> None:
        with self.assertRaisesRegex(RuntimeError, "idle"):
            bpy.ops.neural_sculpt.cancel()

    def test_undo_takes_back_the_strokes_that_wait_one_by_one(self) -> None:
        self.stroke(name="One")
        with self.as_in_a_window():
            self.stroke(1.2, name="Two")
            self.stroke(-1.2, name="Three")
            self.wait_for_progress()
            undo()
            self.assertEqual([job.label for job in self.session.jobs], ["Two"])
            undo()
            self.assertFalse(self.session.jobs)
            self.assertEqual(self.names(), ["One"])
            undo()
            self.finish()
        self.assertEqual(state(field("Sphere")), self.before)

    def test_undo_takes_back_what_waits_before_what_it_waits_for(self) -> None:
        self.stroke(name="One")
        drawn = state(self.ob)
        with self.as_in_a_window():
            self.remesh()
            undo()
            self.assertFalse(self.session.jobs)
            self.finish()
            self.assertEqual(state(field("Sphere")), drawn)
            undo()
        self.assertEqual(state(field("Sphere")), self.before)

    def test_undo_of_the_base_cancels(self) -> None:
        self.stroke(name="One")
        with self.as_in_a_window():
            self.remesh()
            self.move()
            for _ in range(2):
                self.assertEqual(len(self.session.jobs), 1)
                undo()
            self.assertFalse(self.session.jobs)
            undo()
            self.finish()
        self.assertEqual(state(field("Sphere")), self.before)

    def test_undo_of_what_was_done_meanwhile_does_not_cancel(self) -> None:
        with self.as_in_a_window():
            self.remesh()
            self.move()
            undo()
            self.assertEqual(len(self.session.jobs), 1)
            self.finish()
        self.assertEqual(field("Sphere").neural_sculpt.resolution, 40)
        self.assertEqual(field("Sphere").location.x, 0.0)

    def test_redo_brings_back_what_had_no_result(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.finish()
            drawn = state(field("Sphere"))
            undo()
            self.stroke(name="Two")
            undo()
            self.assertFalse(self.session.jobs)
            self.assertEqual(state(field("Sphere")), self.before)
            redo()
            self.finish()
            self.assertEqual(self.names(), ["Two"])
            undo()
            self.assertEqual(state(field("Sphere")), self.before)
            redo()
            self.assertEqual(self.names(), ["Two"])
        self.assertNotEqual(state(field("Sphere")), drawn)

    def test_the_object_is_deleted(self) -> None:
        with self.as_in_a_window():
            self.remesh()
            self.stroke()
            bpy.data.objects.remove(self.ob)
            self.finish()
        self.assertIn("gone", self.session.last_error)
        self.assertEqual(len(bpy.data.objects), 0)

    def test_the_object_is_in_edit_mode(self) -> None:
        with self.as_in_a_window():
            self.remesh()
            bpy.ops.object.mode_set(mode="EDIT")
            self.pump(lambda: "this mode" in self.session.jobs[0].message)
            self.assertEqual(self.ob.neural_sculpt.resolution, RESOLUTION)
            bpy.ops.object.mode_set(mode="OBJECT")
            self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.ob.neural_sculpt.resolution, 40)

    def test_another_object_is_in_dyntopo(self) -> None:
        """What is sculpted there could not be taken back beyond a step of ours."""
        bpy.ops.mesh.primitive_cube_add()
        bpy.ops.object.mode_set(mode="SCULPT")
        bpy.ops.sculpt.dynamic_topology_toggle()
        with self.as_in_a_window():
            bpy.ops.neural_sculpt.add(kind="TORUS")
            self.pump(lambda: not self.session.jobs or "Dyntopo" in self.session.jobs[0].message)
            self.assertNotIn("Torus", bpy.data.objects)
            bpy.ops.sculpt.dynamic_topology_toggle()
            self.finish()
        self.assertIn("Torus", bpy.data.objects)
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_another_file_is_opened(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.wait_for_progress()
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            self.assertFalse(self.session.jobs)
        add("SPHERE")
        self.assertEqual(self.names(), [])

    def test_the_worker_is_killed(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.stroke(1.2, name="Two")
            self.wait_for_progress()
            os.kill(self.session.client.pid, 9)
            self.pump(lambda: self.session.jobs[0].deaths == 1)
            self.assertEqual(self.settled(), self.before[:5])
            self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.names(), ["One", "Two"], "a new worker does what is left")
        self.assertEqual(self.muted(), [False, False])

    @long
    def test_the_worker_is_killed_twice_by_the_same_stroke(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.stroke(1.2, name="Two")
            job = self.session.jobs[0]
            for death in (1, 2):
                self.wait_for_progress()
                os.kill(self.session.client.pid, 9)
                self.pump(lambda death=death: job.deaths == death)
            self.assertIn("One is in the history, muted.", self.session.last_error)
            self.assertIn("SIGKILL", self.session.last_error)
            self.finish()
        self.assertEqual((self.names(), self.muted()), (["One", "Two"], [True, False]))
        bpy.ops.neural_sculpt.mute_stroke(uid=field("Sphere").neural_sculpt.strokes[0].uid)
        self.assertEqual(self.muted(), [False, False])
        np.testing.assert_allclose(self.top(), self.top(1.2), atol=0.3 * INTENSITY)

    def test_restart(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.wait_for_progress()
            bpy.ops.neural_sculpt.restart_worker()
            self.assertFalse(self.session.jobs)
        self.assertEqual(state(self.ob), self.before)
        self.remesh()
        self.assertEqual(self.ob.neural_sculpt.resolution, 40)

    def test_a_stopped_worker_starts_again_with_the_next_job(self) -> None:
        with self.as_in_a_window():
            self.stroke(name="One")
            self.wait_for_progress()
            client = self.session.client
            bpy.ops.neural_sculpt.stop_worker()
            self.assertFalse(client.alive)
            self.assertFalse(self.session.jobs)
        with self.assertRaisesRegex(RuntimeError, "not running"):
            bpy.ops.neural_sculpt.stop_worker()
        self.assertEqual(state(self.ob), self.before)
        self.remesh()
        self.assertEqual(self.ob.neural_sculpt.resolution, 40)

    def test_a_job_is_slow_when_it_has_run_for_half_a_second(self) -> None:
        with self.as_in_a_window():
            self.assertIsNone(self.session.slow_job())
            self.stroke(name="One")
            job = self.session.jobs[0]  # without a poll nothing is heard of its end
            job.begun = time.monotonic() + 60
            self.assertIsNone(self.session.slow_job())
            job.begun = time.monotonic() - 0.6
            self.assertIs(self.session.slow_job(), job)
            self.finish()
            self.assertIsNone(self.session.slow_job())

    def test_unregistering_stops_the_worker_and_keeps_the_strokes(self) -> None:
        registration = module("blender.registration")
        with self.as_in_a_window():
            self.stroke(name="One")
            self.stroke(1.2, name="Two")
            self.wait_for_progress()
            client = self.session.client
            registration.unregister()
            registration.register()
        self.assertFalse(client.alive)
        self.assertIsNone(self.session.client)
        self.assertEqual((self.names(), self.muted()), (["One", "Two"], [True, True]))
        bpy.ops.neural_sculpt.mute_stroke(uid=field("Sphere").neural_sculpt.strokes[0].uid)
        self.assertEqual(self.muted(), [False, True])
        np.testing.assert_allclose(self.top(), self.top(1.2) + INTENSITY, atol=0.3 * INTENSITY)
