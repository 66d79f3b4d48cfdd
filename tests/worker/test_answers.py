# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender believes of the worker's answers."""

import sys

import numpy as np
import pytest

from neural_sculpt_addon.worker import answers
from neural_sculpt_addon.worker.protocol import JobKind, Message, MessageKind, ProtocolError

EDITED = {"revision": "r", "seconds": 0.1, "layer": "a", "context": "c"}
ABSORBED = {"revision": "r", "layer": "a", "context": "c", "report": {}}
REPLAYED = {"revision": "r", "layers": [{"id": "a", "context": "c"}] * 2}
REBASED = {"revision": "r", "seconds": 0.1, "base": "b"}


def proxy(count=3):
    points = np.zeros((count, 3), "<f4")
    triangles = np.zeros((count, 3), "<i4")
    edges = np.zeros((count, 2), "<i4")
    return {
        "vertices": points,
        "normals": points.copy(),
        "triangles": triangles,
        "edges": edges,
        "corner_edges": triangles.copy(),
    }


def model(count=3):
    return {"field": np.ones(5, "u1"), **proxy(count)}


def snapped():
    points = np.zeros((4, 3), np.float32)
    return {"layer": np.ones(3, np.uint8), "snapped": points, "snapped_normals": points}


def layered(count=3):
    return {"layer": np.ones(5, "u1"), **proxy(count)}


def result(fields, arrays):
    return Message(MessageKind.RESULT, 1, fields, arrays)


PLACED = {"id": "b", "scale": 2.0, "center": [0.0, 1, 2.0], "report": {}}
GOOD = [
    (JobKind.EDIT, EDITED, layered()),
    (JobKind.EDIT, REBASED, model()),
    (JobKind.REPLAY, REPLAYED, {"layer.1": np.ones(5, "u1"), **proxy()}),
    (JobKind.REPLAY, {"revision": "r", "base": "b"}, model()),
    (JobKind.ABSORB_PROXY, ABSORBED, layered()),
    (JobKind.BOOLEAN, ABSORBED, layered()),
    (JobKind.ABSORB_STROKE, ABSORBED | {"stretched": True}, layered() | snapped()),
    (JobKind.FIT, PLACED, model()),
    (JobKind.LOAD, {"id": "b"}, model()),
    (JobKind.APPLY_TO_BASE, {"id": "b"}, {"field": np.ones(5, "u1")}),
    (JobKind.CONSOLIDATE, {"revision": "r", "id": "b", "report": {}}, model()),
    (JobKind.MEASURE, {"report": {"drift_mean": 0.1}}, {}),
    (JobKind.MESH, {}, proxy()),
    (JobKind.BOOLEAN_MESH, {}, proxy()),
    (JobKind.SAMPLE, {}, {"band": np.zeros((4, 4, 4), "<f4")}),
    (JobKind.SAVE, {}, {}),
    (JobKind.PREPARE, {}, {}),
]


@pytest.mark.parametrize(("job", "fields", "arrays"), GOOD)
def test_what_the_worker_answers_is_believed(job, fields, arrays):
    answers.check(job, result(fields, arrays))
    answers.check(job, Message(MessageKind.CANCELLED, 1))


@pytest.mark.parametrize(("job", "fields", "arrays"), GOOD)
def test_nothing_may_be_missing(job, fields, arrays):
    for name in arrays.keys() - {"layer.1"}:  # what the worker did not solve again
        with pytest.raises(ProtocolError, match=name):
            answers.check(job, result(fields, {k: v for k, v in arrays.items() if k != name}))
    for name in fields:
        with pytest.raises(ProtocolError):
            answers.check(job, result({k: v for k, v in fields.items() if k != name}, arrays))


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("vertices", np.full((3, 3), np.nan, "<f4")),
        ("vertices", np.full((3, 3), np.inf, "<f4")),
        ("vertices", np.zeros((3, 2), "<f4")),
        ("vertices", np.zeros((3, 3), "<i4")),
        ("normals", np.full((3, 3), -np.inf, "<f4")),
        ("normals", np.zeros((2, 3), "<f4")),
        ("triangles", np.full((3, 3), 3, "<i4")),
        ("triangles", np.full((3, 3), -1, "<i4")),
        ("triangles", np.zeros(9, "<i4")),
        ("edges", np.full((3, 2), 3, "<i4")),
        ("corner_edges", np.full((3, 3), 3, "<i4")),
        ("corner_edges", np.zeros((2, 3), "<i4")),
        ("layer", np.zeros(0, "u1")),
        ("layer", np.zeros(5, "<f4")),
    ],
)
def test_arrays_that_blender_cannot_show_are_refused(name, wrong):
    with pytest.raises(ProtocolError, match=name):
        answers.check(JobKind.EDIT, result(EDITED, {**layered(), name: wrong}))


@pytest.mark.parametrize(
    ("job", "field", "wrong"),
    [
        (JobKind.ABSORB_STROKE, "report", {"error_mean": "much"}),
        (JobKind.EDIT, "revision", ["a"]),
        (JobKind.EDIT, "revision", ""),
        (JobKind.EDIT, "seconds", "1"),
        (JobKind.EDIT, "seconds", True),
        (JobKind.EDIT, "seconds", 10**400),
        (JobKind.EDIT, "layer", ""),
        (JobKind.EDIT, "context", None),
        (JobKind.REPLAY, "layers", {}),
        (JobKind.REPLAY, "layers", [1]),
        (JobKind.REPLAY, "layers", [{"id": "a"}]),
        (JobKind.REPLAY, "layers", [{"id": "", "context": "c"}]),
        (JobKind.MEASURE, "report", []),
        (JobKind.FIT, "scale", 0.0),
        (JobKind.FIT, "scale", True),
        (JobKind.FIT, "center", [0.0, 1.0]),
        (JobKind.FIT, "center", [0.0, 1.0, "2"]),
    ],
)
def test_fields_of_another_kind_are_refused(job, field, wrong):
    fields, arrays = next((fields, arrays) for kind, fields, arrays in GOOD if kind is job)
    with pytest.raises(ProtocolError):
        answers.check(job, result({**fields, field: wrong}, arrays))


@pytest.mark.parametrize(
    "message",
    [
        Message(MessageKind.PROGRESS, 1, {"fraction": "0.5", "message": ""}),
        Message(MessageKind.PROGRESS, 1, {"fraction": 0.5}),
        Message(MessageKind.PROGRESS, 1, {"fraction": 0.5, "message": ["{} of {}", "1"]}),
        Message(MessageKind.ERROR, 1, {"message": 3, "detail": ""}),
        Message(MessageKind.ERROR, 1, {"message": ["{}", ["{}", 3]], "detail": ""}),
        Message(MessageKind.ERROR, 1, {"message": "", "detail": "", "missing": [1]}),
        Message(MessageKind.HELLO, 0, {}),
        Message(JobKind.EDIT, 1),
    ],
)
def test_messages_without_what_belongs_to_them(message):
    assert answers.why_malformed(message)


def test_vertices_that_a_brush_stroke_moves_need_normals():
    brushed = ABSORBED | {"stretched": False}
    answers.check(JobKind.ABSORB_STROKE, result(brushed, snapped()))
    with pytest.raises(ProtocolError, match="stretched"):
        answers.check(JobKind.ABSORB_STROKE, result(ABSORBED, snapped()))
    for wrong in (np.zeros((3, 3), np.float32), np.full((4, 3), np.nan, np.float32)):
        with pytest.raises(ProtocolError, match="snapped_normals"):
            answers.check(
                JobKind.ABSORB_STROKE, result(brushed, snapped() | {"snapped_normals": wrong})
            )
    with pytest.raises(ProtocolError, match="snapped"):
        answers.check(JobKind.ABSORB_STROKE, result(brushed, {"layer": np.ones(3, np.uint8)}))
    with pytest.raises(ProtocolError, match="normals"):  # of another proxy, which may be there
        some = {"vertices": np.zeros((4, 3), np.float32)}
        answers.check(JobKind.ABSORB_STROKE, result(brushed, snapped() | some))


def test_a_large_proxy_is_looked_at_by_numpy_alone():
    """No vertex has a call of its own, so Blender's window does not wait for it."""

    def calls(count):
        called, message = [], result(EDITED, layered(count))
        sys.setprofile(lambda _frame, event, _given: called.append(event))
        try:
            answers.check(JobKind.EDIT, message)
        finally:
            sys.setprofile(None)
        return len(called)

    assert calls(100_000) == calls(100) > 0
