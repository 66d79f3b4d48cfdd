# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong is told in a sentence, and the field stays as it was."""

import json
import os
import pickle
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import bpy
from harness import EXTENSION, SculptCase, add, arc, collection, module, state


class Bomb:
    """Unpickling it would make a file."""

    def __init__(self, path: Path) -> None:
        self.path = str(path)

    def __reduce__(self) -> tuple[object, ...]:
        return open, (self.path, "w")


class Files(SculptCase):
    def load(self, name: str, data: bytes) -> None:
        (self.folder / name).write_bytes(data)
        self.assert_fails(
            name, bpy.ops.neural_sculpt.add, kind="FILE", filepath=str(self.folder / name)
        )
        self.assertEqual(len(bpy.data.objects), 0)

    def test_no_file(self) -> None:
        self.assert_fails("no file", bpy.ops.neural_sculpt.add, kind="FILE", filepath="/no/x.pth")

    def test_malicious_pickle(self) -> None:
        trace = self.folder / "executed"
        self.load("evil.pth", pickle.dumps(Bomb(trace)))
        self.assertFalse(trace.exists())

    def test_broken_files(self) -> None:
        add("SPHERE")
        bpy.ops.neural_sculpt.export(filepath=str(self.folder / "good.safetensors"))
        bpy.ops.neural_sculpt.export(filepath=str(self.folder / "good.pth"))
        bpy.data.objects.remove(bpy.context.active_object)
        for suffix in ("safetensors", "pth"):
            whole = (self.folder / f"good.{suffix}").read_bytes()
            self.load(f"empty.{suffix}", b"")
            self.load(f"half.{suffix}", whole[: len(whole) // 2])
            self.load(f"noise.{suffix}", bytes(range(256)) * 20)
        self.load("huge.safetensors", (2**60).to_bytes(8, "little") + b"{}")


class Strokes(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")
        self.before = state(self.ob)
        self.addCleanup(lambda: self.assertEqual(state(self.ob), self.before))

    def refused(self, sentence: str, **given: object) -> None:
        self.assert_fails(sentence, bpy.ops.neural_sculpt.stroke, **given)

    def test_nothing_drawn(self) -> None:
        self.refused("points")

    def test_off_the_surface(self) -> None:
        self.refused("surface", points=collection(0.1 * arc(self.ob)), radius=0.05)
        self.refused("box", points=collection(5 * arc(self.ob)))

    def test_files(self) -> None:
        self.refused("JSON", stroke_json="{")
        self.refused("stroke file", stroke_json="[]")
        self.refused("version 2", stroke_json=json.dumps({"version": 2, "strokes": []}))
        self.refused("no strokes", stroke_json=json.dumps({"version": 1, "strokes": []}))
        bad = {"points": [[0, 0, 0]], "radius": -1, "intensity": 0.1}
        self.refused("radius", stroke_json=json.dumps({"version": 1, "strokes": [bad]}))

    def test_files_that_cannot_be_read(self) -> None:
        read = bpy.ops.neural_sculpt.strokes_from_file
        self.assert_fails("none.json", read, filepath=str(self.folder / "none.json"))
        self.assert_fails(self.folder.name, read, filepath=str(self.folder))
        path = self.folder / "some.json"
        for sentence, content in {
            "some.json": b"\xff\xfe",
            "JSON": b"{",
            "no strokes": b'{"version": 1, "strokes": []}',
        }.items():
            path.write_bytes(content)
            self.assert_fails(sentence, read, filepath=str(path))
        with path.open("wb") as file:
            file.truncate(2**30)
        self.assert_fails("larger than any", read, filepath=str(path))

    def test_senseless_strokes(self) -> None:
        points = arc(self.ob).tolist()
        plain = {"points": points, "radius": 0.1, "intensity": 0.05}
        factors = [0.05] * len(points)
        for sentence, words in {
            "The radius is 1e-30": {"radius": 1e-30},
            "The intensity is 1e+308": {"intensity": 1e308},
            "With its pressure": {"radius": 1e-3, "radius_factors": factors},
            "radius_factors are": {"radius_factors": [1e300] * len(points)},
            "name cannot be": {"name": ["x" * 5000]},
        }.items():
            strokes = [{**plain, **words}]
            self.refused(sentence, stroke_json=json.dumps({"version": 1, "strokes": strokes}))
            self.assertLess(len(self.session.last_error), 300)

    def test_what_sculpt_mode_keeps_is_not_left_out(self) -> None:
        """Of Multires and Dyntopo the mesh has what was there before, until the mode is left."""
        for name in ("Multires", "Dyntopo"):
            bpy.ops.mesh.primitive_cube_add()
            bpy.ops.object.mode_set(mode="SCULPT")
            self.assertTrue(bpy.ops.neural_sculpt.from_mesh.poll())
            if name == "Multires":
                bpy.ops.object.modifier_add(type="MULTIRES")
                bpy.ops.object.multires_subdivide(modifier=name)
            else:
                bpy.ops.sculpt.dynamic_topology_toggle()
            with self.assertRaisesRegex(RuntimeError, "Leave Sculpt Mode first"):
                bpy.ops.neural_sculpt.from_mesh()
            bpy.ops.object.mode_set(mode="OBJECT")
            self.assertTrue(bpy.ops.neural_sculpt.from_mesh.poll())

    def test_locked_objects(self) -> None:
        points = collection(arc(self.ob))
        bpy.ops.object.mode_set(mode="EDIT")
        with self.assertRaisesRegex(RuntimeError, "Edit Mode"):
            bpy.ops.neural_sculpt.stroke(points=points)
        bpy.ops.object.mode_set(mode="OBJECT")
        self.ob.shape_key_add(name="Basis")
        with self.assertRaisesRegex(RuntimeError, "shape keys"):
            bpy.ops.neural_sculpt.stroke(points=points)
        self.ob.shape_key_clear()
        bpy.ops.object.modifier_add(type="MULTIRES")
        bpy.ops.object.multires_subdivide(modifier="Multires")
        with self.assertRaisesRegex(RuntimeError, "Multires"):
            bpy.ops.neural_sculpt.stroke(points=points)
        bpy.ops.object.modifier_remove(modifier="Multires")

    def test_ordinary_objects(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        with self.assertRaisesRegex(RuntimeError, "Select a neural field"):
            bpy.ops.neural_sculpt.stroke(points=collection(arc(self.ob)))


class Workers(SculptCase):
    """Which Python runs the worker; each test leaves the session stopped."""

    def setUp(self) -> None:
        super().setUp()
        self.session.stop()
        self.preferences = bpy.context.preferences.addons[EXTENSION].preferences
        named = os.environ["NEURAL_SCULPT_PYTHON"]
        self.addCleanup(self.session.stop)
        self.addCleanup(os.environ.__setitem__, "NEURAL_SCULPT_PYTHON", named)
        self.addCleanup(setattr, self.preferences, "worker_python", "")

    def test_not_installed(self) -> None:
        del os.environ["NEURAL_SCULPT_PYTHON"]
        self.assert_fails("not installed", bpy.ops.neural_sculpt.add, kind="SPHERE")

    def test_preferences_come_first(self) -> None:
        self.preferences.worker_python = str(self.folder / "nowhere" / "python")
        self.assert_fails("nowhere", bpy.ops.neural_sculpt.add, kind="SPHERE")

    def test_a_python_without_torch(self) -> None:
        bare = self.folder / "bare"
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(bare)], check=True)
        python = module("worker.install.environment").environment_python(bare)
        self.preferences.worker_python = str(python)
        self.assert_fails("No module named", bpy.ops.neural_sculpt.add, kind="SPHERE")

    def test_a_device_that_is_not_there(self) -> None:
        """It is told; another choice needs no restart by hand."""
        self.addCleanup(setattr, self.preferences, "device", "AUTO")
        self.preferences.device = "CUDA"
        with suppress(RuntimeError):  # there may be one
            bpy.ops.neural_sculpt.add(kind="SPHERE")
            self.skipTest("there is a CUDA card")
        self.assertIn("CUDA", self.session.last_error)
        self.preferences.device = "CPU"
        add("SPHERE")
        self.assertEqual(self.session.client.hello["device"], "cpu")

    def test_installing_needs_permission(self) -> None:
        self.assertFalse(bpy.app.online_access)
        with self.assertRaisesRegex(RuntimeError, "Online Access"):
            bpy.ops.neural_sculpt.install_worker()
