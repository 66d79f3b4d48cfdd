# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutations of bytes, as fuzzing makes them: the same random numbers give the same bytes."""

from random import Random

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
