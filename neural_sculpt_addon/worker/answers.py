# SPDX-License-Identifier: GPL-3.0-or-later
"""Check of the worker's messages, before Blender believes what they hold.

`protocol` has read them: fields are JSON without NaN, and arrays are as long as their shapes say.
Here each kind of message must have the fields and arrays that Blender uses, of the right types, all
numbers finite and all indices in range. NumPy and the standard library only; the check of 100,000
triangles takes some 1 ms.
"""

import math
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.text import from_json
from .protocol import JobKind, Message, MessageKind, ProtocolError

_RESULTS = frozenset({MessageKind.RESULT, MessageKind.PREVIEW})
_LAYER_JOBS = frozenset({JobKind.ABSORB_PROXY, JobKind.ABSORB_STROKE, JobKind.BOOLEAN})
"""Jobs whose result is one more layer, with a report."""

SNAPPED = "snapped", "snapped_normals"
"""The arrays of a result that can move a part of the proxy instead of replacing all of it."""

_STATE_JOBS = _LAYER_JOBS | {JobKind.EDIT, JobKind.REPLAY, JobKind.CONSOLIDATE}
"""Jobs whose result is another state of the field."""

PROXY = ("vertices", "normals", "triangles", "edges", "corner_edges")
"""The arrays of a mesh."""

_NOTHING = np.empty(0, bool)  # of a kind that no result has


def is_remade(arrays: Mapping[str, Any]) -> bool:
    """Whether a result brings another proxy."""
    return "vertices" in arrays


def why_malformed(message: Message) -> str:
    """What is wrong with a message, as the end of a sentence; empty when nothing is.

    Of a result `check` tells, which needs to know the kind of the job.
    """
    if not isinstance(message.kind, MessageKind):
        return f"it sent a {message.kind}"
    wanted = {
        MessageKind.HELLO: {"protocol": _is_integer},
        MessageKind.PROGRESS: {"fraction": _is_number, "message": _is_text},
        MessageKind.ERROR: {"message": _is_text, "detail": _is_string},
    }.get(message.kind, {})
    for name, is_right in wanted.items():
        if not is_right(message.fields.get(name)):
            return f"its {message.kind} has no {name!r}"
    if not _is_list_of(message.fields.get("missing", []), _is_string):
        return f"the ids that its {message.kind} misses are no strings"
    return ""


def check(job: JobKind, message: Message) -> None:
    """Check a result, or a preview, of a job of this kind; other messages pass.

    ProtocolError when something is missing or not as it should be.
    """
    if message.kind not in _RESULTS:
        return
    fields, arrays = message.fields, message.arrays
    if job is JobKind.FIT:
        _check_place(fields)
    if message.kind is MessageKind.PREVIEW:
        _check_proxy(arrays)
        return
    if job in _STATE_JOBS:
        _check_state(job, fields, arrays)
    if job is JobKind.EDIT:
        _require("layer" in fields or "base" in fields, "layer")
        _require(_is_number(fields.get("seconds")), "seconds")
    elif job in _LAYER_JOBS:
        _require("layer" in fields, "layer")
    elif job is JobKind.REPLAY:
        _require("layers" in fields or "base" in fields, "layers")
    elif job in {JobKind.FIT, JobKind.LOAD}:
        _check_report(fields, required=job is JobKind.FIT)
        _require(_is_name(fields.get("id")), "id")
        _check_parts(fields, arrays)
        _check_proxy(arrays)
    elif job in {JobKind.APPLY_TO_BASE, JobKind.CONSOLIDATE}:
        _require(_is_name(fields.get("id")), "id")
        _check_parts(fields, arrays)
    elif job is JobKind.MEASURE:
        _check_report(fields, required=True)
    elif job in {JobKind.MESH, JobKind.BOOLEAN_MESH}:
        _check_proxy(arrays)
    elif job is JobKind.SAMPLE:
        band = _array(arrays, "band", "f", 3)
        _require(min(band.shape) > 1 and len({*band.shape}) == 1, "band")
        _require_finite(band, "band")


def _check_state(
    job: JobKind, fields: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Check the result of a job that makes another state: report, layers and proxy."""
    _require(_is_name(fields.get("revision")), "revision")
    _check_report(fields, required=job in _LAYER_JOBS | {JobKind.CONSOLIDATE})
    _check_parts(fields, arrays)
    if job is JobKind.ABSORB_STROKE:
        _require(type(fields.get("stretched")) is bool, "stretched")
        _check_points(arrays, *SNAPPED)
    if job is not JobKind.ABSORB_STROKE or any(name in arrays for name in PROXY):
        _check_proxy(arrays)


def _check_place(fields: Mapping[str, Any]) -> None:
    """Check the place of a fitted field: scale and center."""
    center = fields.get("center")
    _require(_is_number(fields.get("scale")) and fields["scale"] > 0, "scale")
    _require(_is_list_of(center, _is_number) and len(center or ()) == 3, "center")


def _check_report(fields: Mapping[str, Any], required: bool) -> None:
    report = fields.get("report", None if required else {})
    _require(type(report) is dict and _is_number(report.get("error_mean", 0.0)), "report")
    notes = report.get("notes", [])
    _require(type(notes) is list and all(map(_is_text, notes)), "report")


def _check_parts(fields: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Check the ids of fields and layers, and that their bytes are there."""
    for name, array in (("id", "field"), ("base", "field"), ("layer", "layer")):
        if name in fields:
            _require(_is_name(fields[name]), name)
            _require(len(_array(arrays, array, "u", 1)) > 0, array)
    if "layer" in fields:
        _require(type(fields.get("context")) is str, "context")
    layers = fields.get("layers", [])
    _require(_is_list_of(layers, lambda each: type(each) is dict), "layers")
    for number, layer in enumerate(layers):
        _require(_is_name(layer.get("id")) and type(layer.get("context")) is str, "layers")
        if (name := f"layer.{number}") in arrays:
            _require(len(_array(arrays, name, "u", 1)) > 0, name)


def _check_proxy(arrays: Mapping[str, NDArray[Any]]) -> None:
    """Check a mesh, for Blender crashes on indices that are out of range."""
    vertices = _check_points(arrays, "vertices", "normals")
    triangles = _array(arrays, "triangles", "i", 2, 3)
    edges = _array(arrays, "edges", "i", 2, 2)
    corner_edges = _array(arrays, "corner_edges", "i", 2, 3)
    _require(triangles.shape == corner_edges.shape, "corner_edges")
    _require_within(triangles, len(vertices), "triangles")
    _require_within(edges, len(vertices), "edges")
    _require_within(corner_edges, len(edges), "corner_edges")


def _check_points(arrays: Mapping[str, NDArray[Any]], vertices: str, normals: str) -> NDArray[Any]:
    """Check points and normals, (N, 3) each, and return the points."""
    points, beside = (_array(arrays, name, "f", 2, 3) for name in (vertices, normals))
    _require(points.shape == beside.shape, normals)
    _require_finite(points, vertices)
    _require_finite(beside, normals)
    return points


def _array(
    arrays: Mapping[str, NDArray[Any]], name: str, kind: str, axes: int, last: int | None = None
) -> NDArray[Any]:
    """An array of a kind of numbers (see numpy.dtype.kind) and a number of axes."""
    array = arrays.get(name, _NOTHING)
    _require(array.dtype.kind == kind and array.ndim == axes, name)
    _require(last is None or array.shape[-1] == last, name)
    return array


def _require(fulfilled: object, name: str) -> None:
    if not fulfilled:
        raise ProtocolError(f"its result has no {name!r}, or it is not as it should be.")


def _require_finite(array: NDArray[Any], name: str) -> None:
    """By the sum, which is finite only when all numbers are, and takes no memory."""
    with np.errstate(over="ignore", invalid="ignore"):
        finite = math.isfinite(float(array.sum(dtype=np.float64)))
    if not finite:
        raise ProtocolError(f"the {name} of its result are not all finite.")


def _require_within(indices: NDArray[Any], count: int, name: str) -> None:
    if indices.size and not (indices.min() >= 0 and indices.max() < count):
        raise ProtocolError(f"the {name} of its result point beyond its mesh.")


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max  # an integer of JSON has any number of digits


def _is_integer(value: object) -> bool:
    return type(value) is int


def _is_string(value: object) -> bool:
    return type(value) is str


def _is_text(value: object) -> bool:
    try:
        from_json(value)
    except ValueError:
        return False
    return True


def _is_name(value: object) -> bool:
    return type(value) is str and bool(value)


def _is_list_of(value: object, is_right: Callable[[object], bool]) -> bool:
    return isinstance(value, list) and all(map(is_right, value))
