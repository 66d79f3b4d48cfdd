# SPDX-License-Identifier: GPL-3.0-or-later
"""Kills of the worker (SIGKILL) with strokes in computation: each stroke is in the history after.

Blender as a module; the worker is the product's own, forked from a process that has loaded it. One
to three strokes wait; the worker is killed before the first is sent, as it is sent, after a random
time, or when it has written a random share of its answer. A stroke that is not listed once is lost;
one that is muted was not computed again, though its worker died once. Where the strokes were done
before the kill there is another try.
"""

import os
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any
from unittest.mock import patch

from ..attacked import stressed_blender
from ..fork_server import DIE, ForkServer

COUNT = 200
ROLE = "blender"
MOMENTS = ("before", "at once", "later", "answering")
LONGEST = 1.5  # seconds until a kill in mid-computation
PATIENCE = 300.0  # seconds, after which a job hangs
FRESH = 8  # kills with one field
INTENSITY = 0.005  # so low that many strokes on each other stay where they are drawn


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` kills: how many strokes were drawn, listed, muted and lost."""
    failures: list[str] = []
    totals = dict.fromkeys(("kills", "strokes", "lost", "muted"), 0)
    totals |= {f"killed_{moment.replace(' ', '_')}": 0 for moment in MOMENTS}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        harness = stressed_blender.install(Path(name))
        session = harness.module("blender.session.worker_session").session
        server = ForkServer(os.environ["NEURAL_SCULPT_PYTHON"])
        forks = patch.object(harness.module("worker.process"), "start_logged", server.start)
        forks.start()
        drawn: list[str] = []
        number = -1
        while totals["kills"] < count:
            number += 1
            random = Random(f"{seed} {number}")
            if number % FRESH == 0:
                _new_field(harness, session)
                drawn = []
            moment = MOMENTS[number % len(MOMENTS)]
            names = [f"{number}.{stroke}" for stroke in range(random.randint(1, 3))]
            before = session.client.pid
            killed = _kill(harness, session, moment, names, random)
            drawn += names
            _finish(session)
            listed = [(each.name, each.muted) for each in _field(harness).strokes]
            lost = [each for each in drawn if [name for name, _ in listed].count(each) != 1]
            muted = [name for name, is_muted in listed if is_muted and name in names]
            totals["kills"] += killed
            totals[f"killed_{moment.replace(' ', '_')}"] += killed
            totals["strokes"] += len(names)
            totals["lost"] += len(lost)
            totals["muted"] += len(muted)
            if lost or muted or session.last_error:
                said = f"lost {lost}, muted {muted}, said {session.last_error!r}"
                failures.append(f"{number} ({moment}, worker {before}): {said}")
                drawn = [each for each in drawn if each not in lost]
            if number % 10 == 9:
                report(f"{totals}, {len(failures)} failures")
        session.stop()
        forks.stop()
        server.close()
    return {**totals, "failures": failures}


def _new_field(harness: Any, session: Any) -> None:
    """A sphere in an empty scene; from then on operators return at once, as in a window."""
    import bpy

    harness.call_as("Script")
    operators: Any = bpy.ops
    operators.wm.read_homefile(use_empty=True, use_factory_startup=True)
    addon: Any = bpy.context.preferences.addons[harness.EXTENSION]
    addon.preferences.resolution = harness.RESOLUTION
    harness.add("SPHERE")
    harness.call_as("Artist")


def _field(harness: Any) -> Any:
    return harness.field("Sphere").neural_sculpt


def _kill(harness: Any, session: Any, moment: str, names: list[str], random: Random) -> bool:
    """Draw the strokes and kill the worker that computes the first; whether it was in time."""
    pid = session.client.pid
    if moment == "before":
        os.kill(pid, signal.SIGKILL)
    if moment == "answering":
        (session.client.folder / DIE).write_text(str(random.random()))
    for name in names:
        arc = harness.arc(harness.field("Sphere"), tilt=random.uniform(-3, 3))
        harness.stroke(arc, name=name, intensity=INTENSITY)
    if moment == "at once":
        os.kill(pid, signal.SIGKILL)
    elif moment == "later":
        end = time.monotonic() + random.uniform(0, LONGEST)
        while time.monotonic() < end and session.jobs:
            session.poll_once()
            time.sleep(0.001)
        if not session.jobs:
            return False
        os.kill(pid, signal.SIGKILL)
    elif moment == "answering":
        end = time.monotonic() + PATIENCE
        while session.client.pid == pid:
            if time.monotonic() > end:
                raise TimeoutError("the worker did not answer")
            session.poll_once()
    return True


def _finish(session: Any) -> None:
    """Poll until nothing waits."""
    end = time.monotonic() + PATIENCE
    while session.jobs:
        if time.monotonic() > end:
            raise TimeoutError("a job hangs")
        session.poll_once()
        time.sleep(0.005)
