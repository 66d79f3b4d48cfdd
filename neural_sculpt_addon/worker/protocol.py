# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames between Blender's process and the worker's. NumPy and the standard library only.

A frame is `NSC1`, the header's length (uint32) and the payload's length (uint64), both
little-endian, a JSON header in UTF-8 and the bytes of the arrays one after another:

    {"kind": "edit", "job": 7, "fields": {...},
     "arrays": [{"name": "field", "dtype": "|u1", "shape": [71680]}, ...]}

Nothing is trusted: every length, name, dtype and shape is checked before memory is asked for, and
no frame can make its reader run anything. A frame that breaks the rules raises ProtocolError.
"""

import json
import math
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from io import BufferedIOBase
from typing import Any, NoReturn

import numpy as np

from ..common.errors import SculptError

PROTOCOL = 5
"""Raised whenever the two sides of an older and a newer add-on would misunderstand each other."""

MAX_HEADER = 16 << 20  # bytes: a history of hundreds of strokes with images
MAX_PAYLOAD = 2 << 30  # bytes
DTYPES = frozenset({"<f4", "<f8", "<i4", "<i8", "|u1"})

_MAGIC = b"NSC1"
_PREFIX = struct.Struct("<4sIQ")
_MAX_JOB = 2**53  # the integers that JSON carries exactly
_MAX_DIMENSIONS = 8


class ProtocolError(SculptError):
    """The other side does not speak this protocol."""


class JobKind(StrEnum):
    """What Blender asks the worker to do."""

    EDIT = "edit"
    REPLAY = "replay"
    MEASURE = "measure"
    MESH = "mesh"
    FIT = "fit"
    ABSORB_PROXY = "absorb_proxy"
    ABSORB_STROKE = "absorb_stroke"
    BOOLEAN = "boolean"
    BOOLEAN_MESH = "boolean_mesh"
    LOAD = "load"
    SAVE = "save"
    SAMPLE = "sample"
    PREPARE = "prepare"
    APPLY_TO_BASE = "apply_to_base"
    CONSOLIDATE = "consolidate"


class ControlKind(StrEnum):
    """What Blender says about jobs."""

    CANCEL = "cancel"
    ENOUGH = "enough"


class MessageKind(StrEnum):
    """What the worker says: hello once, then per job any progress and one of the last three.

    preview: what the result looks like so far, any number of times
    """

    HELLO = "hello"
    PROGRESS = "progress"
    PREVIEW = "preview"
    RESULT = "result"
    ERROR = "error"
    CANCELLED = "cancelled"


Kind = JobKind | ControlKind | MessageKind
FINAL = frozenset({MessageKind.RESULT, MessageKind.ERROR, MessageKind.CANCELLED})
"""Every job ends with exactly one of these."""

_KINDS: dict[str, Kind] = {
    kind.value: kind for kinds in (JobKind, ControlKind, MessageKind) for kind in kinds
}


@dataclass(frozen=True)
class Message:
    """One frame. `fields` is JSON without NaN; `arrays` have one of DTYPES and any shape."""

    kind: Kind
    job: int = 0
    fields: dict[str, Any] = field(default_factory=dict)
    arrays: dict[str, np.ndarray] = field(default_factory=dict)


def write(stream: BufferedIOBase, message: Message) -> None:
    """Write one frame.

    Raises ProtocolError for what cannot be sent: other dtypes, NaN in a field, too many bytes.
    """
    stream.writelines(pieces(message))


def pieces(message: Message) -> list[bytes | memoryview]:
    """The frame as pieces to be written in order, the arrays where they are."""
    size = sum(array.nbytes for array in message.arrays.values())
    _check_sizes(0, size)  # before anything is copied
    arrays = {name: _little_endian(name, array) for name, array in message.arrays.items()}
    header = {
        "kind": message.kind.value,
        "job": message.job,
        "fields": message.fields,
        "arrays": [
            {"name": name, "dtype": array.dtype.str, "shape": array.shape}
            for name, array in arrays.items()
        ],
    }
    try:
        text = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
    except (TypeError, ValueError, RecursionError) as error:
        raise ProtocolError(f"The fields of a {message.kind} cannot be sent: {error}.") from error
    _check_sizes(len(text), size)
    prefix = _PREFIX.pack(_MAGIC, len(text), size)
    return [prefix, text, *(array.reshape(-1).view(np.uint8).data for array in arrays.values())]


def read(stream: BufferedIOBase) -> Message | None:
    """The next frame; None where the stream ends between two frames. ProtocolError otherwise."""
    return next(filter(None, reading(stream)), None)


def reading(stream: BufferedIOBase) -> Iterator[Message | None]:
    """Read the next frame bit by bit: None after each of its arrays, then the message.

    Nothing comes where the stream ends between two frames. ProtocolError otherwise.
    """
    prefix = bytearray(_PREFIX.size)
    got = _fill(stream, memoryview(prefix))
    if got == 0:
        return
    _require_whole(got, len(prefix))
    magic, header_size, payload_size = _PREFIX.unpack(prefix)
    if magic != _MAGIC:
        raise ProtocolError(f"These bytes are no frame of Neural Sculpt: {bytes(prefix[:8])!r}.")
    _check_sizes(header_size, payload_size)
    text = bytearray(header_size)
    _require_whole(_fill(stream, memoryview(text)), header_size)
    kind, job, fields, layout = _parse(bytes(text), payload_size)
    arrays = {}
    for name, dtype, shape in layout:
        try:
            array = np.empty(shape, dtype)
        except MemoryError as error:
            raise ProtocolError(f"There is no memory for the array {name!r:.100}.") from error
        if array.size:
            content = array.reshape(-1).view(np.uint8).data
            _require_whole(_fill(stream, content), array.nbytes)
        arrays[name] = array
        yield None
    yield Message(kind, job, fields, arrays)


_Layout = list[tuple[str, str, tuple[int, ...]]]


def _parse(text: bytes, payload_size: int) -> tuple[Kind, int, dict[str, Any], _Layout]:
    """The checked header: kind, job, fields, and name, dtype and shape of each array."""
    try:
        header = json.loads(text.decode(), parse_constant=_no_constant, parse_float=_finite)
    except (ValueError, RecursionError) as error:
        raise ProtocolError(f"The header of a frame is not JSON: {error}.") from error
    header = _members(header, "header", kind=str, job=int, fields=dict, arrays=list)
    kind = _KINDS.get(header["kind"])
    if kind is None:
        raise ProtocolError(f"A frame has the unknown kind {header['kind']!r:.100}.")
    if not 0 <= header["job"] <= _MAX_JOB:
        raise ProtocolError("A frame has an impossible job number.")
    layout: _Layout = []
    total = 0
    for item in header["arrays"]:
        array = _members(item, "array", name=str, dtype=str, shape=list)
        total += _bytes_of(array)
        layout.append((array["name"], array["dtype"], tuple(array["shape"])))
    if len({name for name, _, _ in layout}) != len(layout):
        raise ProtocolError("Two arrays of a frame have the same name.")
    if total != payload_size:
        raise ProtocolError(f"The arrays of a frame add up to {total} bytes, not {payload_size}.")
    return kind, header["job"], header["fields"], layout


def _members(value: object, what: str, **types: type) -> Mapping[str, Any]:
    """`value` as an object with exactly these members of exactly these types."""
    if not isinstance(value, dict) or value.keys() != types.keys():
        raise ProtocolError(f"The {what} of a frame must have the members {', '.join(types)}.")
    for name, wanted in types.items():
        if type(value[name]) is not wanted:  # a bool is an int to isinstance
            raise ProtocolError(f"{name!r} in the {what} of a frame is no {wanted.__name__}.")
    return value


def _bytes_of(array: Mapping[str, Any]) -> int:
    """Size of an array as described, bounded without multiplying anything that overflows."""
    if array["dtype"] not in DTYPES:
        raise ProtocolError(f"An array of a frame has the dtype {array['dtype']!r:.100}.")
    shape = array["shape"]
    if len(shape) > _MAX_DIMENSIONS or any(type(n) is not int or n < 0 for n in shape):
        raise ProtocolError("An array of a frame has an impossible shape.")
    itemsize = np.dtype(array["dtype"]).itemsize
    if itemsize * math.prod(n for n in shape if n) > MAX_PAYLOAD:  # empty axes must not hide others
        raise ProtocolError("An array of a frame is too large.")
    return itemsize * math.prod(shape)


def _little_endian(name: str, array: np.ndarray) -> np.ndarray:
    dtype = array.dtype.newbyteorder("<")
    if dtype.str not in DTYPES:
        raise ProtocolError(f"The array {name!r} has a dtype that cannot be sent: {array.dtype}.")
    return array.astype(dtype, order="C", copy=False)


def _check_sizes(header: int, payload: int) -> None:
    if header > MAX_HEADER or payload > MAX_PAYLOAD:
        raise ProtocolError(f"A frame of {header} + {payload} bytes is too large.")


def _fill(stream: BufferedIOBase, into: memoryview) -> int:
    """Read until `into` is full or the stream ends; how many bytes came."""
    got = 0
    while got < len(into):
        read_now = stream.readinto(into[got:])
        if not read_now:
            break
        got += read_now
    return got


def _require_whole(got: int, size: int) -> None:
    if got != size:
        raise ProtocolError(f"A frame ends after {got} of {size} bytes.")


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not allowed")


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is not a finite number")
    return number
