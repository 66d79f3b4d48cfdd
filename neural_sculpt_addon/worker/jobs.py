# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker can do: one handler per kind of job, fields and arrays in, fields and arrays out.

A neural field travels as the bytes of `field.checkpoint.to_bytes` in a uint8 array `field`;
proxies as `vertices`, `normals` (V, 3) float32 and `triangles` (F, 3) int32, in model space.
Torch and the rest are imported by the job that needs them first, or by `warm_up`.
"""

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..stroke.errors import SculptError
from ..stroke.progress import Progress
from ..stroke.stroke import Stroke
from .protocol import JobKind

if TYPE_CHECKING:
    from ..field.network import Siren
    from ..field.prepare import Preparation

T = TypeVar("T")

PREPARATIONS = 8
"""Revisions whose preparations are kept, some 10 MB each: a few objects and steps of undo."""


@dataclass(frozen=True)
class Payload:
    """What goes into a job and what comes out of it."""

    fields: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)


Handler = Callable[[Payload, Progress], Payload]
"""Raises SculptError for the artist, Cancelled when `progress` did."""


def warm_up() -> None:
    """Import what the jobs need, so that the first one need not wait for it."""
    from ..field import checkpoint, edit, fit, prepare, primitives, proxy  # noqa: F401


class Jobs:
    """The handlers and the one thing they remember: preparations by revision."""

    def __init__(self) -> None:
        """Nothing is prepared yet."""
        self._preparations: OrderedDict[str, Preparation] = OrderedDict()

    def handlers(self) -> dict[JobKind, Handler]:
        """The handler of each kind of job."""
        return {
            JobKind.EDIT: self.edit,
            JobKind.MESH: self.mesh,
            JobKind.FIT: self.fit,
            JobKind.LOAD: self.load,
            JobKind.SAVE: self.save,
            JobKind.PREPARE: self.prepare,
        }

    def edit(self, job: Payload, progress: Progress) -> Payload:
        """strokes, solver, epochs, resolution, revision <field> -> reports <field, proxy>."""
        from ..field.edit import edit

        strokes = [Stroke.from_json(stroke) for stroke in _get(job, "strokes", list)]
        result = edit(
            _network(job),
            strokes,
            solver=_get(job, "solver", str),
            epochs=job.fields.get("epochs"),
            preparation=self._prepared(job, _part(progress, 0.0, 0.2)),
            progress=_part(progress, 0.2, 0.8),
        )
        arrays = _model(result.network, job, _part(progress, 0.8, 1.0))
        return Payload({"reports": list(result.reports)}, arrays)

    def mesh(self, job: Payload, progress: Progress) -> Payload:
        """resolution <field> -> <proxy>."""
        return Payload({}, _proxy(_network(job), job, progress))

    def fit(self, job: Payload, progress: Progress) -> Payload:
        """primitive, or method, preset, seed <mesh> -> scale, center, report <field, proxy>."""
        if "primitive" in job.fields:
            from ..field.primitives import primitive

            network = primitive(_get(job, "primitive", str))
            scale, center, report = 1.0, (0.0, 0.0, 0.0), {}
        else:
            from ..field.fit import fit_mesh

            result = fit_mesh(
                _array(job, "vertices"),
                _array(job, "triangles"),
                method=job.fields.get("method", "distance"),
                preset=_get(job, "preset", str),
                seed=_get(job, "seed", int),
                progress=_part(progress, 0.0, 0.9),
            )
            network = result.network
            scale, center, report = result.scale, result.center, result.report
        arrays = _model(network, job, _part(progress, 0.9, 1.0))
        return Payload({"scale": scale, "center": list(center), "report": report}, arrays)

    def load(self, job: Payload, progress: Progress) -> Payload:
        """path, resolution -> widths <field, proxy>."""
        from ..field.checkpoint import load

        network = load(_get(job, "path", str))
        return Payload({"widths": list(network.widths)}, _model(network, job, progress))

    def save(self, job: Payload, progress: Progress) -> Payload:
        """path <field> -> path."""
        from ..field.checkpoint import save

        path = _get(job, "path", str)
        save(_network(job), path)
        return Payload({"path": path})

    def prepare(self, job: Payload, progress: Progress) -> Payload:
        """revision <field> -> nothing; the next edit of that revision starts at once."""
        self._prepared(job, progress)
        return Payload()

    def _prepared(self, job: Payload, progress: Progress) -> "Preparation":
        """The preparation of the job's revision, made unless it is remembered."""
        from ..field.prepare import prepare

        revision = _get(job, "revision", str)
        if revision not in self._preparations:
            self._preparations[revision] = prepare(_network(job), progress=progress)
        self._preparations.move_to_end(revision)
        while len(self._preparations) > PREPARATIONS:
            self._preparations.popitem(last=False)
        return self._preparations[revision]


def _network(job: Payload) -> "Siren":
    from ..field.checkpoint import from_bytes

    return from_bytes(_array(job, "field").tobytes())


def _model(network: "Siren", job: Payload, progress: Progress) -> dict[str, np.ndarray]:
    """A field and its proxy as arrays."""
    from ..field.checkpoint import to_bytes

    weights = np.frombuffer(to_bytes(network), np.uint8)
    return {"field": weights, **_proxy(network, job, progress)}


def _proxy(network: "Siren", job: Payload, progress: Progress) -> dict[str, np.ndarray]:
    from ..field.proxy import extract

    proxy = extract(network, _get(job, "resolution", int), progress)
    return {"vertices": proxy.vertices, "normals": proxy.normals, "triangles": proxy.triangles}


def _part(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a step that is the part from `start` to `end` of the whole."""
    return lambda fraction, message: progress(start + (end - start) * fraction, message)


def _get(job: Payload, name: str, wanted: type[T]) -> T:
    value = job.fields.get(name)
    if type(value) is not wanted:
        raise SculptError(f"The job's {name!r} must be of type {wanted.__name__}, not {value!r}.")
    return value


def _array(job: Payload, name: str) -> np.ndarray:
    if name not in job.arrays:
        raise SculptError(f"The job lacks the array {name!r}.")
    return job.arrays[name]
