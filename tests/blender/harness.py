# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests in Blender share: the installed extension, an empty scene, ways to ask for things.

Standard library, NumPy and bpy only. All tests go through operators and look at the scene.
"""

import importlib
import json
import os
import time
import unittest
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from unittest.mock import patch

import bpy
import numpy as np
from bpy.types import Mesh, Object

EXTENSION = "bl_ext.user_default.neural_sculpt"
RESOLUTION = 48  # cells; coarse, to be quick
WORKER_SECONDS = 300


def module(name: str) -> ModuleType:
    """A module of the installed extension, "blender.scene.commit" for example."""
    return importlib.import_module(f"{EXTENSION}.{name}")


def call_as(caller: str) -> None:
    """Let the session take jobs of an "Artist" from now on, or of a "Script", which waits."""
    session = module("blender.session.worker_session").session
    session.caller = getattr(module("blender.session.caller"), caller)()


def long(test: Callable) -> Callable:
    """Mark a test that takes more than five seconds or so and is not essential.

    `scripts/test.py` runs it with --all only: else `--short` is given to what runs the tests.
    """
    test.long = True
    return test


class SculptCase(unittest.TestCase):
    """Starts each test in an empty scene with one undo step, and a folder for files."""

    def setUp(self) -> None:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        preferences = bpy.context.preferences.addons[EXTENSION].preferences
        preferences.resolution, preferences.refine = RESOLUTION, True
        temporary = TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        self.session = module("blender.session.worker_session").session
        self.addCleanup(self.session.cancel)
        push_undo("Start")

    def assert_fails(
        self, sentence: str, operator: Callable[..., set[str]], **given: object
    ) -> None:
        """The operator reports an error that holds `sentence`, and is one or two sentences."""
        with self.assertRaises(RuntimeError) as caught:
            operator(**given)
        message = str(caught.exception).removeprefix("Error: ").strip()
        self.assertIn(sentence, message)
        self.assertNotIn("Traceback", message)
        self.assertTrue(message.endswith("."), message)

    def undo_and_redo(self, states: Sequence[object], look: Callable[[], object]) -> None:
        """Undo leads back through all states, and redo through them again; `look` tells them."""
        for expected in states[-2::-1]:
            undo()
            self.assertEqual(look(), expected)
        for expected in states[1:]:
            redo()
            self.assertEqual(look(), expected)

    @contextmanager
    def as_in_a_window(self) -> Iterator[None]:
        """Operators return at once, and `finish` does what the timer does."""
        call_as("Artist")
        try:
            yield
        finally:
            call_as("Script")

    def pump(self, until: Callable[[], bool]) -> None:
        """Poll the worker until something is so."""
        end = time.monotonic() + WORKER_SECONDS
        while not until():
            self.assertLess(time.monotonic(), end, "the worker did not answer in time")
            self.session.poll_once()
            time.sleep(0.005)

    def finish(self) -> None:
        """Poll the worker until it is idle, and all is in the scene."""
        self.pump(lambda: self.session.rests)


class SphereCase(SculptCase):
    """Starts each test with a sphere: its `size`, the radius, and a `line` over its top."""

    def setUp(self) -> None:
        super().setUp()
        self.size = float(np.linalg.norm(vertices(add("SPHERE")), axis=1).mean())
        self.line = arc(self.ob())

    def ob(self) -> Object:
        """The field, which no reference outlives."""
        return field("Sphere")


class SteeredCase(SculptCase):
    """As in a window, with a worker that ends its jobs when the test says so (toy_worker.py).

    It is started once for all tests of a class, and hears each of them in the same folder, which is
    empty when a test begins.
    """

    heard: Path
    """The folder of the class."""

    @classmethod
    def setUpClass(cls) -> None:
        """Have the toy worker started from now on."""
        super().setUpClass()
        cls.heard = Path(cls.enterClassContext(TemporaryDirectory()))
        python = os.environ["NEURAL_SCULPT_PYTHON"]
        toy = Path(__file__).with_name("session") / "toy_worker.py"
        command = [python, "-I", "-u", str(toy), str(toy.parents[3]), str(cls.heard)]
        session = module("blender.session.worker_session").session
        session.stop()
        cls.addClassCleanup(session.stop)
        environment = module("worker.install.environment")
        cls.enterClassContext(patch.object(environment, "worker_command", lambda *_: command))

    def setUp(self) -> None:
        super().setUp()
        self.folder = self.heard
        for file in self.folder.iterdir():
            file.unlink()
        self.ob = add("SPHERE")
        call_as("Artist")
        self.addCleanup(call_as, "Script")

    def finish(self) -> None:
        """Let edits end, and poll the worker until only a measure may be left."""
        self.say("go")
        super().finish()
        (self.folder / "go").unlink()

    def say(self, word: str) -> None:
        """Tell the worker something, see toy_worker."""
        (self.folder / word).touch()


def brush_settings() -> bpy.types.PropertyGroup:
    """The brush of the next stroke; never kept, as little as any data-block."""
    return bpy.data.brushes[".neural_sculpt"].neural_sculpt


def fit(source: Object, **given: object) -> Object:
    """The new field of a mesh."""
    bpy.context.view_layer.objects.active = source
    settings = {"preset": "DRAFT", **given}
    assert bpy.ops.neural_sculpt.from_mesh(**settings) == {"FINISHED"}
    return bpy.context.active_object


def add(kind: str = "SPHERE") -> Object:
    """A new field, active and selected."""
    assert bpy.ops.neural_sculpt.add(kind=kind) == {"FINISHED"}
    return bpy.context.active_object


def arc(ob: Object, spread: float = 0.6, tilt: float = 0.0) -> np.ndarray:
    """Points (9, 3) of an arc over the top of a sphere field, turned about X by `tilt`."""
    size = np.linalg.norm(vertices(ob), axis=1).mean()
    angles = np.linspace(-spread, spread, 9)
    points = size * np.stack([np.sin(angles), 0 * angles, np.cos(angles)], 1)  # (9, 3)
    c, s = np.cos(tilt), np.sin(tilt)
    return points @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])


def stroke(points: np.ndarray, **given: object) -> set[str]:
    """Sculpt through the operator, as a script does."""
    return bpy.ops.neural_sculpt.stroke(points=collection(points), **given)


def collection(points: np.ndarray) -> list[dict[str, object]]:
    """Points (K, 3) as the operator's property."""
    return [
        {"name": "", "location": tuple(p), "radius_factor": 1.0, "intensity_factor": 1.0}
        for p in points.tolist()
    ]


def vertices(ob: Object) -> np.ndarray:
    """(V, 3) in model space."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def in_world(ob: Object) -> np.ndarray:
    """(V, 3) in the scene."""
    matrix = np.array(ob.matrix_world)
    return vertices(ob) @ matrix[:3, :3].T + matrix[:3, 3]


def push_undo(message: str) -> None:
    """As Blender does after an operator of the artist."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo_push(message=message)


def undo() -> None:
    """Ctrl Z."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo()


def redo() -> None:
    """Shift Ctrl Z."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.redo()


def state(ob: Object) -> tuple[object, ...]:
    """Everything that makes the field, to compare exactly."""
    group = ob.neural_sculpt
    names = ("name", "muted", "uid", "data", "strength", "layer", "layer_id", "context")
    listed = tuple(tuple(getattr(item, name) for name in names) for item in group.strokes)
    properties = group.weights, group.base_weights, listed, group.revision, group.report
    return *properties, vertices(ob).tobytes(), tuple(map(tuple, ob.matrix_world))


def strokes_of(ob: Object) -> list[dict[str, object]]:
    """The listed strokes as in a stroke file."""
    return [json.loads(item.data) | {"name": item.name} for item in ob.neural_sculpt.strokes]


def field(name: str) -> Object:
    """The object again, after undo or a load made all references stale."""
    return bpy.data.objects[name]
