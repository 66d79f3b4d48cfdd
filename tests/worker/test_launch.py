# SPDX-License-Identifier: GPL-3.0-or-later
"""The real worker, started as Blender starts it, from a folder of any name."""

import shutil
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.worker.client import Client, JobKind, Message, MessageKind
from neural_sculpt_addon.worker.environment import worker_command
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


def edit_fields(**changes: object) -> dict:
    return {
        "strokes": [STROKE],
        "solver": "paper",
        "epochs": 1,
        "resolution": CELLS,
        "revision": "a",
        "result_revision": "b",
    } | changes


def streamed_fields(**changes: object) -> dict:
    """Of an edit that shows a quick result first."""
    fields = edit_fields(solver="gauss_newton", quick_revision="quick", result_revision="final")
    return {name: value for name, value in fields.items() if name != "epochs"} | changes


def until_quick(client: Client, job: int) -> Message:
    """The quick result of a job, which must come before its last message."""
    while True:
        for message in client.poll_once():
            assert message.job == job
            assert message.kind not in FINAL, message.fields
            if message.kind is MessageKind.QUICK:
                return message
        time.sleep(0.01)


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
    counts = [
        len(done(client, JobKind.MESH, {"resolution": cells, "revision": "a"}, field=field)
            .arrays["triangles"])
        for cells in (32, 64)
    ]  # fmt: skip
    assert counts[1] == pytest.approx(4 * counts[0], rel=0.1)


def test_saved_fields_load_as_they_were(client, sphere, tmp_path):
    for name in ("field.safetensors", "field.pth"):
        path = str(tmp_path / name)
        saved = done(client, JobKind.SAVE, {"path": path}, field=sphere.arrays["field"])
        assert saved.fields == {"path": path}
        loaded = done(client, JobKind.LOAD, {"path": path, "resolution": CELLS})
        np.testing.assert_array_equal(loaded.arrays["vertices"], sphere.arrays["vertices"])
        assert loaded.fields["widths"] == [128, 128]


def test_an_edit_changes_the_field_where_the_stroke_is(client, sphere):
    field = sphere.arrays["field"]
    done(client, JobKind.PREPARE, {"revision": "a"}, field=field)
    edited = done(client, JobKind.EDIT, edit_fields(), field=field)
    assert len(edited.fields["reports"]) == 1
    assert edited.arrays["field"].tobytes() != field.tobytes()
    assert len(edited.arrays["vertices"]) == len(edited.arrays["normals"])


def test_an_edit_can_be_cancelled_and_the_next_job_runs(client, sphere):
    field = sphere.arrays["field"]
    job = client.submit(JobKind.EDIT, edit_fields(epochs=100_000), {"field": field})
    client.cancel(job)
    assert client.wait(job, timeout=PATIENCE).kind is MessageKind.CANCELLED
    done(client, JobKind.MESH, {"resolution": 32, "revision": "a"}, field=field)


def test_an_edit_shows_a_quick_result_and_then_a_closer_one(client, sphere):
    job = client.submit(JobKind.EDIT, streamed_fields(), {"field": sphere.arrays["field"]})
    quick = until_quick(client, job)
    final = client.wait(job, timeout=PATIENCE)
    assert final.kind is MessageKind.RESULT
    assert (quick.fields["revision"], final.fields["revision"]) == ("quick", "final")
    for message in (quick, final):
        assert radii(message).max() == pytest.approx(0.65, abs=0.01)
        alone = {"resolution": CELLS, "revision": message.fields["revision"]}
        meshed = done(client, JobKind.MESH, alone, field=message.arrays["field"])
        np.testing.assert_array_equal(meshed.arrays["vertices"], message.arrays["vertices"])
    assert final.fields["reports"][0]["tube_mean"] < 1e-3


def test_cancelled_after_its_quick_result_an_edit_is_built_upon_at_once(client, sphere):
    """The worker knows the quick result, and looks for its surface no more; what a cancel left
    unmade of its memory is made first."""
    job = client.submit(JobKind.EDIT, streamed_fields(), {"field": sphere.arrays["field"]})
    quick = until_quick(client, job)
    client.cancel(job)
    assert client.wait(job, timeout=PATIENCE).kind is MessageKind.CANCELLED
    said: list[str] = []
    fields = streamed_fields(revision="quick", quick_revision="q2", result_revision="r2")
    job = client.submit(JobKind.EDIT, fields, {"field": quick.arrays["field"]})
    final = client.wait(job, lambda _, message: said.append(message), timeout=PATIENCE)
    assert final.kind is MessageKind.RESULT
    assert said[0] in ("Preparing", "Sculpting")
    assert radii(final).max() == pytest.approx(0.70, abs=0.01)


def test_an_edit_of_which_no_quick_result_is_wanted_gives_none(client, sphere):
    fields = streamed_fields()
    del fields["quick_revision"]
    client.submit(JobKind.EDIT, fields, {"field": sphere.arrays["field"]})
    kinds = set()
    while not kinds & FINAL:
        kinds |= {message.kind for message in client.poll_once()}
        time.sleep(0.01)
    assert kinds == {MessageKind.PROGRESS, MessageKind.RESULT}


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

    until(lambda: any(m.fields["report"]["error"] < 0.006 for m in of(MessageKind.PREVIEW)))
    latest = of(MessageKind.PREVIEW)[-1]
    assert latest.fields["scale"] == pytest.approx(4 / 1.7, rel=0.01)
    assert np.median(radii(latest)) == pytest.approx(0.85, abs=0.02)
    client.settle(job)
    until(lambda: of(*FINAL))
    (result,) = of(*FINAL)
    assert result.kind is MessageKind.RESULT
    assert result.fields["report"]["error_mean"] < 0.003
    fractions = [message.fields["fraction"] for message in of(MessageKind.PROGRESS)]
    assert not any(0.75 < fraction < 0.82 for fraction in fractions)  # the last steps are left out


BAD = {
    "off the surface": (JobKind.EDIT, edit_fields(strokes=[STROKE | {"points": [[0, 0, 0.95]]}])),
    "no stroke": (JobKind.EDIT, edit_fields(strokes=[{}])),
    "no solver": (JobKind.EDIT, edit_fields(solver="magic")),
    "no resolution": (JobKind.MESH, {"revision": "a"}),
    "wrong resolution": (JobKind.MESH, {"resolution": "64", "revision": "a"}),
    "no primitive": (JobKind.FIT, {"primitive": "teapot", "resolution": CELLS}),
    "no file": (JobKind.LOAD, {"path": "/nowhere/a.pth", "resolution": CELLS}),
    "no folder": (JobKind.SAVE, {"path": "/nowhere/a.pth"}),
}


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_done_is_an_error_with_a_sentence(client, sphere, what):
    kind, fields = BAD[what]
    message = ended(client, kind, fields, field=sphere.arrays["field"])
    assert message.kind is MessageKind.ERROR
    assert message.fields["message"].endswith(".")
    assert message.fields["detail"] == ""  # foreseen, not a defect


@pytest.mark.parametrize("field", [np.zeros(0, "u1"), np.arange(200, dtype="u1")])
def test_a_field_that_is_none_is_an_error_with_a_sentence(client, field):
    message = ended(client, JobKind.MESH, {"resolution": 32, "revision": "x"}, field=field)
    assert (message.kind, message.fields["detail"]) == (MessageKind.ERROR, "")


def test_a_folder_of_any_name_works_and_its_neighbours_stay_unseen(tmp_path):
    package = tmp_path / "user default.neural-sculpt 1"
    leave_out = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "neural_sculpt_addon", package, ignore=leave_out)
    for neighbour in (tmp_path, package.parent, package / "worker"):
        for module in ("torch", "queue", "stroke", "json"):
            (Path(neighbour) / f"{module}.py").write_text("raise SystemExit('a neighbour came in')")
    command = [sys.executable, "-I", "-u", str(package / "worker" / "launch.py"), "server", "cpu"]
    client = Client(command, tmp_path / "worker.log")
    client.start()
    try:
        done(client, JobKind.FIT, {"primitive": "sphere", "resolution": 16})
    finally:
        client.stop()
