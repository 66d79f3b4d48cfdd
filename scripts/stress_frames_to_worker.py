# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutated requests to a running worker: it answers once, or ends by itself and says why.

The worker is the product's server with its real jobs, in a process forked from one that has torch,
so that another one takes milliseconds. A signal, another exit code than 1, a silence of PATIENCE
seconds, two final answers or one that is not of the protocol are failures. `defects` counts
answers that ask for a report: what the job did not expect, and the worker went on.
"""

import json
import os
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from mutations import mutated_frame

COUNT = 100_000
ROLE = "worker"
PATIENCE = 120.0  # seconds, after which a worker hangs
MOST_MEMORY = 8 << 30  # bytes of addresses that a worker may have


@dataclass
class Forked:
    """A running worker."""

    pid: int
    bell: int
    folder: Path
    inbox: Any
    sent: int = 0
    code: int | None = None

    def send(self, frame: bytes) -> None:
        """Put a request, as `mailbox.Outbox` does, and ring; a dead worker is no error here."""
        folder = self.folder / "requests"
        (folder / "part").write_bytes(frame)
        (folder / "part").rename(folder / str(self.sent))
        self.sent += 1
        with suppress(OSError):
            os.write(self.bell, b".")

    def ended(self) -> int | None:
        """The exit code, negative for a signal, or None while it runs."""
        if self.code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self.code = os.waitstatus_to_exitcode(status) if pid else None
        return self.code


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` requests: how the workers answered or ended."""
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    os.environ["OMP_NUM_THREADS"] = "1"
    import torch

    from neural_sculpt_addon.worker.jobs import warm_up

    torch.set_num_threads(1)
    warm_up()
    totals = {"results": 0, "errors": 0, "defects": 0, "passed_over": 0, "workers_ended": 0}
    failures: list[str] = []
    defects: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as name:
        folder, worker = Path(name), None
        os.chdir(folder)
        sound = _requests(folder)
        for number in range(count):
            random = Random(f"{seed} {number}")
            worker = worker or _start(folder / f"worker{number}")
            worker.send(mutated_frame(sound(number + 1, random), random))
            outcome, detail = _outcome(worker, number)
            if outcome == "defects":
                defects[detail] = defects.get(detail, 0) + 1
            if outcome == "broken":
                failures.append(f"{number} (seed {seed}): {detail}")
                with suppress(ProcessLookupError):
                    os.kill(worker.pid, signal.SIGKILL)
            else:
                totals[outcome] += 1
            if outcome in ("broken", "workers_ended"):
                worker = None
            if number % 5_000 == 4_999:
                report(f"{number + 1} requests, {totals}, {len(failures)} failures")
        if worker:
            os.close(worker.bell)
            os.waitpid(worker.pid, 0)
        os.chdir("/")
    for detail, times in sorted(defects.items(), key=lambda item: -item[1])[:20]:
        report(f"{times} times: {detail:.150}")
    return {**totals, "failures": failures}


def _start(folder: Path) -> Forked:
    """Fork a worker."""
    from neural_sculpt_addon.worker.mailbox import Inbox

    for name in ("requests", "answers"):
        (folder / name).mkdir(parents=True)
    read, write = os.pipe()
    pid = os.fork()
    if pid == 0:
        _work(read, write, folder)
    os.close(read)
    os.write(write, json.dumps(str(folder)).encode() + b"\n")
    return Forked(pid, write, folder, Inbox(folder / "answers"))


def _work(read: int, write: int, folder: Path) -> None:
    """Be a worker; never returns."""
    import resource

    import torch

    from neural_sculpt_addon.worker.jobs import Jobs
    from neural_sculpt_addon.worker.server import take_over

    try:
        os.close(write)
        os.dup2(read, 0)
        log = os.open(folder.with_suffix(".log"), os.O_WRONLY | os.O_CREAT)
        os.dup2(log, 1)
        os.dup2(log, 2)
        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        take_over().serve(Jobs(torch.device("cpu")).handlers(), {"device": "cpu"})
    finally:
        os._exit(70)


def _outcome(worker: Forked, number: int) -> tuple[str, str]:
    """What the worker did, with a word on what is not usual.

    A sound request follows the mutated one, which a worker that goes on must answer.
    """
    from neural_sculpt_addon.worker.protocol import MessageKind, ProtocolError

    probe = 10**9 + number
    worker.send(_bytes("mesh", probe, {"revision": "none", "state": 0, "resolution": 8}))
    try:
        finals = _finals(worker, probe)
    except (AssertionError, ProtocolError, TimeoutError) as error:
        return "broken", str(error)
    if finals is None:
        return "workers_ended", ""
    if not finals:
        return "passed_over", ""
    final = finals[0]
    if final.kind is not MessageKind.ERROR:
        return "results", ""
    return "defects" if final.fields["detail"] else "errors", final.fields["message"]


def _finals(worker: Forked, probe: int) -> list[Any] | None:
    """The answer, if there was one, until that to `probe`; None when the worker has ended."""
    from neural_sculpt_addon.worker import answers
    from neural_sculpt_addon.worker.protocol import FINAL

    finals, end = [], time.monotonic() + PATIENCE
    while time.monotonic() < end:
        code = worker.ended()  # asked first: what it said last is there then
        message = worker.inbox.take()
        if message is None and code is not None:
            _check_end(worker, code)
            return None
        if message is None:
            time.sleep(0.0005)
            continue
        if why := answers.why_malformed(message):
            raise AssertionError(why)
        if message.kind in FINAL and message.job == probe:
            if len(finals) > 1:
                raise AssertionError(f"{len(finals)} answers")
            return finals
        if message.kind in FINAL:
            finals.append(message)
    raise TimeoutError(f"it was silent for {PATIENCE} s")


def _check_end(worker: Forked, code: int) -> None:
    """A worker ends by itself and says why."""
    os.close(worker.bell)
    log = worker.folder.with_suffix(".log")
    said = log.read_text(errors="replace").strip()
    log.unlink()
    shutil.rmtree(worker.folder)
    if code != 1 or "cannot read its requests" not in said:
        raise AssertionError(f"exit code {code}: {said[-300:]}")


def _requests(folder: Path) -> Callable[[int, Random], bytes]:
    """Sound requests about a sphere, by number and chance."""
    import numpy as np

    from neural_sculpt_addon.field import checkpoint
    from neural_sculpt_addon.field.layers import digest
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.stroke import Stroke

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
    kinds: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
        "edit": ({"stroke": stroke, "solver": "local", **made}, held),
        "replay": (replay, held),
        "measure": ({"revision": "s", "result_revision": "s"}, {}),
        "mesh": (of, held),
        "fit": ({"resolution": 16, **fit}, box),
        "absorb": (made, {**held, **box}),
        "load": ({"path": "in.safetensors", "resolution": 16}, {}),
        "save": ({**of, "path": "out.safetensors"}, held),
        "sample": ({**of, "resolution": 8}, held),
        "prepare": (of, held),
        "flatten": (of, held),
        "consolidate": ({**made, "width": 0}, held),
        "cancel": ({}, {}),
        "enough": ({}, {}),
    }
    names = list(kinds)

    def request(job: int, random: Random) -> bytes:
        kind = random.choice(names)
        fields, arrays = kinds[kind]
        return _bytes(kind, job, fields, arrays)

    return request


def _bytes(kind: str, job: int, fields: Any, arrays: Any = None) -> bytes:
    import io

    from neural_sculpt_addon.worker import protocol

    stream: Any = io.BytesIO()
    known: Any = {each.value: each for each in (*protocol.JobKind, *protocol.ControlKind)}
    protocol.write(stream, protocol.Message(known[kind], job, fields, arrays or {}))
    return stream.getvalue()
