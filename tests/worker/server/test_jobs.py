# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs of the worker, called as the server calls them."""

import numpy as np
import pytest
import torch
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.checkpoint import from_bytes
from neural_sculpt_addon.field.edit.layers import digest
from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.layer_bytes import layer_from_bytes
from neural_sculpt_addon.field.mesh.morton_order import morton_order
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import CELLS
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.worker import answers
from neural_sculpt_addon.worker.protocol import JobKind, Message, MessageKind
from neural_sculpt_addon.worker.server.jobs import Jobs
from neural_sculpt_addon.worker.server.payload import MissingError
from tests.worker.server.histories import RESOLUTION, Object, run, stroke

CPU = torch.device("cpu")


@pytest.fixture(scope="module")
def edited():
    """The jobs after one stroke, the object, and the result."""
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    return jobs, ob, ob.edit(jobs, stroke())


def field_of(ob: Object) -> Field:
    """The sum of base and layers."""
    field = from_bytes(ob.bytes[ob.base].tobytes())
    for name, strength in ob.layers:
        assert strength == 1
        field = field.plus(layer_from_bytes(ob.bytes[name].tobytes()))
    return field


def distance_from(field: Field, vertices: np.ndarray) -> float:
    value, gradient = values_and_gradients(field, vertices)
    return float(np.mean(np.abs(value) / np.linalg.norm(gradient, axis=1)))


def test_an_edit_is_a_layer_and_the_proxy_of_the_sum(edited):
    _, ob, result = edited
    assert result.fields["layer"] == digest(result.arrays["layer"].tobytes())
    expected = extract(field_of(ob), RESOLUTION)
    assert np.array_equal(result.arrays["vertices"], expected.vertices)
    assert np.array_equal(result.arrays["triangles"], expected.triangles)
    assert np.linalg.norm(result.arrays["vertices"], axis=1).max() == pytest.approx(0.64, abs=5e-3)


@pytest.mark.parametrize(
    ("sentence", "words"),
    [
        ("The radius is 1e-30", {"radius": 1e-30}),
        ("The intensity is 1e", {"intensity": 1e308}),
        ("With its pressure", {"radius": 1e-3, "radius_factors": [0.05]}),
        ("radius_factors are", {"radius_factors": [1e300]}),
        ("no width", {"radius_factors": [1e-300]}),
        ("name cannot be", {"name": ["x" * 5000]}),
    ],
)
def test_senseless_strokes_are_refused_in_a_sentence(edited, sentence, words):
    jobs, ob, _ = edited
    with pytest.raises(SculptError, match=sentence) as caught:
        ob.edit(jobs, stroke(**words))
    assert len(str(caught.value)) < 300


def test_a_proxy_at_another_resolution_follows_what_was_shown(edited):
    jobs, ob, before = edited
    after = ob.edit(jobs, stroke(x=0.3))
    vertices = after.arrays["vertices"]
    field = field_of(ob)
    assert distance_from(field, vertices) < 1e-5
    assert len(vertices) == pytest.approx(len(extract(field, RESOLUTION).vertices), rel=0.01)
    known = {row.tobytes() for row in before.arrays["vertices"]}
    assert np.mean([row.tobytes() in known for row in vertices]) > 0.9


def test_a_worker_that_knows_nothing_makes_the_same_of_a_state(edited):
    _, ob, _ = edited
    fields = ob.fields(resolution=CELLS)
    shown = run(Jobs(CPU), JobKind.MESH, fields, ob.bytes).arrays
    made = extract(field_of(ob), CELLS)
    order, triangles = morton_order(made.vertices, made.triangles)
    assert np.array_equal(shown["triangles"], triangles)
    assert np.array_equal(shown["vertices"], made.vertices[order])
    assert np.array_equal(shown["normals"], made.normals[order])


def test_what_is_missing_is_named_and_what_was_sent_once_is_known(edited):
    _, ob, _ = edited
    jobs = Jobs(CPU)
    with pytest.raises(MissingError) as caught:
        run(jobs, JobKind.PREPARE, ob.fields())
    assert caught.value.ids == [ob.base, *(name for name, _ in ob.layers)]
    run(jobs, JobKind.PREPARE, ob.fields(), ob.bytes)
    run(jobs, JobKind.MESH, ob.fields() | {"revision": "unheard of"})


def test_a_known_revision_is_not_made_again(edited):
    """Its layers are neither sent nor read nor summed."""
    jobs, ob, _ = edited
    unreadable = {"base": "?", "layers": [["?", 1.0]]}
    run(jobs, JobKind.PREPARE, ob.fields(state=unreadable))


def test_a_network_is_one_again_without_its_layers(edited):
    jobs, ob, _ = edited
    bare = ob.fields(state={"base": ob.base, "layers": []}, revision="bare")
    more = {"stroke": stroke(radius=0.15), "solver": "network", "result_revision": "n"}
    with pytest.raises(SculptError, match="detail"):
        run(jobs, JobKind.EDIT, ob.fields(**more), ob.bytes)
    assert "base" in run(jobs, JobKind.EDIT, bare | more, ob.bytes).fields


def test_bytes_that_are_not_what_their_id_says_are_refused(edited):
    _, ob, _ = edited
    name = ob.layers[0][0]
    wrong = ob.bytes | {name: ob.bytes[name][:-1]}
    with pytest.raises(SculptError, match="id"):
        run(Jobs(CPU), JobKind.MESH, ob.fields(), wrong)


@pytest.mark.parametrize(
    "state", [{}, {"base": 1, "layers": []}, {"base": "a", "layers": [["b"]]}, None]
)
def test_a_state_that_is_none_is_refused(state):
    with pytest.raises(SculptError):
        run(Jobs(CPU), JobKind.MESH, {"state": state, "revision": "a", "resolution": 32})


@pytest.mark.parametrize("strength", [-0.1, 1.1, True, "1", None])
def test_a_strength_is_from_0_to_1(edited, strength):
    _, ob, _ = edited
    fields = ob.fields(state={"base": ob.base, "layers": [[ob.layers[0][0], strength]]})
    with pytest.raises(SculptError, match="strength"):
        run(Jobs(CPU), JobKind.MESH, fields, ob.bytes)


def test_measures_come_afterwards():
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    ob.edit(jobs, stroke(name="Nose"))
    report = run(jobs, JobKind.MEASURE, {"revision": ob.revision}).fields["report"]
    assert (report["stroke"], report["solver"]) == ("Nose", "local")
    assert report["tube_mean"] < 1e-3
    with pytest.raises(SculptError, match="forgotten"):
        run(jobs, JobKind.MEASURE, {"revision": "unheard of"})


def test_the_network_s_solver_makes_a_base():
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    fields = ob.fields(stroke=stroke(radius=0.15), solver="network", result_revision="1")
    result = run(jobs, JobKind.EDIT, fields, ob.bytes)
    data = result.arrays["field"].tobytes()
    assert result.fields["base"] == digest(data)
    assert distance_from(from_bytes(data), result.arrays["vertices"]) < 1e-5
    state = {"base": result.fields["base"], "layers": []}
    run(jobs, JobKind.MESH, {"state": state, "revision": "new", "resolution": 32})


def test_absorbed_sculpting_is_one_more_layer():
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    ob.edit(jobs, stroke())
    shown = run(jobs, JobKind.MESH, ob.fields(resolution=CELLS)).arrays
    vertices = shown["vertices"].copy()
    way = np.linalg.norm(vertices - [0, 0, -0.6], axis=1)
    vertices *= 1 + 0.1 * np.clip(1 - (way / 0.2)[:, None] ** 2, 0, None) ** 2
    sculpted = {"vertices": vertices, "triangles": shown["triangles"]}
    result = run(jobs, JobKind.ABSORB_PROXY, ob.fields(result_revision="2"), ob.bytes | sculpted)
    ob.add(None, result)
    assert result.fields["report"]
    value, gradient = values_and_gradients(field_of(ob), vertices)
    assert np.mean(np.abs(value) / np.linalg.norm(gradient, axis=1)) < 1e-3
    assert distance_from(field_of(ob), result.arrays["vertices"]) < 1e-5


def test_a_brush_stroke_is_one_more_layer_and_moves_the_vertices_it_names():
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    ob.edit(jobs, stroke())
    shown = run(jobs, JobKind.MESH, ob.fields(resolution=CELLS)).arrays
    before, triangles = shown["vertices"], shown["triangles"]
    way = np.linalg.norm(before - [0, 0, -0.6], axis=1)
    share = np.clip(1 - (way / 0.2)[:, None] ** 2, 0, None) ** 2
    after = (before * (1 + 0.1 * share)).astype(np.float32)
    used, corners = np.unique(triangles[(way < 0.25)[triangles].all(axis=1)], return_inverse=True)
    part = {
        "before": before[used],
        "after": after[used],
        "triangles": corners.reshape(-1, 3).astype(np.int32),
    }
    asked = ob.fields(result_revision="2", remesh=False, keep=False)
    result = run(jobs, JobKind.ABSORB_STROKE, asked, ob.bytes | part)
    assert "vertices" not in result.arrays and not result.fields["stretched"]
    answers.check(
        JobKind.ABSORB_STROKE, Message(MessageKind.RESULT, 1, result.fields, result.arrays)
    )
    assert np.linalg.norm(result.arrays["snapped"] - part["after"], axis=1).mean() < 1e-4
    stretched = asked | {"result_revision": "3", "remesh": True}
    again = run(jobs, JobKind.ABSORB_STROKE, stretched, ob.bytes | part)
    kept = run(jobs, JobKind.ABSORB_STROKE, stretched | {"keep": True}, ob.bytes | part)
    assert again.fields["stretched"] and kept.fields["stretched"] and "vertices" not in kept.arrays
    assert again.fields["layer"] == result.fields["layer"]
    ob.add(None, result)
    assert distance_from(field_of(ob), again.arrays["vertices"]) < 1e-5
    for each in (result, again):
        assert distance_from(field_of(ob), each.arrays["snapped"]) < 1e-4
    broken = part | {"triangles": part["triangles"] + len(used)}
    with pytest.raises(SculptError, match="does not have"):
        run(jobs, JobKind.ABSORB_STROKE, asked, ob.bytes | broken)


@pytest.mark.long
def test_a_boolean_is_one_more_layer():
    """With another field, moved and scaled, and with a mesh."""
    jobs, ob, other = Jobs(CPU), Object(primitive("sphere")), Object(primitive("sphere"))
    ob.edit(jobs, stroke())
    matrix = np.diag([0.5, 0.5, 0.5, 1.0])
    matrix[:3, 3] = [0.5, 0, 0]
    asked = {"operation": "union", "blend": 0, "result_revision": "2"}
    there = {"other": other.fields(), "matrix": matrix.ravel().tolist()}
    result = run(jobs, JobKind.BOOLEAN, ob.fields(**asked, **there), ob.bytes | other.bytes)
    ob.add(None, result)
    far = project(field_of(ob), [[0.82, 0, 0]]).points[0]
    np.testing.assert_allclose(far, [0.8, 0, 0], atol=1e-3)  # 0.5 + 0.5 * 0.6
    box = trimesh.creation.box((2, 2, 1))
    box.apply_translation((0, 0, 0.7))
    mesh = {"vertices": box.vertices.astype(np.float32), "triangles": box.faces.astype(np.int32)}
    asked = {"operation": "difference", "blend": 0.0, "result_revision": "3"}
    result = run(jobs, JobKind.BOOLEAN, ob.fields(**asked), ob.bytes | mesh)
    ob.add(None, result)
    assert result.arrays["vertices"][:, 2].max() == pytest.approx(0.2, abs=1e-3)
    with pytest.raises(SculptError, match="16 numbers"):
        fields = ob.fields(**asked, other=other.fields(), matrix=[1, 2])
        run(jobs, JobKind.BOOLEAN, fields, ob.bytes | other.bytes)


def test_what_a_boolean_would_come_to_is_shown_coarsely():
    """A box takes off the sphere of radius 0.6 what is above z = 0.2, or keeps only that; a blend
    rounds off the rim."""
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    box = trimesh.creation.box((1.6, 1.6, 1))
    box.apply_translation((0, 0, 0.7))
    mesh = {"vertices": box.vertices.astype(np.float32), "triangles": box.faces.astype(np.int32)}

    def shown(operation, blend=0.0):
        fields = ob.fields(operation=operation, blend=blend)
        return run(jobs, JobKind.BOOLEAN_MESH, fields, ob.bytes | mesh).arrays["vertices"]

    cut, kept = shown("difference"), shown("intersection")
    assert cut[:, 2].max() == pytest.approx(0.2, abs=0.01)
    assert cut[:, 2].min() == pytest.approx(-0.6, abs=0.01)
    assert kept[:, 2].min() == pytest.approx(0.2, abs=0.01)
    assert kept[:, 2].max() == pytest.approx(0.6, abs=0.01)
    assert np.linalg.norm(kept, axis=1).max() <= 0.61
    rounded = shown("difference", 0.2)
    ring = np.hypot(rounded[:, 0], rounded[:, 1])[rounded[:, 2] > 0.18]
    assert ring.max() < np.hypot(cut[:, 0], cut[:, 1])[cut[:, 2] > 0.18].max() - 0.01
    assert len(cut) < 20_000
    with pytest.raises(SculptError, match="no operation"):
        shown("both")
    box.apply_translation((0, 0, 0.5))
    mesh["vertices"] = box.vertices.astype(np.float32)
    with pytest.raises(SculptError, match="leave the box"):
        shown("union")


def test_a_flattened_field_is_the_sum_in_one(edited):
    jobs, ob, _ = edited
    result = run(jobs, JobKind.APPLY_TO_BASE, ob.fields(), ob.bytes)
    data = result.arrays["field"].tobytes()
    assert result.fields["id"] == digest(data)
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (1000, 3))
    np.testing.assert_array_equal(values(from_bytes(data), points), values(field_of(ob), points))


@pytest.mark.long
def test_a_consolidated_field_is_a_network(edited):
    jobs, ob, _ = edited
    fields = ob.fields(width=32, result_revision="c")
    result = run(jobs, JobKind.CONSOLIDATE, fields, ob.bytes)
    field = from_bytes(result.arrays["field"].tobytes())
    assert (field.network.widths, field.detail.levels) == ((32, 32), ())
    assert result.fields["revision"] == "c" and result.fields["report"]


def test_a_sampled_band_holds_the_field_near_the_surface():
    ob = Object(field := primitive("torus"))
    band = run(Jobs(CPU), JobKind.SAMPLE, ob.fields(resolution=40), ob.bytes).arrays["band"]
    assert band.shape == (41, 41, 41) and band.dtype == np.float32
    axis = np.linspace(-1, 1, 41, dtype=np.float32)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    expected = np.clip(values(field, points), -0.15, 0.15)
    np.testing.assert_allclose(band.ravel(), expected, atol=1e-6)
