# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs as Blender submits them, called without a process: states, strokes and their bytes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from neural_sculpt_addon.common.progress import Progress, silent
from neural_sculpt_addon.field.checkpoint import to_bytes
from neural_sculpt_addon.field.edit.layers import digest
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.worker.protocol import JobKind
from neural_sculpt_addon.worker.server.jobs import Jobs
from neural_sculpt_addon.worker.server.payload import Payload, Task

RESOLUTION = 48
"""Not the one at which fields are sculpted."""


def stroke(x: float = 0.0, y: float = 0.0, radius: float = 0.1, **words: Any) -> dict[str, Any]:
    """A dab on the sphere of radius 0.6."""
    point = [x, y, float(np.sqrt(0.36 - x * x - y * y))]
    return {"points": [point], "radius": radius, "intensity": 0.04, **words}


def run(
    jobs: Jobs,
    kind: JobKind,
    fields: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray] | None = None,
    progress: Progress = silent,
) -> Payload:
    """One job."""
    task = Task(fields, arrays or {}, preview=lambda _: None, enough=lambda: False)
    return jobs.handlers()[kind](task, progress)


class Object:
    """What Blender keeps of a field: its base, its layers, and the bytes of all of them."""

    def __init__(self, field: Field) -> None:
        data = to_bytes(field)
        self.base = digest(data)
        self.bytes = {self.base: np.frombuffer(data, np.uint8)}
        self.layers: list[list[Any]] = []  # [id, strength]
        self.entries: list[dict[str, Any]] = []  # as REPLAY takes them
        self.revision = "0"

    def fields(self, **more: Any) -> dict[str, Any]:
        """The state of a job."""
        state = {"base": self.base, "layers": self.layers}
        return {"state": state, "revision": self.revision, "resolution": RESOLUTION, **more}

    def edit(self, jobs: Jobs, stroke: dict[str, Any], **more: Any) -> Payload:
        """A stroke by the local solver, which becomes part of the history."""
        following = str(int(self.revision) + 1)
        given = {"result_revision": following, **more}
        fields = self.fields(stroke=stroke, solver="local", **given)
        result = run(jobs, JobKind.EDIT, fields, self.bytes)
        self.add(stroke, result)
        return result

    def add(self, stroke: dict[str, Any] | None, result: Payload) -> None:
        """A layer on top."""
        name, context = result.fields["layer"], result.fields["context"]
        self.bytes[name] = result.arrays["layer"]
        self.layers = [*self.layers, [name, 1.0]]
        self.entries.append({"stroke": stroke, "layer": name, "context": context, "strength": 1.0})
        self.revision = result.fields["revision"]
