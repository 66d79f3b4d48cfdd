# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker that dies, cannot write or answers nonsense: no stroke is lost, no later job suffers,
and a result reaches the scene whole or not at all."""

import os
import shutil
import signal
import time
from unittest.mock import patch

import bpy
import numpy as np
from harness import SteeredCase, field, long, module, state, stroke, undo

WAYS = ("nan", "index", "shape", "missing", "revision", "death")
if os.name == "posix":
    WAYS += ("full",)


class NoMemory:
    """An array for which there is none."""

    size = 3

    def __len__(self) -> int:
        return 1

    def __array__(self, *given: object, **more: object) -> np.ndarray:
        raise MemoryError


class BrokenWorker(SteeredCase):
    def setUp(self) -> None:
        super().setUp()
        self.addCleanup(self.session.stop)
        self.spoil = self.folder / "spoil"
        self.before = state(self.ob)

    def listed(self) -> list[tuple[str, bool]]:
        return [(item.name, item.muted) for item in field("Sphere").neural_sculpt.strokes]

    @long
    def test_once_is_made_good(self) -> None:
        for number, how in enumerate(WAYS, 1):
            with self.subTest(how):
                self.spoil.write_text(f"{how} once")
                stroke(np.eye(3), name=how)
                self.finish()
                self.assertEqual(self.session.last_error, "")
                self.assertEqual(self.listed(), [(way, False) for way in WAYS[:number]])

    @long
    def test_twice_the_stroke_is_kept_and_the_next_one_has_its_turn(self) -> None:
        for number, how in enumerate(WAYS, 1):
            with self.subTest(how):
                before = state(field("Sphere"))
                self.spoil.write_text(how)
                stroke(np.eye(3), name=how)
                self.finish()
                self.assertIn(f"{how} is in the history, muted.", self.session.last_error)
                after = state(field("Sphere"))
                self.assertEqual((after[:2], after[3:]), (before[:2], before[3:]))
                self.assertEqual(self.listed(), [(way, True) for way in WAYS[:number]])
        self.spoil.unlink()
        stroke(np.eye(3), name="Good")
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.listed()[-1], ("Good", False))
        undo()
        self.assertEqual(len(self.listed()), len(WAYS))

    def test_undo_and_another_file_end_a_job_that_the_worker_cannot_be_told_of(self) -> None:
        """As on a full disk: what is waited for is taken back, and not what was done before it."""
        (self.session.client.folder / "requests" / "part").mkdir()
        stroke(np.eye(3), name="Refused")
        self.assertIn("Refused is in the history, muted.", self.session.last_error)
        shutil.rmtree(self.session.client.folder / "requests" / "part")
        stroke(np.eye(3), name="Waits")
        (self.session.client.folder / "requests" / "part").mkdir()
        undo()
        self.assertFalse(self.session.jobs)
        self.assertEqual(self.listed(), [("Refused", True)])
        shutil.rmtree(self.session.client.folder / "requests" / "part")
        stroke(np.eye(3), name="Waits")
        (self.session.client.folder / "requests" / "part").mkdir()
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.assertFalse(self.session.jobs)

    def test_a_history_that_lacks_a_layer_is_not_believed(self) -> None:
        for name in ("One", "Two", "Three"):
            stroke(np.eye(3), name=name)
            self.finish()
        before = state(field("Sphere"))
        self.spoil.write_text("fewer")
        bpy.ops.neural_sculpt.mute_stroke(uid=field("Sphere").neural_sculpt.strokes[0].uid)
        self.finish()
        self.assertIn("the layers of another history", self.session.last_error)
        self.assertEqual(state(field("Sphere")), before)

    def test_a_measure_that_is_none_costs_neither_a_worker_nor_a_stroke(self) -> None:
        stroke(np.eye(3), name="One")
        self.finish()
        worker = self.session.client.pid
        self.spoil.write_text("report")
        self.say("measured")
        self.pump(lambda: self.session.behind is None)
        self.spoil.unlink()
        stroke(np.eye(3), name="Two")
        self.finish()
        self.assertEqual(self.listed(), [("One", False), ("Two", False)])
        self.assertEqual(self.session.client.pid, worker)
        self.assertEqual(self.session.last_error, "")

    def test_a_measure_that_cannot_be_asked_for_costs_no_worker(self) -> None:
        stroke(np.eye(3), name="One")
        self.pump(lambda: self.session.jobs[0].status == "running")
        worker, requests = self.session.client.pid, self.session.client.folder / "requests"
        self.pump(lambda: not any(requests.iterdir()))  # the worker has it
        shutil.rmtree(requests)
        self.finish()
        self.assertEqual(self.listed(), [("One", False)])
        self.assertIsNone(self.session.behind)
        self.assertEqual(self.session.client.pid, worker)

    @long
    def test_a_job_that_begins_in_the_moment_of_a_death(self) -> None:
        drawn = module("stroke.stroke").Stroke(np.eye(3), module("stroke.brush").Brush(0.1, 0.05))
        job = module("blender.session.stroke_jobs").edit_job(field("Sphere"), (drawn,))
        request, deaths = job.request, []

        def request_and_kill() -> object:
            if not deaths:
                deaths.append(self.session.client.pid)
                os.kill(deaths[0], getattr(signal, "SIGKILL", signal.SIGTERM))
                end = time.monotonic() + 60
                while self.session.client.alive and time.monotonic() < end:
                    time.sleep(0.01)
            return request()

        job.request = request_and_kill
        self.session.submit(job)
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual([muted for _, muted in self.listed()], [False])

    @long
    def test_a_defect_ends_one_job_and_not_the_timer(self) -> None:
        stroke(np.eye(3), name="One")
        message, kind = module("worker.client").Message, module("worker.client").MessageKind
        news = [message(kind.PROGRESS, self.session.jobs[0].number)]  # without its fields
        with patch.object(self.session.worker, "poll", lambda: news):
            self.pump(lambda: self.session.last_error != "")
        self.assertIn("One failed; the system console says why.", self.session.last_error)
        self.assertEqual(self.listed(), [("One", True)])
        stroke(np.eye(3), name="Two")
        self.finish()
        self.assertEqual(self.session.last_error, "")
        self.assertEqual(self.listed()[-1], ("Two", False))

    def test_a_result_for_which_there_is_no_memory_changes_nothing(self) -> None:
        drawn = module("stroke.stroke").Stroke(np.eye(3), module("stroke.brush").Brush(0.1, 0.05))
        client, commit = module("worker.client"), module("blender.scene.commit")
        entry_of = module("blender.scene.stroke_list").entry_of
        points, triangles = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
        arrays = {
            "layer": np.ones(9, np.uint8),
            "vertices": points,
            "normals": points,
            "triangles": triangles,
            "edges": np.array([[0, 1], [1, 2], [0, 2]], np.int32),
            "corner_edges": NoMemory(),
        }
        fields = {"revision": "new", "layer": "id", "context": ""}
        result = client.Message(client.MessageKind.RESULT, 1, fields, arrays)
        with self.assertRaises(MemoryError):
            commit.add_entry(field("Sphere"), entry_of(drawn), result, "One")
        self.assertEqual(state(field("Sphere")), self.before)
