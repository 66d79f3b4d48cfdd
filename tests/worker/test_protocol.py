# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames: what goes in comes out, and nothing that breaks the rules gets in."""

import contextlib
import io
import json
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from neural_sculpt_addon.worker import protocol
from neural_sculpt_addon.worker.protocol import (
    DTYPES,
    MAX_HEADER,
    MAX_PAYLOAD,
    ControlKind,
    JobKind,
    Message,
    MessageKind,
    ProtocolError,
)

KINDS = [kind for kinds in (JobKind, ControlKind, MessageKind) for kind in kinds]
NUMBERS = st.integers(-(2**53), 2**53) | st.floats(allow_nan=False, allow_infinity=False)
JSON = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)
ARRAYS = st.sampled_from(sorted(DTYPES)).flatmap(
    lambda dtype: hnp.arrays(dtype, hnp.array_shapes(min_dims=0, min_side=0, max_side=5))
)
MESSAGES = st.builds(
    Message,
    st.sampled_from(KINDS),
    st.integers(0, 2**53),
    st.dictionaries(st.text(), JSON, max_size=4),
    st.dictionaries(st.text(), ARRAYS, max_size=4),
)


def sent(*messages: Message) -> io.BytesIO:
    stream = io.BytesIO()
    for message in messages:
        protocol.write(stream, message)
    stream.seek(0)
    return stream


def frame(content: object, payload: bytes = b"", **claims: int) -> io.BytesIO:
    """A frame with any header, as an object or as bytes, and with lengths that may be lies."""
    text = content if isinstance(content, bytes) else json.dumps(content).encode()
    header_length = claims.get("header_size", len(text))
    payload_length = claims.get("payload_size", len(payload))
    return io.BytesIO(struct.pack("<4sIQ", b"NSC1", header_length, payload_length) + text + payload)


def header(**members: object) -> dict[str, object]:
    return {"kind": "mesh", "job": 1, "fields": {}, "arrays": []} | members


def array(name: object = "a", dtype: object = "<f4", shape: object = (2,)) -> dict[str, object]:
    return header(arrays=[{"name": name, "dtype": dtype, "shape": shape}])


@given(st.lists(MESSAGES, max_size=3))
def test_what_goes_in_comes_out(messages):
    stream = sent(*messages)
    for message in messages:
        back = protocol.read(stream)
        assert back is not None
        assert back.kind is message.kind
        assert (back.job, back.fields) == (message.job, message.fields)
        assert list(back.arrays) == list(message.arrays)
        for name, content in message.arrays.items():
            assert back.arrays[name].dtype == content.dtype
            assert back.arrays[name].shape == content.shape
            assert back.arrays[name].tobytes() == content.tobytes()
    assert protocol.read(stream) is None


def test_the_layout_is_the_documented_one():
    data = sent(Message(JobKind.MESH, 7, {"a": 1}, {"x": np.array([1, -2], "<i4")})).getvalue()
    length, payload = struct.unpack("<IQ", data[4:16])
    assert data[:4] == b"NSC1"
    assert payload == 8
    assert json.loads(data[16 : 16 + length]) == {
        "kind": "mesh",
        "job": 7,
        "fields": {"a": 1},
        "arrays": [{"name": "x", "dtype": "<i4", "shape": [2]}],
    }
    assert data[16 + length :] == struct.pack("<ii", 1, -2)


def test_strided_and_big_endian_arrays_arrive_in_order():
    grid = np.arange(12, dtype=">f8").reshape(3, 4)
    back = protocol.read(sent(Message(JobKind.MESH, 1, {}, {"a": grid.T[::2], "b": grid})))
    assert back is not None
    np.testing.assert_array_equal(back.arrays["a"], grid.T[::2])
    np.testing.assert_array_equal(back.arrays["b"], grid)


@pytest.mark.parametrize(
    "message",
    [
        Message(JobKind.MESH, 1, {"a": float("nan")}),
        Message(JobKind.MESH, 1, {"a": [float("inf")]}),
        Message(JobKind.MESH, 1, {"a": object()}),
        Message(JobKind.MESH, 1, {"a": np.float32(1)}),
        Message(JobKind.MESH, 1, {"a": "x" * (MAX_HEADER + 1)}),
        Message(JobKind.MESH, 1, {}, {"a": np.zeros(2, bool)}),
        Message(JobKind.MESH, 1, {}, {"a": np.zeros(2, np.float16)}),
        Message(JobKind.MESH, 1, {}, {"a": np.array(["x"])}),
        Message(JobKind.MESH, 1, {}, {"a": np.array([None])}),
        Message(
            JobKind.MESH,
            1,
            {},
            {"a": np.broadcast_to(np.zeros(1, np.uint8), (MAX_PAYLOAD + 1,))},
        ),
    ],
)
def test_what_cannot_be_sent_is_said_at_once(message):
    with pytest.raises(ProtocolError):
        protocol.write(io.BytesIO(), message)


@pytest.mark.parametrize(
    ("stream", "what"),
    [
        (io.BytesIO(b"Traceback (most recent call last):\n"), "no frame"),
        (io.BytesIO(b"NSC2" + bytes(12)), "no frame"),
        (frame(header(), header_size=MAX_HEADER + 1), "too large"),
        (frame(header(), payload_size=MAX_PAYLOAD + 1), "too large"),
        (frame(header(), header_size=2**32 - 1), "too large"),
        (frame(header(), payload_size=2**64 - 1), "too large"),
        (frame(b"{"), "not JSON"),
        (frame(b"\xff\xfe"), "not JSON"),
        (frame(json.dumps(header()).encode("utf-16")), "not JSON"),
        (frame(b"[" * 100_000), "not JSON"),
        (frame(b"9" * 10_000), "not JSON"),
        (frame(header(fields={"a": float("nan")})), "not JSON"),
        (frame(json.dumps(header()).replace("{}", '{"a":1e999}').encode()), "not JSON"),
        (frame([]), "members"),
        (frame({}), "members"),
        (frame(header(extra=1)), "members"),
        (frame(header(kind=1)), "no str"),
        (frame(header(kind="exec")), "unknown kind"),
        (frame(header(job=True)), "no int"),
        (frame(header(job=1.0)), "no int"),
        (frame(header(job=-1)), "job number"),
        (frame(header(job=2**60)), "job number"),
        (frame(header(fields=[])), "no dict"),
        (frame(header(arrays={})), "no list"),
        (frame(header(arrays=[1])), "members"),
        (frame(header(arrays=[{"name": "a"}])), "members"),
        (frame(array(name=1), bytes(8)), "no str"),
        (frame(array(dtype="|O"), bytes(16)), "dtype"),
        (frame(array(dtype="<f4,<f4"), bytes(16)), "dtype"),
        (frame(array(dtype=">f4"), bytes(8)), "dtype"),
        (frame(array(shape="2"), bytes(8)), "no list"),
        (frame(array(shape=[2.0]), bytes(8)), "shape"),
        (frame(array(shape=[True]), bytes(4)), "shape"),
        (frame(array(shape=[-2]), bytes(8)), "shape"),
        (frame(array(shape=[1] * 33), bytes(4)), "shape"),
        (frame(array(shape=[0, 2**62, 2**62])), "too large"),
        (frame(array(shape=[2**62, 4])), "too large"),
        (frame(array(shape=[3]), bytes(8)), "add up"),
        (frame(array(shape=[1]), bytes(8)), "add up"),
        (frame(header(), bytes(1)), "add up"),
        (frame(header(arrays=array()["arrays"] * 2), bytes(16)), "same name"),
    ],
)
def test_malicious_frames_are_refused(stream, what):
    with pytest.raises(ProtocolError, match=what):
        protocol.read(stream)


def test_lengths_are_checked_before_the_header_is_read():
    lie = frame(header(), header_size=MAX_HEADER + 1)
    with pytest.raises(ProtocolError):
        protocol.read(lie)
    assert lie.tell() == 16


def test_shapes_are_checked_before_the_payload_is_read():
    lie = frame(array(shape=[2**28]), bytes(64), payload_size=MAX_PAYLOAD)
    with pytest.raises(ProtocolError):
        protocol.read(lie)
    assert lie.tell() == len(lie.getvalue()) - 64


@given(MESSAGES.filter(lambda message: message.arrays), st.data())
def test_a_frame_cut_short_is_refused_wherever_it_is_cut(message, data):
    whole = sent(message).getvalue()
    cut = data.draw(st.integers(1, len(whole) - 1))
    with pytest.raises(ProtocolError):
        protocol.read(io.BytesIO(whole[:cut]))


@given(st.binary(max_size=64))
def test_garbage_never_gets_further_than_an_error(garbage):
    if garbage:
        with pytest.raises(ProtocolError):
            protocol.read(io.BytesIO(garbage))


@given(MESSAGES, st.data())
def test_a_flipped_byte_gives_a_message_or_a_protocol_error(message, data):
    whole = bytearray(sent(message).getvalue())
    whole[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    with contextlib.suppress(ProtocolError):
        protocol.read(io.BytesIO(bytes(whole)))
