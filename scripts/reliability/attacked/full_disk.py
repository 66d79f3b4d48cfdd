# SPDX-License-Identifier: GPL-3.0-or-later
"""A full disk in Blender as a module; the attack `disk_full` reads what is printed.

    python scripts/in_blender/start.py reliability.attacked.full_disk FOLDER STEP

FOLDER is a disk of its own (see disk.py); every STEP-th place is tried. The worker is the product's
own, forked from a process that has loaded it.
"""

import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

from .. import disk
from ..fork_server import FULL, ForkServer
from . import stressed_blender

PATIENCE = 300.0  # seconds, after which a job hangs
RESOLUTION = 16  # cells; a small mesh has few pages
MOST = 1000  # places of one target; it has fewer

Target = Callable[[], str]


class Attack:
    """The targets, and a Blender to try them in."""

    def __init__(self, folder: Path) -> None:
        """With everything on the disk `folder`."""
        self.folder = folder
        tempfile.tempdir = str(folder / "temporary")
        Path(tempfile.tempdir).mkdir()
        (folder / "user").mkdir()
        self.harness = stressed_blender.install(folder / "user")
        self.session = self.harness.module("blender.session.worker_session").session
        server = ForkServer(os.environ["NEURAL_SCULPT_PYTHON"])
        self.harness.module("worker.process").start_logged = server.start
        self.drawn = 0
        self.scene()

    def scene(self) -> None:
        """A sphere in an empty scene; from then on operators return at once, as in a window."""
        import bpy

        disk.clear(self.folder)
        self.session.cancel()
        self.harness.call_as("Script")
        operators: Any = bpy.ops
        operators.wm.read_homefile(use_empty=True, use_factory_startup=True)
        addon: Any = bpy.context.preferences.addons[self.harness.EXTENSION]
        addon.preferences.resolution = RESOLUTION
        self.harness.add("SPHERE")
        operators.mesh.primitive_ico_sphere_add(subdivisions=1)
        self.harness.call_as("Artist")

    def places(self) -> Iterator[tuple[str, Target, bool]]:
        """Each target, first with a disk that is nearly full from the start, and then with one that
        is full all at once before a message of the worker, whose number counts up."""
        for name in ("stroke", "fit", "export", "save"):
            target = getattr(self, name)
            yield name, target, False
            if name != "save":
                yield name, target, True

    def attempt(self, target: Target, later: bool, number: int) -> str:
        """One target with room for `number` pages, or for as many messages: a word of the totals.

        AssertionError, LookupError.
        """
        self.session.ensure_worker()
        if later:
            process = self.session.client.process
            message = process.answers.count + number
            (process.folder / FULL).write_text(f"{message} {self.folder}")
        else:
            disk.fill(self.folder, number)
        try:
            return target()
        finally:
            disk.clear(self.folder)
            if (client := self.session.client) and client.folder:
                (client.folder / FULL).unlink(missing_ok=True)

    def finish(self) -> None:
        """Poll until nothing waits."""
        end = time.monotonic() + PATIENCE
        while self.session.jobs:
            assert time.monotonic() < end, "a job hangs"
            self.session.poll_once()
            time.sleep(0.002)

    def stroke(self) -> str:
        """It must be in the history, muted at worst."""
        self.activate("Sphere")
        self.drawn += 1
        name = str(self.drawn)
        arc = self.harness.arc(self.harness.field("Sphere"), tilt=self.drawn)
        self.harness.stroke(arc, name=name, intensity=0.005)
        self.finish()
        strokes = self.harness.field("Sphere").neural_sculpt.strokes
        found = [each for each in strokes if each.name == name]
        if len(found) != 1:
            raise LookupError(f"listed {len(found)} times; {self.session.last_error!r}")
        if found[0].muted:
            check_words(self.session.last_error)
            return "kept_muted"
        return "went_through"

    def fit(self) -> str:
        """It must add a field or say why not."""
        import bpy

        self.activate("Icosphere")
        before = len(bpy.data.objects)
        operators: Any = bpy.ops
        said = self.said(lambda: operators.neural_sculpt.from_mesh(preset="DRAFT", width="64"))
        if said:
            assert len(bpy.data.objects) == before, "an object is left of a fit that failed"
            return "said_why"
        bpy.data.objects.remove(bpy.data.objects["Icosphere Field"])
        bpy.data.objects["Icosphere"].hide_set(False)
        return "went_through"

    def export(self) -> str:
        """It must leave the old file, or a new one that is whole."""
        import bpy

        self.activate("Sphere")
        operators: Any = bpy.ops
        return self.written(
            "field.safetensors",
            lambda path: self.said(lambda: operators.neural_sculpt.export(filepath=path)),
        )

    def save(self) -> str:
        """The same, of Blender itself."""
        import bpy

        operators: Any = bpy.ops

        def save(path: str) -> str:
            try:
                operators.wm.save_as_mainfile(filepath=path, copy=True, compress=False)
            except RuntimeError as error:
                return str(error)
            return ""

        return self.written("scene.blend", save)

    def written(self, name: str, write: Callable[[str], str]) -> str:
        """Write over an old file."""
        path = self.folder / name
        old = path.read_bytes() if path.exists() else b""
        said = write(str(path))
        left = [each.name for each in self.folder.iterdir() if each.name.startswith(f".{name}")]
        assert not left, f"left behind: {left}"
        if said:
            assert (path.read_bytes() if path.exists() else b"") == old, "the old file is damaged"
            return "said_why"
        return "went_through"

    def said(self, operator: Callable[[], object]) -> str:
        """What an operator and its job said, when they failed."""
        try:
            operator()
        except RuntimeError as error:
            check_words(str(error))
            return str(error)
        self.finish()
        if self.session.last_error:
            check_words(self.session.last_error)
        return self.session.last_error

    def activate(self, name: str) -> None:
        """Make an object the one that operators work on."""
        import bpy

        bpy.context.view_layer.objects.active = bpy.data.objects[name]


def check_words(text: str) -> None:
    """What the artist is told is a sentence."""
    assert "Traceback" not in text and text.strip().endswith((".", "?")), f"no sentence: {text!r}"


def main(given: list[str]) -> None:
    """Try every place; a target is done when it went through."""
    folder, step = Path(given[0]), int(given[1])
    attack = Attack(folder)
    stressed_blender.tell_version()
    words = "tries", "went_through", "said_why", "kept_muted", "lost"
    totals: dict[str, int] = dict.fromkeys(words, 0)
    failures: list[str] = []
    for name, target, later in attack.places():
        for number in count(0, step):
            totals["tries"] += 1
            try:
                outcome = attack.attempt(target, later, number)
            except Exception as error:  # noqa: BLE001 - which is what the attack looks for
                outcome = "lost"
                place = f"before message {number}" if later else f"after {number} pages"
                said = f"{type(error).__name__}: {error!s:.200}"
                failures.append(f"{name}, full {place}: {said}")
                attack.scene()
            totals[outcome] += 1
            if outcome == "went_through" or number > MOST:
                break
        print(json.dumps({**totals, "failures": failures}), flush=True)
    attack.session.stop()
    sys.stdout.flush()
    os._exit(0)
