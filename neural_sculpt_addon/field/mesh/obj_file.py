# SPDX-License-Identifier: GPL-3.0-or-later
"""OBJ files: their vertices, and faces of any number of corners. All else is passed over.

The format is Wavefront's. A line `v` begins with three coordinates; what may follow are a weight or
a color. A line `f` has a corner in each word, which begins with the number of its vertex: from 1
on, or counting back from the last vertex before the line. What follows a # is a comment, as
ZBrush's colors are, and a line that ends in a backslash goes on in the next one.
"""

import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .polygons import triangulated

COMMENT = re.compile(rb"(?<!\S)#[^\r\n]*")
GOES_ON = re.compile(rb"\\[ \t]*(?:\r\n|\r|\n)")
BESIDE = re.compile(rb"/\S*")  # of a corner: the numbers of its texture coordinate and normal


def read(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3) and triangles (T, 3), which each face becomes. ValueError or ArithmeticError
    when the file is damaged."""
    data = path.read_bytes().removeprefix(BOM_UTF8)
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        raise ValueError("it is text in UTF-16; save it as UTF-8")
    if b"#" in data:
        data = COMMENT.sub(b"", data)
    if b"\\" in data:
        data = GOES_ON.sub(b" ", data)
    points, faces, before = list[bytes](), list[bytes](), list[int]()
    for line in data.replace(b"\t", b" ").splitlines():
        text = line if line[:1] in b"vf" else line.lstrip()
        if text[:2] == b"v ":
            points.append(text)
        elif text[:2] == b"f ":
            faces.append(text)
            before.append(len(points))
    vertices = _vertices(points)
    return vertices, triangulated(vertices, *_faces(faces, np.array(before, np.int64)))


def _vertices(lines: list[bytes]) -> NDArray[np.float64]:
    """The coordinates (V, 3) with which lines begin, behind their word."""
    numbers = [float(word) for line in lines for word in line.split(None, 4)[1:4]]
    if len(numbers) != 3 * len(lines):
        raise ValueError("a vertex has fewer than three coordinates")
    return np.array(numbers).reshape(-1, 3)


def _faces(
    lines: list[bytes], before: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The corners (C,) of faces, one a line, and how many each has (F,); `before` (F,): how many
    vertices stand before each."""
    text = b"\n".join(lines)
    if b"/" in text:
        lines = BESIDE.sub(b"", text).split(b"\n")
    corners, counts = list[int](), list[int]()
    for line in lines:
        words = line.split()
        corners += map(int, words[1:])
        counts.append(len(words) - 1)
    numbers, lengths = np.array(corners, np.int64), np.array(counts, np.int64)
    back = np.flatnonzero(numbers < 0)
    if len(back):
        numbers[back] += np.repeat(before, lengths)[back] + 1
        if (numbers[back] < 1).any():
            raise ValueError("a face counts back beyond the first vertex")
    return numbers - 1, lengths
