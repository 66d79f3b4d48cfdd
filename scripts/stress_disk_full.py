# SPDX-License-Identifier: GPL-3.0-or-later
"""No room on the disk in a stroke, a fit, an export and a save: nothing half-written, no loss.

Blender as a module with the real worker, both with a limit to the size of any file
(RLIMIT_FSIZE), which steps from nothing to more than the largest file has. A stroke must be in the
history, muted at worst; a fit must add a field or say why not; an export and a save must leave
the old file or a new one that is whole.
"""

import os
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any

import stressed_blender

COUNT = 200
ROLE = "blender"
TARGETS = ("stroke", "fit", "export", "save")
LARGEST = 2_000_000  # bytes; more than any file here
PATIENCE = 300.0  # seconds, after which a job hangs


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` limits, each target in turn: how many were met with and without room."""
    failures: list[str] = []
    totals: dict[str, int] = dict.fromkeys(("went_through", "said_why", "kept_muted", "lost"), 0)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        harness = stressed_blender.install(Path(name))
        session = harness.module("blender.session.worker_session").session
        _scene(harness, session)
        for number in range(count):
            random = Random(f"{seed} {number}")
            target = TARGETS[number % len(TARGETS)]
            limit = int(LARGEST ** random.random()) - 1
            try:
                totals[_try(target, harness, session, Path(name), number, limit)] += 1
            except Exception as error:  # noqa: BLE001 - which is what the attack looks for
                totals["lost"] += isinstance(error, LookupError)
                said = f"{type(error).__name__}: {error!s:.200}"
                failures.append(f"{number} ({target}, {limit} bytes, seed {seed}): {said}")
                _scene(harness, session)
            if number % 20 == 19:
                report(f"{totals}, {len(failures)} failures")
        session.stop()
    return {**totals, "failures": failures}


def _scene(harness: Any, session: Any) -> None:
    """A sphere in an empty scene."""
    import bpy

    session.cancel()
    session.waits = True
    operators: Any = bpy.ops
    operators.wm.read_homefile(use_empty=True, use_factory_startup=True)
    addon: Any = bpy.context.preferences.addons[harness.EXTENSION]
    addon.preferences.resolution = harness.RESOLUTION
    harness.add("SPHERE")


@contextmanager
def _no_room(session: Any, limit: int) -> Iterator[None]:
    """No file of this process and the worker's, and of those that they start, gets larger."""
    whole = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
    for number in (os.getpid(), session.client.pid):
        resource.prlimit(number, resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        yield
    finally:
        pid = session.client and session.client.pid  # of another one, when the first died
        for number in filter(None, (os.getpid(), pid)):
            with suppress(ProcessLookupError):
                resource.prlimit(number, resource.RLIMIT_FSIZE, whole)


def _try(target: str, harness: Any, session: Any, folder: Path, number: int, limit: int) -> str:
    """One target under one limit: a word of the totals. AssertionError, LookupError."""
    session._ensure_worker()
    if target == "stroke":
        return _stroke(harness, session, str(number), limit)
    if target == "fit":
        return _fit(harness, session, limit)
    return _write(target, harness, session, folder, limit)


def _stroke(harness: Any, session: Any, name: str, limit: int) -> str:
    import bpy

    ob = harness.field("Sphere")
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    session.waits = False
    with _no_room(session, limit):
        harness.stroke(harness.arc(ob, tilt=int(name)), name=name, intensity=0.005)
        end = time.monotonic() + PATIENCE
        while session.jobs and time.monotonic() < end:
            session.poll_once()
            time.sleep(0.005)
    assert not session.jobs, "a job hangs"
    session.waits = True
    found = [each for each in harness.field("Sphere").neural_sculpt.strokes if each.name == name]
    if len(found) != 1:
        raise LookupError(f"listed {len(found)} times; {session.last_error!r}")
    if found[0].muted:
        assert session.last_error.endswith("."), "muted without a word"
        return "kept_muted"
    return "went_through"


def _fit(harness: Any, session: Any, limit: int) -> str:
    import bpy

    before = len(bpy.data.objects)
    try:
        with _no_room(session, limit):
            ob = harness.add("TORUS")
    except RuntimeError as error:
        _check_words(str(error))
        assert len(bpy.data.objects) == before, "an object is left of a fit that failed"
        return "said_why"
    bpy.data.objects.remove(ob)
    return "went_through"


def _write(target: str, harness: Any, session: Any, folder: Path, limit: int) -> str:
    """Export or save over an old file."""
    import bpy

    operators: Any = bpy.ops
    path = folder / {"export": "field.safetensors", "save": "scene.blend"}[target]
    old = path.read_bytes() if path.exists() else b""
    bpy.context.view_layer.objects.active = harness.field("Sphere")
    try:
        with _no_room(session, limit):
            if target == "export":
                operators.neural_sculpt.export(filepath=str(path))
            else:
                operators.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
    except RuntimeError as error:
        if target == "export":
            _check_words(str(error))
        now = path.read_bytes() if path.exists() else b""
        assert now == old, "the old file is not what it was"
        outcome = "said_why"
    else:
        outcome = "went_through"
    left = [each.name for each in folder.iterdir() if each.name.startswith(f".{path.name}")]
    assert not left, f"left behind: {left}"
    return outcome


def _check_words(text: str) -> None:
    assert "Traceback" not in text and text.strip().endswith("."), f"no sentence: {text}"
