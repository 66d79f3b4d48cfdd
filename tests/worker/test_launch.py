# SPDX-License-Identifier: GPL-3.0-or-later
"""The real worker, started as Blender starts it, from a folder of any name."""

import shutil
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.worker.client import Client, JobKind, Message, MessageKind
from neural_sculpt_addon.worker.install.environment import worker_command
from neural_sculpt_addon.worker.protocol import FINAL
from tests.worker.support import PATIENCE, ROOT, until

CELLS = 48
STROKE = {
    "points": [[0.6 * np.sin(a), 0.0, 0.6 * np.cos(a)] for a in (-0.3, 0.0, 0.3)],
    "radius": 0.1,
    "intensity": 0.05,
    "profile": {"name": "quintic"},
    "modulation": {"name": "identity"},
}


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    client = Client(worker_command(sys.executable), tmp_path_factory.mktemp("log") / "worker.log")
    client.start()
    yield client
    client.stop()


@pytest.fixture(scope="module")
def sphere(client) -> Message:
    return done(client, JobKind.FIT, {"primitive": "sphere", "resolution": CELLS})


def ended(client: Client, kind: JobKind, fields: dict, **arrays: np.ndarray) -> Message:
    return client.wait(client.submit(kind, fields, arrays), timeout=PATIENCE)


def done(client: Client, kind: JobKind, fields: dict, **arrays: np.ndarray) -> Message:
    message = ended(client, kind, fields, **arrays)
    assert message.kind is MessageKind.RESULT, message.fields
    return message


def state_of(field: np.ndarray, revision: str = "a", **fields: object) -> dict:
    """The fields of a job about a field without layers."""
    state = {"base": sha256(field.tobytes()).hexdigest(), "layers": []}
    return {"state": state, "revision": revision, "resolution": CELLS, **fields}


def edit_fields(field: np.ndarray, **changes: object) -> dict:
    made = {"stroke": STROKE, "solver": "local", "result_revision": "b"}
    return state_of(field, **(made | changes))


def sent(field: np.ndarray) -> dict[str, np.ndarray]:
    """The bytes of a field by its id."""
    return {sha256(field.tobytes()).hexdigest(): field}


def radii(message: Message) -> np.ndarray:
    return np.linalg.norm(message.arrays["vertices"], axis=1)


def test_it_says_what_it_is(client, sphere):
    import torch

    assert client.hello["torch"] == torch.__version__
    assert client.hello["device"] == "cpu"
    assert sys.version.startswith(client.hello["python"])


def test_a_primitive_is_a_field_and_its_proxy(sphere):
    np.testing.assert_allclose(radii(sphere), 0.6, atol=0.01)
    proxy = trimesh.Trimesh(sphere.arrays["vertices"], sphere.arrays["triangles"], process=False)
    assert proxy.is_watertight
    assert proxy.volume == pytest.approx(4 / 3 * np.pi * 0.6**3, rel=0.05)
    assert (sphere.fields["scale"], sphere.fields["center"]) == (1.0, [0.0, 0.0, 0.0])
    assert {name: array.dtype.str for name, array in sphere.arrays.items()} == {
        "field": "|u1",
        "vertices": "<f4",
        "normals": "<f4",
        "triangles": "<i4",
        "edges": "<i4",
        "corner_edges": "<i4",
    }


def test_a_field_is_meshed_as_finely_as_asked(client, sphere):
    field = sphere.arrays["field"]
    assert sphere.fields["id"] in sent(field)
    counts = [
        len(done(client, JobKind.MESH, state_of(field, resolution=cells)).arrays["triangles"])
        for cells in (32, 64)
    ]
    assert counts[1] == pytest.approx(4 * counts[0], rel=0.1)


def test_saved_fields_load_as_they_were(client, sphere, tmp_path):
    for name in ("field.safetensors", "field.pth"):
        path = str(tmp_path / name)
        saved = done(client, JobKind.SAVE, state_of(sphere.arrays["field"], path=path))
        assert saved.fields == {"path": path}
        loaded = done(client, JobKind.LOAD, {"path": path, "resolution": CELLS})
        np.testing.assert_array_equal(loaded.arrays["vertices"], sphere.arrays["vertices"])
        assert loaded.fields["id"] == sphere.fields["id"]


def test_an_edit_is_one_result_and_its_measures_follow(client, sphere):
    field = sphere.arrays["field"]
    done(client, JobKind.PREPARE, state_of(field))
    client.submit(JobKind.EDIT, edit_fields(field))
    news: list[Message] = []
    until(lambda: news.extend(client.poll_once()) or (news and news[-1].kind in FINAL))
    assert {message.kind for message in news[:-1]} <= {MessageKind.PROGRESS}
    edited = news[-1]
    assert edited.kind is MessageKind.RESULT
    assert edited.fields["revision"] == "b"
    assert radii(edited).max() == pytest.approx(0.65, abs=0.01)
    report = done(client, JobKind.MEASURE, {"revision": "b"}).fields["report"]
    assert report["tube_mean"] < 1e-3


def test_an_edit_can_be_cancelled_and_the_next_job_runs(client, sphere):
    field = sphere.arrays["field"]
    job = client.submit(JobKind.EDIT, edit_fields(field, solver="paper"))
    client.cancel(job)
    assert client.wait(job, timeout=PATIENCE).kind is MessageKind.CANCELLED
    done(client, JobKind.MESH, state_of(field))


def test_a_fresh_worker_says_what_it_lacks(client, sphere):
    field = np.arange(200, dtype="u1")
    message = ended(client, JobKind.MESH, state_of(field, "unheard of"))
    assert message.fields["missing"] == list(sent(field))


def test_a_mesh_becomes_a_field(client):
    box = trimesh.creation.box((2.0, 2.0, 2.0)).apply_translation((5, 0, 0))
    mesh = {"vertices": box.vertices.astype("<f4"), "triangles": box.faces.astype("<i4")}
    fields = {"method": "distance", "preset": "draft", "seed": 1, "resolution": CELLS}
    fit = done(client, JobKind.FIT, fields, **mesh)
    corners = fit.fields["scale"] * fit.arrays["vertices"] + fit.fields["center"]
    np.testing.assert_allclose(corners.min(axis=0), box.bounds[0], atol=0.15)
    np.testing.assert_allclose(corners.max(axis=0), box.bounds[1], atol=0.15)
    assert fit.fields["report"]


def test_a_fit_shows_what_it_has_and_ends_when_that_is_good_enough(client):
    ball = trimesh.creation.icosphere(3, radius=2.0)
    mesh = {"vertices": ball.vertices.astype("<f4"), "triangles": ball.faces.astype("<i4")}
    fields = {"preset": "fine", "seed": 1, "resolution": CELLS, "preview": True}
    job = client.submit(JobKind.FIT, fields, mesh)
    heard: list[Message] = []

    def of(*kinds: MessageKind) -> list[Message]:
        heard.extend(client.poll_once())
        return [message for message in heard if message.kind in kinds]

    until(lambda: of(MessageKind.PREVIEW))
    first = of(MessageKind.PREVIEW)[0]
    assert first.fields["scale"] == pytest.approx(4 / 1.7, rel=0.01)
    assert np.median(radii(first)) == pytest.approx(0.85, abs=0.1)
    client.settle(job)
    until(lambda: of(*FINAL))
    (result,) = of(*FINAL)
    assert result.kind is MessageKind.RESULT
    assert result.fields["report"]["error_mean"] < 0.003


BAD = {
    "off the surface": (JobKind.EDIT, {"stroke": STROKE | {"points": [[0, 0, 0.95]]}}),
    "no stroke": (JobKind.EDIT, {"stroke": {}}),
    "no solver": (JobKind.EDIT, {"solver": "magic"}),
    "no state": (JobKind.MESH, {"state": {}, "revision": "?"}),
    "wrong resolution": (JobKind.MESH, {"resolution": "64"}),
    "no primitive": (JobKind.FIT, {"primitive": "teapot"}),
    "no file": (JobKind.LOAD, {"path": "/nowhere/a.pth"}),
    "no folder": (JobKind.SAVE, {"path": "/nowhere/a.pth"}),
    "nothing to measure": (JobKind.MEASURE, {"revision": "?"}),
}


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_done_is_an_error_with_a_sentence(client, sphere, what):
    kind, changes = BAD[what]
    message = ended(client, kind, edit_fields(sphere.arrays["field"]) | changes)
    assert message.kind is MessageKind.ERROR
    assert message.fields["message"].endswith(".")
    assert message.fields["detail"] == ""  # foreseen, not a defect


@pytest.mark.parametrize("changes", [{"preset": "best"}, {"seed": -1}, {"thickness": "thin"}])
def test_a_fit_that_is_none_is_an_error_with_a_sentence(client, changes):
    mesh = {"vertices": np.eye(4, 3, dtype="<f4"), "triangles": np.eye(4, 3, dtype="<i4")}
    fields = {"preset": "draft", "seed": 1, "resolution": CELLS, **changes}
    message = ended(client, JobKind.FIT, fields, **mesh)
    assert message.kind is MessageKind.ERROR
    assert message.fields["message"].endswith(".")
    assert message.fields["detail"] == ""


@pytest.mark.parametrize("field", [np.zeros(0, "u1"), np.arange(200, dtype="u1")])
def test_a_field_that_is_none_is_an_error_with_a_sentence(client, field):
    message = ended(client, JobKind.MESH, state_of(field, "x"), **sent(field))
    assert (message.kind, message.fields["detail"]) == (MessageKind.ERROR, "")


def test_a_folder_of_any_name_works_and_its_neighbours_stay_unseen(tmp_path):
    package = tmp_path / "user default.neural-sculpt 1"
    leave_out = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "neural_sculpt_addon", package, ignore=leave_out)
    for neighbour in (tmp_path, package.parent, package / "worker"):
        for module in ("torch", "queue", "stroke", "json"):
            (Path(neighbour) / f"{module}.py").write_text("raise SystemExit('a neighbour came in')")
    command = [
        sys.executable,
        "-I",
        "-u",
        str(package / "worker" / "launch.py"),
        "server.server",
        "cpu",
    ]
    client = Client(command, tmp_path / "worker.log")
    client.start()
    try:
        done(client, JobKind.FIT, {"primitive": "sphere", "resolution": 16})
    finally:
        client.stop()
