# SPDX-License-Identifier: GPL-3.0-or-later
"""What shows a state: refined within a budget, updated after strokes, the same by any way."""

import numpy as np
import pytest
import torch
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.mesh.refinement import refine as refinement
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import CELLS
from neural_sculpt_addon.worker.protocol import JobKind
from neural_sculpt_addon.worker.server.jobs import Jobs
from tests.worker.server.histories import RESOLUTION, Object, run, stroke
from tests.worker.server.test_jobs import distance_from, field_of

CPU = torch.device("cpu")
MANY = 1_000_000


def mesh_of(result):
    return trimesh.Trimesh(result.arrays["vertices"], result.arrays["triangles"], process=False)


@pytest.mark.parametrize("cells", [RESOLUTION, CELLS])
def test_strokes_are_shown_refined_and_as_a_worker_that_knows_nothing_would(cells):
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    for x in (0.0, 0.3):
        job = {"resolution": cells, "triangles": MANY}
        result = ob.edit(jobs, stroke(x=x, radius=0.03, intensity=0.015), **job)
        mesh, field = mesh_of(result), field_of(ob)
        assert mesh.is_watertight and mesh.is_winding_consistent
        coarse = extract(field, cells)
        assert len(mesh.faces) > len(coarse.triangles) + 50
        assert distance_from(field, result.arrays["vertices"]) < 1e-5
        fields = ob.fields(resolution=cells, triangles=MANY)
        anew = run(Jobs(CPU), JobKind.MESH, fields, ob.bytes)
        assert len(mesh.faces) == pytest.approx(len(mesh_of(anew).faces), rel=2e-3)


def test_undo_and_a_muted_stroke_show_what_was_before():
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    job = {"triangles": MANY}
    first = ob.edit(jobs, stroke(radius=0.03, intensity=0.015), **job)
    revision, layers = ob.revision, [*ob.layers]
    ob.edit(jobs, stroke(x=0.3, radius=0.03, intensity=0.015), **job)
    ob.revision, ob.layers = revision, layers
    ob.entries = ob.entries[:1]
    fields = {
        "base": ob.base,
        "entries": ob.entries,
        "solver": "local",
        "resolution": RESOLUTION,
        "result_revision": "again",
        **job,
    }
    result = run(jobs, JobKind.REPLAY, fields, ob.bytes)
    assert len(mesh_of(result).faces) == pytest.approx(len(mesh_of(first).faces), rel=2e-3)
    known = {row.tobytes() for row in first.arrays["vertices"]}
    assert np.mean([row.tobytes() in known for row in result.arrays["vertices"]]) > 0.9


@pytest.mark.parametrize("cells", [RESOLUTION, CELLS])
@pytest.mark.parametrize("is_undone", [True, False])
def test_where_a_stroke_does_not_reach_the_vertices_are_those_of_its_own_state(cells, is_undone):
    """Whether the mesh that was made last is that of a stroke which was undone, or another object's
    of the same base."""
    jobs, ob, other = Jobs(CPU), Object(primitive("sphere")), Object(primitive("sphere"))
    job = {"resolution": cells, "triangles": MANY}
    ob.edit(jobs, stroke(x=0.4, y=0.3, radius=0.04, intensity=0.015), **job)
    shown = run(jobs, JobKind.MESH, ob.fields(updated=True, **job), ob.bytes).arrays["vertices"]
    if is_undone:
        other.layers, other.revision, other.bytes = ob.layers, ob.revision, {**ob.bytes}
    beside = stroke(x=-0.3, radius=0.05, intensity=0.02)
    other.edit(jobs, beside, result_revision="another", **job)
    vertices = ob.edit(jobs, stroke(x=0.4, radius=0.05, intensity=0.02), **job).arrays["vertices"]
    far = np.linalg.norm(vertices - [0.4, 0, 0.447], axis=1) > 0.25
    known = {row.tobytes() for row in shown}
    assert all(row.tobytes() in known for row in vertices[far])
    assert not all(row.tobytes() in known for row in vertices[~far])


def test_a_budget_is_kept():
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    count = len(extract(primitive("sphere"), RESOLUTION).triangles)
    for x in (0.0, 0.2, -0.2):
        most = count + 400
        result = ob.edit(jobs, stroke(x=x, radius=0.05, intensity=0.02), triangles=most)
        assert count < len(mesh_of(result).faces) <= most
    result = ob.edit(jobs, stroke(y=0.3, radius=0.05, intensity=0.02), triangles=MANY)
    assert len(mesh_of(result).faces) > most


@pytest.mark.parametrize("senseless", [-1, 10**9, 1.5, "many", True])
def test_a_senseless_budget_is_refused_in_a_sentence(senseless):
    ob = Object(primitive("sphere"))
    with pytest.raises(SculptError, match="refined to at most"):
        run(Jobs(CPU), JobKind.MESH, ob.fields(triangles=senseless), ob.bytes)


def test_after_a_preparation_a_stroke_refines_its_surroundings_alone(monkeypatch):
    ob = Object(primitive("sphere"))
    whole = []
    refine = refinement.refine
    monkeypatch.setattr(
        refinement, "refine", lambda *given, **more: whole.append(given) or refine(*given, **more)
    )
    for prepared in (True, False):
        jobs = Jobs(CPU)
        if prepared:
            run(jobs, JobKind.PREPARE, ob.fields(triangles=MANY), ob.bytes)
        whole.clear()
        fields = ob.fields(
            stroke=stroke(radius=0.03, intensity=0.015),
            solver="local",
            result_revision="new",
            triangles=MANY,
        )
        result = run(jobs, JobKind.EDIT, fields, ob.bytes)
        assert len(whole) == (0 if prepared else 1)
        assert mesh_of(result).is_watertight
