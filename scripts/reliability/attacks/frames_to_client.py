# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutated answers to a running client: each job ends once, and what is believed is sound.

The worker is a process that only stays; its answers are written here. A job must end with exactly
one final message, a client must go on after a message that ends nothing, and a result that passes
`answers.check` must have a finite mesh with indices in range.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from ..mutations import mutated_frame

COUNT = 100_000
ROLE = "worker"
KINDS = "edit", "edit", "replay", "absorb_stroke", "boolean", "consolidate", "measure"
PATIENCE = 60.0  # seconds, after which a client hangs


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` answers: what the client made of them."""
    from neural_sculpt_addon.worker.client import Client

    totals = {"results": 0, "refused": 0, "errors": 0, "passed_over": 0, "workers_ended": 0}
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        client = Client(["/bin/cat"], Path(folder) / "log")
        for number in range(count):
            try:
                outcome = _answer(client, Random(f"{seed} {number}"))
            except Exception as error:  # noqa: BLE001 - which is what the attack looks for
                failures.append(f"{number} (seed {seed}): {type(error).__name__}: {error!s:.200}")
                client = Client(["/bin/cat"], Path(folder) / "log")
            else:
                totals[outcome] += 1
            if number % 10_000 == 9_999:
                report(f"{number + 1} answers, {len(failures)} failures")
        client.stop()
    return {**totals, "failures": failures}


def _answer(client: Any, random: Random) -> str:
    """Answer one job with a mutated frame, and then, where that is no end, with a sound one."""
    from neural_sculpt_addon.worker import answers
    from neural_sculpt_addon.worker.client import JobKind, MessageKind
    from neural_sculpt_addon.worker.protocol import ProtocolError

    client.start()
    kind = JobKind(random.choice(KINDS))
    job = client.submit(kind, {})
    process = client.process
    _put(process, mutated_frame(_frame(kind, job, random), random))
    finals = _finals(client, process)
    passed_over = not finals
    if passed_over:
        _put(process, _bytes(MessageKind.ERROR, job, {"message": "An end.", "detail": ""}))
        finals = _finals(client, process)
    if [message.job for message in finals] != [job] or client.poll_once():
        raise AssertionError(f"the job ended {len(finals)} times")
    if passed_over:
        return "passed_over"
    (final,) = finals
    if final.fields.get("died"):
        return "workers_ended"
    if final.kind is not MessageKind.RESULT:
        return "errors"
    try:
        answers.check(kind, final)
    except ProtocolError:
        return "refused"
    _check_mesh(final.arrays)
    return "results"


def _finals(client: Any, process: Any) -> list[Any]:
    """What ended a job, as soon as all that was sent is read."""
    from neural_sculpt_addon.worker.protocol import FINAL

    end, news = time.monotonic() + PATIENCE, []
    requests = process.answers
    while time.monotonic() < end:
        before = requests.count
        news += [message for message in client.poll_once() if message.kind in FINAL]
        if not client.alive or (requests.count == before and not requests.amid):
            return news
    raise TimeoutError("the client hangs")


def _put(process: Any, frame: bytes) -> None:
    """Answer as a worker does."""
    folder = process.folder / "answers"
    (folder / "part").write_bytes(frame)
    (folder / "part").rename(folder / str(process.answers.count))


def _frame(asked: str, job: int, random: Random) -> bytes:
    """A sound message about a job of a kind."""
    import numpy as np

    from neural_sculpt_addon.worker.client import MessageKind

    kind = random.choice([MessageKind.RESULT, MessageKind.RESULT, *MessageKind])
    if kind is not MessageKind.RESULT:
        fields = {"fraction": 0.5, "message": "Half.", "detail": "", "protocol": 3}
        return _bytes(kind, job, fields)
    some, points, report = np.ones(9, np.uint8), np.eye(3, dtype=np.float32), {"error_mean": 0.1}
    mesh = {
        "vertices": points,
        "normals": points,
        "triangles": np.array([[0, 1, 2]], np.int32),
        "edges": np.array([[0, 1], [1, 2], [0, 2]], np.int32),
        "corner_edges": np.array([[0, 1, 2]], np.int32),
    }
    layer = {"revision": "new", "layer": "id", "context": ""}
    layers = [{"id": "id", "context": ""}, {"id": "other", "context": ""}]
    snapped = {"layer": some, "snapped": points, "snapped_normals": points}
    fields, arrays = {
        "edit": ({**layer, "seconds": 1.0}, {"layer": some, **mesh}),
        "replay": ({"revision": "new", "layers": layers}, {"layer.1": some, **mesh}),
        "absorb_stroke": ({**layer, "report": report, "stretched": False}, snapped),
        "boolean": ({**layer, "report": report}, {"layer": some, **mesh}),
        "consolidate": (
            {"revision": "new", "id": "id", "report": report},
            {"field": some, **mesh},
        ),
        "measure": ({"report": report}, {}),
    }[asked]
    return _bytes(kind, job, fields, arrays)


def _bytes(kind: Any, job: int, fields: Any, arrays: Any = None) -> bytes:
    import io

    from neural_sculpt_addon.worker import protocol

    stream: Any = io.BytesIO()
    protocol.write(stream, protocol.Message(kind, job, fields, arrays or {}))
    return stream.getvalue()


def _check_mesh(arrays: Any) -> None:
    """Independent of what the product checks."""
    for name in ("vertices", "normals", "snapped", "snapped_normals"):
        values = arrays[name].ravel().tolist() if name in arrays else []
        if not all(abs(value) < 3.5e38 for value in values):
            raise AssertionError(f"{name} are not finite")
    if "vertices" not in arrays:
        return
    for name, into in (("triangles", "vertices"), ("edges", "vertices"), ("corner_edges", "edges")):
        if not all(0 <= value < len(arrays[into]) for value in arrays[name].ravel().tolist()):
            raise AssertionError(f"{name} point beyond {into}")
