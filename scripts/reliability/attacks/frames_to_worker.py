# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutated requests to a running worker: it answers once, or ends by itself and says why.

The worker is the product's own, forked from a process that has loaded it. A frame that the protocol
refuses ends its worker, whatever else it is: the protocol reads each such frame here, and only
every tenth goes to a worker, which has no torch and so ends in milliseconds. All others go to one
with torch and the real jobs. A signal, another exit code than 1, a silence of PATIENCE seconds, two
final answers or one that is not of the protocol are failures. `defects` counts answers that ask for
a report: what the job did not expect, and the worker went on.
"""

import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random
from subprocess import TimeoutExpired
from typing import Any
from unittest.mock import patch

from ..fork_server import ForkServer
from ..mutations import mutated_frame

COUNT = 100_000
ROLE = "worker"
PATIENCE = 120.0  # seconds, after which a worker hangs
MOST_MEMORY = 8 << 30  # bytes of addresses that a worker may have
SENT = 10  # of so many frames that the protocol refuses one is sent
WEIGHTS = {
    **{"measure": 1, "edit": 5, "smooth": 2, "absorb_stroke": 5, "replay": 20},
    **{"boolean": 0.2, "boolean mesh": 0.2},
}
"""How often what takes seconds or a part of one is asked for; what takes milliseconds: 100."""
KIND = {"smooth": "edit", "boolean mesh": "boolean"}
"""Of requests that have another name here."""
TICK = 0.002  # seconds between two looks at a worker that has not ended


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` requests that are sent: how the workers answered or ended, and what was not sent."""
    words = "results", "errors", "defects", "passed_over", "workers_ended", "refused_unsent"
    totals: dict[str, int] = dict.fromkeys(words, 0)
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        log = Path(name) / "log"
        workers = {bare: Workers(sys.executable, bare, log) for bare in (True, False)}
        sound = _requests(Path(name))
        number, sent, refused = -1, 0, 0
        while sent < count:
            number += 1
            random = Random(f"{seed} {number}")
            frame = mutated_frame(sound(number + 1, random), random)
            is_read = _is_read(frame)
            refused += not is_read
            if not is_read and refused % SENT:
                totals["refused_unsent"] += 1
                continue
            sent += 1
            place = workers[not is_read]
            outcome, detail = _outcome(place.worker(), frame, number)
            if outcome == "defects":
                report(f"request {number}: {detail}")
            if outcome == "broken":
                failures.append(f"{number} (seed {seed}): {detail}")
            else:
                totals[outcome] += 1
            if outcome in ("broken", "workers_ended"):
                place.end()
            if sent % 5_000 == 0:
                report(f"{sent} requests, {totals}, {len(failures)} failures")
        for place in workers.values():
            place.end()
            place.server.close()
        os.chdir("/")
    return {**totals, "failures": failures}


class Workers:
    """One worker after another, each with its torch or without."""

    def __init__(self, python: str, bare: bool, log: Path) -> None:
        """None is started yet."""
        self.server = ForkServer(python, "bare" if bare else "torch")
        self._log, self._worker = log.with_suffix(f".{bare}"), None

    def worker(self) -> Any:
        """The one that runs, a `WorkerProcess`."""
        from neural_sculpt_addon.worker import process

        if self._worker is None:
            with patch.object(process, "start_logged", self.server.start):
                self._worker = process.WorkerProcess([], self._log)
            with suppress(ProcessLookupError):
                limit = (MOST_MEMORY, MOST_MEMORY)
                resource.prlimit(self._worker.pid, resource.RLIMIT_AS, limit)
        return self._worker

    def end(self) -> None:
        """End the one that runs."""
        if self._worker is not None:
            self._worker.kill()
            self._worker = None


def _is_read(frame: bytes) -> bool:
    """Whether the protocol reads it; where it errs, the worker that gets it shows that."""
    import io

    from neural_sculpt_addon.worker import protocol

    stream: Any = io.BytesIO(frame)
    try:
        return protocol.read(stream) is not None
    except protocol.ProtocolError:
        return False


def _send(worker: Any, frame: bytes) -> None:
    """Put a request as `mailbox.Outbox` does, and ring; a dead worker is no error here."""
    requests = worker.requests
    (requests.folder / "part").write_bytes(frame)
    (requests.folder / "part").rename(requests.folder / str(requests.count))
    requests.count += 1
    worker.ring(b".")


def _outcome(worker: Any, frame: bytes, number: int) -> tuple[str, str]:
    """What the worker did with a frame, with a word on what is not usual.

    A sound request follows the mutated one, which a worker that goes on must answer.
    """
    from neural_sculpt_addon.common.text import from_json
    from neural_sculpt_addon.worker.protocol import MessageKind

    probe = 10**9 + number
    _send(worker, frame)
    _send(worker, _bytes("mesh", probe, {"revision": "none", "state": 0, "resolution": 8}))
    try:
        finals = _finals(worker, probe)
    except (AssertionError, TimeoutError) as error:
        return "broken", str(error)
    if finals is None:
        return "workers_ended", ""
    if not finals:
        return "passed_over", ""
    final = finals[0]
    if final.kind is not MessageKind.ERROR:
        return "results", ""
    said = from_json(final.fields["message"])
    return "defects" if final.fields["detail"] else "errors", said


def _finals(worker: Any, probe: int) -> list[Any] | None:
    """The answer, if there was one, until that to `probe`; None when the worker has ended."""
    from neural_sculpt_addon.worker import answers
    from neural_sculpt_addon.worker.process import Exit
    from neural_sculpt_addon.worker.protocol import FINAL

    finals, end = [], time.monotonic() + PATIENCE
    while time.monotonic() < end:
        message = worker.take()
        if message is None:
            with suppress(TimeoutExpired):
                worker.child.wait(TICK)
            continue
        if isinstance(message, Exit):
            _check_end(worker, message)
            return None
        if why := answers.why_malformed(message):
            raise AssertionError(why)
        if message.kind in FINAL and message.job == probe:
            if len(finals) > 1:
                raise AssertionError(f"{len(finals)} answers")
            return finals
        if message.kind in FINAL:
            finals.append(message)
    raise TimeoutError(f"it was silent for {PATIENCE} s")


def _check_end(worker: Any, ended: Any) -> None:
    """A worker ends by itself and says why."""
    said = worker.log.read_text(errors="replace")
    if worker.child.returncode != 1 or "cannot read its requests" not in said:
        raise AssertionError(f"{ended.reason}: {ended.log_tail[-300:]}")


def _requests(folder: Path) -> Callable[[int, Random], bytes]:
    """Sound requests about a sphere, by number and chance."""
    import numpy as np

    from neural_sculpt_addon.field import checkpoint
    from neural_sculpt_addon.field.edit.layers import digest
    from neural_sculpt_addon.field.mesh.proxy import extract
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.stroke import Kind, Stroke

    field = primitive("sphere")
    checkpoint.save(field, folder / "in.safetensors")
    data = checkpoint.to_bytes(field)
    base = digest(data)
    held = {base: np.frombuffer(data, np.uint8)}
    points = 0.6 * np.eye(3)[[0, 0, 0]] + [[0, 0, 0], [0, 0.02, 0], [0, 0.04, 0]]
    stroke = Stroke(points, Brush(0.05, 0.02)).to_json()
    of = {"state": {"base": base, "layers": []}, "revision": "r", "resolution": 16}
    made = {**of, "result_revision": "s"}
    box = {"vertices": np.eye(4, 3, dtype="<f8"), "triangles": np.eye(4, 3, dtype="<i8")}
    fit = {"preset": "draft", "detail": False, "width": 64, "thickness": None, "seed": 0}
    entry = {"stroke": stroke, "layer": None, "context": "", "strength": 1.0}
    replay = {"base": base, "entries": [entry], "solver": "local", **made}
    smooth = Stroke(points, Brush(0.05, 0.5), kind=Kind.SMOOTH).to_json()
    patch = extract(field, 16)
    part = patch.vertices[:, 0] > 0
    whole = patch.triangles[part[patch.triangles].all(axis=1)]
    used, numbered = np.unique(whole, return_inverse=True)
    before = patch.vertices[used]
    moved = {"before": before, "after": before * np.float32(1.01)}
    brushed = {**moved, "triangles": numbered.reshape(-1, 3).astype("<i4")}
    unite = {**made, "operation": "union", "blend": 0.0}
    beside = np.eye(4) + 0.2 * np.eye(4, k=3)  # by 0.2 along X
    other = {"other": of, "matrix": beside.ravel().tolist()}
    corners = 0.7 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f8")
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], "<i8")
    tetrahedron = {"vertices": corners, "triangles": faces}
    kinds: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
        "edit": ({"stroke": stroke, "solver": "local", **made}, held),
        "replay": (replay, held),
        "measure": ({"revision": "s", "result_revision": "s"}, {}),
        "mesh": (of, held),
        "fit": ({"resolution": 16, **fit}, box),
        "absorb_proxy": (made, {**held, **box}),
        "smooth": ({"stroke": smooth, "solver": "local", **made}, held),
        "absorb_stroke": ({**made, "remesh": False, "keep": False}, {**held, **brushed}),
        "boolean": ({**unite, **other}, held),
        "boolean mesh": (unite, {**held, **tetrahedron}),
        "load": ({"path": "in.safetensors", "resolution": 16}, {}),
        "save": ({**of, "path": "out.safetensors"}, held),
        "sample": ({**of, "resolution": 8}, held),
        "prepare": (of, held),
        "apply_to_base": (of, held),
        "consolidate": ({**made, "width": 0}, held),
        "cancel": ({}, {}),
        "enough": ({}, {}),
    }
    names, weights = list(kinds), [WEIGHTS.get(name, 100) for name in kinds]

    def request(job: int, random: Random) -> bytes:
        (kind,) = random.choices(names, weights)
        fields, arrays = kinds[kind]
        return _bytes(KIND.get(kind, kind), job, fields, arrays)

    return request


def _bytes(kind: str, job: int, fields: Any, arrays: Any = None) -> bytes:
    import io

    from neural_sculpt_addon.worker import protocol

    stream: Any = io.BytesIO()
    known: Any = {each.value: each for each in (*protocol.JobKind, *protocol.ControlKind)}
    protocol.write(stream, protocol.Message(known[kind], job, fields, arrays or {}))
    return stream.getvalue()
