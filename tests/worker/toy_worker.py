# SPDX-License-Identifier: GPL-3.0-or-later
"""A real worker with jobs that a test can steer: slow, deaf, noisy, failing, crashing.

Started as `python -I -u toy_worker.py ROOT [STUCK]`, seconds as in `pulse`; runs the package's own
server without torch.
"""

import os
import sys
import time

sys.path.insert(0, sys.argv[1])

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.common.text import Text
from neural_sculpt_addon.worker import pulse
from neural_sculpt_addon.worker.protocol import JobKind
from neural_sculpt_addon.worker.server.payload import MissingError, Payload
from neural_sculpt_addon.worker.server.server import take_over

FAILURES = {
    "sculpt": SculptError("{}: {}", "Stroke 2", SculptError("The stroke is {} off.", 0.25)),
    "value": ValueError("a defect"),
    "memory": MemoryError(),
    "missing": MissingError(["one", "two"]),
}


def echo(job, progress):
    """Everything back as it came."""
    return Payload(job.fields, job.arrays)


def slow(job, progress):
    """Report every 10 ms, for `seconds`, or less where that will do; all arrays come back as a
    preview at once."""
    steps = int(job.fields["seconds"] * 100)
    if job.arrays:
        job.preview(Payload({"shown": True}, job.arrays))
    for step in range(steps):
        if job.enough():
            return Payload({"slept": False})
        progress(step / steps, Text("step {}", f"{step:06}"))
        time.sleep(0.01)
    return Payload({"slept": True})


def compute(job, progress):
    """Compute for `seconds` without a report and with Python's lock, which it gives up seldom."""
    end = time.monotonic() + job.fields["seconds"]
    while time.monotonic() < end:
        sorted(range(10**6), key=lambda n: -n)
    return Payload()


def fail(job, progress):
    """Fail as `how` says; by default with a result that no frame can carry."""
    if job.fields["how"] in FAILURES:
        raise FAILURES[job.fields["how"]]
    return Payload({"nan": float("nan")})


def crash(job, progress):
    """Leave without a word to the client, but with one to the log."""
    sys.stderr.write("the last words\n")
    os._exit(3)


def noise(job, progress):
    """Print, from Python and from below."""
    print("not a frame")
    os.write(1, b"not a frame either\n")
    return Payload({"stdin": sys.stdin.read()})


HANDLERS = {
    JobKind.MESH: echo,
    JobKind.EDIT: slow,
    JobKind.LOAD: fail,
    JobKind.SAVE: crash,
    JobKind.PREPARE: noise,
    JobKind.SAMPLE: compute,
}

if __name__ == "__main__":
    pulse.STUCK = float(sys.argv[2]) if len(sys.argv) > 2 else pulse.STUCK
    take_over().serve(HANDLERS, {"torch": None, "device": "cpu", "python": sys.version})
