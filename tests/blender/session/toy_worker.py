# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker whose fields are whole numbers, which tests can add up by themselves.

Started by its path, without torch, with the root of the sources and a folder as arguments; it
serves the package's own protocol. A base and a layer are SIZE numbers each; those of a layer depend
on its stroke and its context, which are the base and the layers beneath that touch it: strokes
whose first points have the same sign of x touch. The proxy shows the sum of base and layers in the
coordinates of its first vertices. So a test can tell whether a mesh belongs to its object. Strokes
leave the first vertex at (-1, 0, 1), where a test may draw to have it displaced by a preview.

What changes a field ends when the file `go` exists, and measures do when `measured` does. The file
`forget` lets the worker forget all bytes; `spoil` has the name of a way to answer an edit wrongly,
and `once` when only once.
"""

import hashlib
import json
import os
import signal
import sys
import time
import zlib
from pathlib import Path

import numpy as np

sys.path.insert(0, sys.argv[1])

from neural_sculpt_addon.field.mesh.edges import find_edges
from neural_sculpt_addon.worker.protocol import JobKind
from neural_sculpt_addon.worker.server.payload import MissingError, Payload
from neural_sculpt_addon.worker.server.server import take_over

FOLDER = Path(sys.argv[2])
SIZE = 24

known: dict[str, bytes] = {}
edits: dict[str, dict[str, str]] = {}
sides: dict[str, float] = {}
"""Of layers, by id."""


def named(data: np.ndarray) -> tuple[str, np.ndarray]:
    """The id of numbers (SIZE,), which are known from now on, and their bytes as an array."""
    name = hashlib.sha256(data.tobytes()).hexdigest()
    known[name] = data.tobytes()
    return name, np.frombuffer(known[name], "u1")


def numbers(name: str) -> np.ndarray:
    return np.frombuffer(known[name], "<i4")


def receive(job: Payload, names: list[str]) -> None:
    """Learn the bytes that came with a job. MissingError without some of those that it names."""
    if (FOLDER / "forget").exists():
        (FOLDER / "forget").unlink()
        known.clear()
    known.update({name: data.tobytes() for name, data in job.arrays.items() if len(name) == 64})
    if missing := [name for name in names if name not in known]:
        raise MissingError(missing)


def summed(job: Payload) -> np.ndarray:
    """The field (SIZE,) of the job's state."""
    state = job.fields["state"]
    receive(job, [state["base"], *(name for name, _ in state["layers"])])
    return numbers(state["base"]) + sum(scaled(*term) for term in state["layers"])


def scaled(name: str, strength: float) -> np.ndarray:
    return np.rint(strength * numbers(name)).astype("<i4")


def solved(stroke: dict, context: str) -> np.ndarray:
    stroke = {**stroke, "name": ""}
    seed = zlib.crc32(json.dumps([stroke, context], sort_keys=True).encode())
    layer = np.random.default_rng(seed).integers(-1000, 1000, SIZE, "<i4")
    layer[:3] = 0
    return layer


def context_of(base: str, side: float, beneath: list[tuple[str, float, float]]) -> str:
    """Of a layer on `side`, above layers with their strength and side."""
    touching = [(name, strength) for name, strength, other in beneath if other == side and strength]
    return hashlib.sha256(json.dumps([base, touching]).encode()).hexdigest()


def side_of(stroke: dict | None) -> float:
    return 0.0 if stroke is None else float(np.sign(stroke["points"][0][0]))


def wait(file: str, progress) -> None:
    while not (FOLDER / file).exists():
        progress(0.5, "Sculpting")
        time.sleep(0.003)


def proxy(field: np.ndarray, cells: int) -> dict[str, np.ndarray]:
    """The mesh of a field (SIZE,), whose last vertex tells the resolution."""
    vertices = np.append(field, (cells, 0, 0)).reshape(-1, 3).astype("<f4")
    triangles = np.array([[0, i, i + 1] for i in range(1, len(vertices) - 1)], "<i4")
    edges, corner_edges = find_edges(triangles)
    parts = {"normals": np.ones_like(vertices), "edges": edges, "corner_edges": corner_edges}
    return {"vertices": vertices, "triangles": triangles, **parts}


def fit(job, progress):
    """Any primitive."""
    field = np.arange(SIZE, dtype="<i4") - 1
    name, data = named(field)
    place = {"scale": 1.0, "center": [0.0, 0.0, 0.0], "report": {}, "id": name}
    return Payload(place, {"field": data, **proxy(field, job.fields["resolution"])})


def edit(job, progress):
    """One more layer; of the solver network another base."""
    field, stroke = summed(job), job.fields["stroke"]
    wait("go", progress)
    layers = job.fields["state"]["layers"]
    beneath = [(name, strength, sides.get(name, 0.0)) for name, strength in layers]
    context = context_of(job.fields["state"]["base"], side_of(stroke), beneath)
    layer = solved(stroke, context)
    cells = job.fields["resolution"]
    fields = {"revision": job.fields["result_revision"], "seconds": 0.0}
    edits[fields["revision"]] = {"stroke": stroke.get("name", "")}
    if job.fields["solver"] == "network":
        fields["base"], data = named(field + layer)
        return Payload(fields, {"field": data, **proxy(field + layer, cells)})
    fields["layer"], data = named(layer)
    fields["context"] = context
    sides[fields["layer"]] = side_of(stroke)
    return spoiled(Payload(fields, {"layer": data, **proxy(field + layer, cells)}))


def spoiled(result):
    """An answer that no worker should give, when the test wants one."""
    spoil = FOLDER / "spoil"
    how, _, times = spoil.read_text().partition(" ") if spoil.exists() else ("", "", "")
    if times:
        spoil.unlink()
    fields, arrays = dict(result.fields), dict(result.arrays)
    if how == "nan":
        arrays["vertices"][3, 1] = np.nan
    elif how == "index":
        arrays["triangles"][0, 0] = 10**6
    elif how == "shape":
        arrays["normals"] = arrays["normals"][:-1]
    elif how == "missing":
        del arrays["layer"]
    elif how == "report":
        fields["report"] = ["no", "report"]
    elif how == "fewer":
        fields["layers"] = fields["layers"][:-1]
    elif how == "revision":
        fields["revision"] = ["cannot", "be", "hashed"]
    elif how == "full":  # as on a full disk
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (500, resource.RLIM_INFINITY))
    elif how == "death":
        os._exit(7)
    elif how == "hang":
        os.kill(os.getpid(), signal.SIGSTOP)
    return Payload(fields, arrays)


def replay(job, progress):
    """All entries, of which those are solved again whose context is another one."""
    base, entries = job.fields["base"], job.fields["entries"]
    receive(job, [base, *(entry["layer"] for entry in entries if entry["layer"])])
    wait("go", progress)
    field, beneath, layers, arrays = numbers(base), [], [], {}
    for number, entry in enumerate(entries):
        stroke, name, side = entry["stroke"], entry["layer"], side_of(entry["stroke"])
        context = context_of(base, side, beneath)
        if name is None or (stroke is not None and context != entry["context"]):
            name, data = named(solved(stroke, context))
            if name != entry["layer"]:
                arrays[f"layer.{number}"] = data
        sides[name] = side
        beneath.append((name, entry["strength"], side))
        layers.append({"id": name, "context": context})
        field = field + scaled(name, entry["strength"])
    fields = {"revision": job.fields["result_revision"], "layers": layers}
    if job.fields["solver"] == "network":
        name, arrays = named(field)[0], {"field": named(field)[1]}
        fields = {"revision": job.fields["result_revision"], "base": name}
    return spoiled(Payload(fields, {**arrays, **proxy(field, job.fields["resolution"])}))


def absorb_proxy(job, progress):
    """A layer that leads to the vertices."""
    field = summed(job)
    wait("go", progress)
    layer = np.rint(job.arrays["vertices"][:-1].ravel()).astype("<i4") - field
    name, data = named(layer)
    fields = {"revision": job.fields["result_revision"], "layer": name, "context": "absorbed"}
    fields["report"] = {"error_mean": 0.0}
    return Payload(fields, {"layer": data, **proxy(field + layer, job.fields["resolution"])})


def absorb_stroke(job, progress):
    """The same of a brush, which was told all vertices of this mesh."""
    field = summed(job)
    wait("go", progress)
    layer = np.rint(job.arrays["after"][:-1].ravel()).astype("<i4") - field
    name, data = named(layer)
    fields = {"revision": job.fields["result_revision"], "layer": name, "context": "absorbed"}
    fields |= {"report": {"error_mean": 0.0}, "stretched": job.fields["remesh"]}
    shown = proxy(field + layer, job.fields["resolution"])
    snapped = {"snapped": shown["vertices"], "snapped_normals": shown["normals"]}
    another = job.fields["remesh"] and not job.fields["keep"]
    return Payload(fields, {"layer": data, **snapped, **(shown if another else {})})


def boolean(job, progress):
    """A layer of the other field, or of a mesh."""
    field = summed(job)
    other = summed(Payload(job.fields["other"], job.arrays)) if "other" in job.fields else field
    wait("go", progress)
    name, data = named(other - field // 2)
    fields = {"revision": job.fields["result_revision"], "layer": name, "context": "united"}
    shown = proxy(field + other - field // 2, job.fields["resolution"])
    return Payload({**fields, "report": {}}, {"layer": data, **shown})


def consolidate(job, progress):
    """Another base, the same but for its last number."""
    field = summed(job)
    field[-1] += 1
    name, data = named(field)
    fields = {"revision": job.fields["result_revision"], "id": name, "report": {}}
    return Payload(fields, {"field": data, **proxy(field, job.fields["resolution"])})


def measure(job, progress):
    """What stroke it was."""
    wait("measured", progress)
    return spoiled(Payload({"report": edits[job.fields["revision"]]}))


def mesh(job, progress):
    """The same field with another proxy."""
    return Payload({}, proxy(summed(job), job.fields["resolution"]))


def apply_to_base(job, progress):
    """The sum as a base."""
    name, data = named(summed(job))
    return Payload({"id": name}, {"field": data})


def save(job, progress):
    """The numbers of the field in a file."""
    Path(job.fields["path"]).write_bytes(summed(job).tobytes())
    return Payload()


def prepare(job, progress):
    """Nothing."""
    summed(job)
    return Payload()


if __name__ == "__main__":
    handlers = {
        **{JobKind.FIT: fit, JobKind.EDIT: edit, JobKind.REPLAY: replay},
        **{JobKind.ABSORB_PROXY: absorb_proxy, JobKind.ABSORB_STROKE: absorb_stroke},
        **{JobKind.MEASURE: measure, JobKind.MESH: mesh, JobKind.APPLY_TO_BASE: apply_to_base},
        **{JobKind.SAVE: save, JobKind.PREPARE: prepare},
        **{JobKind.BOOLEAN: boolean, JobKind.CONSOLIDATE: consolidate},
    }
    take_over().serve(handlers, {"torch": None, "device": "cpu", "python": sys.version})
