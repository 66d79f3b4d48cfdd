# SPDX-License-Identifier: GPL-3.0-or-later
"""The stroke benchmark inside Blender: the milliseconds of each step.

    python scripts/in_blender/start.py in_blender.stroke EXTENSION.zip FOLDER

Reads FOLDER/strokes.json, the cells per axis and for each stroke the file of its field, its name
and its stroke file's text, and writes FOLDER/rows.json, for each stroke the milliseconds of each
step. Runs in a Python with bpy.
"""

import importlib
import itertools
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from workshop import ROOT

EXTENSION = "bl_ext.user_default.neural_sculpt"
WORKER = ROOT / "scripts" / "benchmarking" / "timed_worker.py"
STEPS = ("submit", "problem", "solve", "proxy", "arrays", "send", "commit")
SECONDS = 600


def main(given: list[str]) -> None:
    """Install the extension, sculpt, write the rows."""
    extension, folder = map(Path, given)
    notes = folder / "notes.jsonl"
    os.environ["BLENDER_USER_RESOURCES"] = str(folder)  # before bpy is imported
    import bpy

    operators: Any = bpy.ops
    operators.extensions.package_install_files(
        filepath=str(extension), repo="user_default", enable_on_install=True
    )
    environment: Any = importlib.import_module(f"{EXTENSION}.worker.install.environment")
    python = os.environ[environment.ENVIRONMENT_VARIABLE]
    worker = [python, "-I", "-u", str(WORKER), str(ROOT), str(notes)]
    environment.worker_command = lambda *_: worker
    addon: Any = bpy.context.preferences.addons[EXTENSION]
    session = importlib.import_module(f"{EXTENSION}.blender.session.worker_session").session
    caller = importlib.import_module(f"{EXTENSION}.blender.session.caller")
    prepare = importlib.import_module(f"{EXTENSION}.blender.session.stroke_jobs").prepare_job
    preview: Any = importlib.import_module(f"{EXTENSION}.blender.scene.mesh.preview").preview
    preview.goes_on = lambda: True  # for `_poll` does what timers do
    addon.preferences.resolution, strokes = json.loads((folder / "strokes.json").read_text())
    rows = []
    for path, name, text in strokes:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        session.caller = caller.Script()
        operators.neural_sculpt.add(kind="FILE", filepath=path)
        ob: Any = bpy.context.active_object
        session.caller = caller.Artist()
        session.submit(prepare(ob))
        _poll(session, lambda: not session.jobs)
        steps = _sculpt(session, text, notes)
        rows.append({"stroke": name, "triangles": len(ob.data.polygons), **steps})
        session.cancel()
        session.drop_behind()
    (folder / "rows.json").write_text(json.dumps(rows))
    sys.stdout.flush()
    os._exit(0)  # some Blenders hang in a regular exit of their Python module


def _sculpt(session: Any, text: str, notes: Path) -> dict[str, float]:
    """One stroke until its result is in the scene: milliseconds of each step."""
    import bpy

    def listed() -> int:
        return len(bpy.context.active_object.neural_sculpt.strokes)  # pyright: ignore[reportAttributeAccessIssue]

    operators: Any = bpy.ops
    count, start, worked = listed(), time.perf_counter(), time.thread_time()
    operators.neural_sculpt.stroke(stroke_json=text)
    submitting = time.thread_time() - worked
    seen, commit, polling = _poll(session, lambda: listed() > count)
    if session.last_error:  # the stroke is listed, muted
        sys.exit(session.last_error)
    ends = json.loads(notes.read_text(encoding="utf-8").splitlines()[-1])
    times = [start, *(ends[step] for step in STEPS[:5]), seen, seen + commit]
    steps = {step: b - a for step, (a, b) in zip(STEPS, itertools.pairwise(times), strict=True)}
    steps |= {"total": times[-1] - start, "blocked": max(submitting, polling)}
    return {step: 1000 * seconds for step, seconds in steps.items()}


def _poll(session: Any, until: Callable[[], bool]) -> tuple[float, float, float]:
    """Look for news, and go on with the preview, as timers do, until something is so: when the last
    look began, how long it took, and the most that this thread worked at a time."""
    import bpy

    tick = importlib.import_module(f"{EXTENSION}.blender.panels.session_display").TICK
    preview = importlib.import_module(f"{EXTENSION}.blender.scene.mesh.preview").preview
    end, most = time.monotonic() + SECONDS, 0.0
    while time.monotonic() < end:
        time.sleep(tick)
        worked = time.thread_time()
        preview.catch_up()
        bpy.context.view_layer.update()
        most = max(most, time.thread_time() - worked)
        start, worked = time.perf_counter(), time.thread_time()
        session.poll_once()
        bpy.context.view_layer.update()
        most = max(most, time.thread_time() - worked)
        if until():
            return start, time.perf_counter() - start, most
    sys.exit(f"The worker has not answered within {SECONDS} s. {session.last_error}")
