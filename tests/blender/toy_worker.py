# SPDX-License-Identifier: GPL-3.0-or-later
"""A real worker without torch, whose refinement lasts until the test lets it end.

Started as `python -I -u toy_worker.py ROOT GO`: it serves the package's own protocol. A "field" is
some bytes, an edit appends one, and the proxy is what the bytes are the seed of: so a test can tell
whether an object's mesh belongs to its weights. A refinement ends when the file GO exists. A file
`spoil` beside it has the name of a way to answer an edit wrongly, and `once` when only once.
"""

import os
import sys
import time
import zlib
from pathlib import Path

import numpy as np

sys.path.insert(0, sys.argv[1])

from neural_sculpt_addon.field.edges import find_edges
from neural_sculpt_addon.worker.payload import Payload
from neural_sculpt_addon.worker.protocol import JobKind
from neural_sculpt_addon.worker.server import take_over

GO = Path(sys.argv[2])
SPOIL = GO.with_name("spoil")
QUICK, FINAL = 1, 2


def model(field, job):
    """A field and its proxy, a fan of as many triangles as the resolution says."""
    cells = job.fields["resolution"]
    random = np.random.default_rng([zlib.crc32(field.tobytes()), cells])
    vertices = random.normal(size=(cells, 3)).astype("<f4")
    triangles = np.array([[0, i, i + 1] for i in range(1, cells - 1)], "<i4")
    edges, corner_edges = find_edges(triangles)
    return {
        "field": field,
        "vertices": vertices,
        "normals": vertices,
        "triangles": triangles,
        "edges": edges,
        "corner_edges": corner_edges,
    }


def fit(job, progress):
    """Any primitive."""
    field = np.arange(200, dtype="u1")
    place = {"scale": 1.0, "center": [0.0, 0.0, 0.0], "report": {}}
    return Payload(place, model(field, job))


def edit(job, progress):
    """The quick result at once when it is wanted, the final one when the test wants it."""

    def result(kind, revision):
        field = np.append(job.arrays["field"], np.uint8(kind))
        reports = [{"kind": kind, "field": len(field)}]
        fields = {"revision": job.fields[revision], "reports": reports}
        return spoiled(Payload(fields, model(field, job)))

    if "quick_revision" in job.fields:
        job.quick(result(QUICK, "quick_revision"))
        while not GO.exists():
            progress(0.5, "Refining")
            time.sleep(0.005)
    return result(FINAL, "result_revision")


def spoiled(result):
    """An answer that no worker should give, when the test wants one."""
    how, _, times = SPOIL.read_text().partition(" ") if SPOIL.exists() else ("", "", "")
    if times:
        SPOIL.unlink()
    fields, arrays = dict(result.fields), dict(result.arrays)
    if how == "nan":
        arrays["vertices"][3, 1] = np.nan
    elif how == "index":
        arrays["triangles"][0, 0] = 10**6
    elif how == "shape":
        arrays["normals"] = arrays["normals"][:-1]
    elif how == "missing":
        del fields["reports"]
    elif how == "revision":
        fields["revision"] = ["cannot", "be", "hashed"]
    elif how == "full":  # as on a full disk
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (500, resource.RLIM_INFINITY))
    elif how == "death":
        os._exit(7)
    return Payload(fields, arrays)


def mesh(job, progress):
    """The same field with another proxy."""
    return Payload({}, model(job.arrays["field"], job))


def save(job, progress):
    """The bytes of the field in a file."""
    Path(job.fields["path"]).write_bytes(job.arrays["field"].tobytes())
    return Payload()


if __name__ == "__main__":
    handlers = {JobKind.FIT: fit, JobKind.EDIT: edit, JobKind.MESH: mesh, JobKind.SAVE: save}
    take_over().serve(handlers, {"torch": None, "device": "cpu", "python": sys.version})
