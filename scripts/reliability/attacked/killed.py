# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender that computes strokes until it is killed: what the attack `blender_kills` starts.

    python scripts/in_blender/start.py reliability.attacked.killed FOLDER [end]

With `end` it starts a worker and leaves. It prints the number of its worker's process when a stroke
is in computation.
"""

import time
from pathlib import Path

from . import stressed_blender

INTENSITY = 0.005  # so low that many strokes on each other stay where they are drawn


def main(given: list[str]) -> None:
    """Draw one stroke after another."""
    harness = stressed_blender.install(Path(given[0]))
    session = harness.module("blender.session.worker_session").session
    harness.bpy.context.preferences.addons[harness.EXTENSION].preferences.resolution = 48
    harness.add("SPHERE")
    if "end" in given:
        session.stop()
        return
    harness.call_as("Artist")
    while True:
        arc = harness.arc(harness.field("Sphere"))
        harness.stroke(arc, intensity=INTENSITY)
        print(f"worker {session.client.pid}", flush=True)
        while session.jobs:
            session.poll_once()
            time.sleep(0.005)
