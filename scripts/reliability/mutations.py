# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutations of bytes, as fuzzing makes them: the same random numbers give the same bytes."""

import json
import struct
from random import Random
from typing import Any

PREFIX = struct.Struct("<4sIQ")  # of a frame
VALUES = (
    *(
        None,
        True,
        0,
        1,
        -1,
        0.5,
        1e308,
        -1e-308,
        2**31,
        2**63,
        10**40,
        "",
        "a",
        "\x00",
        "/",
        "..",
        [],
    ),
    *({}, [[]], [None], [1.0, 2.0, 3.0], [[0, 0, 0]], {"a": 1}, "x" * 10_000, list(range(1000))),
    *("result", "error", "cancel", "edit", "mesh", "<f8", "|u1", "O", [2**40], [-1], [2**62, 4]),
)
HOSTILE = (
    *(b"NaN", b"-1", b"0", b"1e308", b"1e-308", b"1e30", b"99999999999999999999", b"null", b"[]"),
    *(b"{}", b'""', b"true", b"\x00\x00\x00\x00", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f"),
    *(b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f", b"[" * 3000, b"9" * 5000, "\u202e\ud7ff".encode()),
)


def mutated(data: bytes, random: Random) -> bytes:
    """`data` with one to eight mutations: bits and bytes changed, pieces cut, doubled, replaced."""
    changed = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 4, 8))):
        at = random.randrange(len(changed) + 1)
        length = random.choice((1, 2, 4, 8, 64, 1024))
        match random.randrange(7):
            case 0 if at < len(changed):
                changed[at] ^= 1 << random.randrange(8)
            case 1 if at < len(changed):
                changed[at] = random.randrange(256)
            case 2:
                changed[at : at + length] = random.choice(HOSTILE)
            case 3:
                del changed[at : at + length]
            case 4:
                changed[at:at] = changed[at : at + length]
            case 5:
                changed[at : at + length] = random.randbytes(length)
            case 6 if random.random() < 0.2:
                del changed[at:]
    return bytes(changed)


def mutated_frame(frame: bytes, random: Random) -> bytes:
    """A frame (see worker.protocol) with mutations anywhere, in its header's text, or of a value.

    The last two have the length that they say, so that more than the first check meets them.
    """
    _, header, payload = PREFIX.unpack_from(frame)
    text, arrays = frame[PREFIX.size : PREFIX.size + header], frame[PREFIX.size + header :]
    match random.randrange(4):
        case 0:
            return mutated(frame, random)
        case 1:
            text = mutated(text, random)
        case _:
            text = json.dumps(_one_value_replaced(json.loads(text), random)).encode()
    return PREFIX.pack(b"NSC1", len(text), payload) + text + arrays


def _one_value_replaced(header: Any, random: Random) -> Any:
    """The same JSON with one value, anywhere in it, replaced by another, or gone."""
    places: list[tuple[Any, Any]] = []

    def visit(node: Any) -> None:
        for key in list(node) if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], dict | list):
                visit(node[key])

    visit(header)
    node, key = random.choice(places)
    if random.random() < 0.1:
        del node[key]
    else:
        node[key] = random.choice(VALUES)
    return header
