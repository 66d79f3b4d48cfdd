# SPDX-License-Identifier: GPL-3.0-or-later
"""OFF files of text: faces of any number of corners, normals and colors, which are passed over.

The format is that of Geomview: a word, which may be left out, and the numbers of vertices and
faces; then a line for each vertex, which begins with its coordinates, and one for each face, which
begins with the number of its corners and these. What follows a # is a comment.
"""

import re
from codecs import BOM_UTF8
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .polygons import triangulated

KIND = re.compile(rb"\A\s*((ST|C|N)*OFF|off)")  # texture coordinates, colors, normals of vertices


def read(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3) and triangles (T, 3), which each face becomes. ValueError or ArithmeticError
    when the file is damaged."""
    text = re.sub(rb"#.*", b"", path.read_bytes().removeprefix(BOM_UTF8))
    lines = [line for line in KIND.sub(b"", text).splitlines() if line.strip()]
    words = lines.pop(0).split() if lines else []
    if len(words) < 2 or not (words[0].isdigit() and words[1].isdigit()):
        raise ValueError("it does not begin as an OFF file of text")
    vertex_count, face_count = int(words[0]), int(words[1])
    if vertex_count + face_count > len(lines):
        raise ValueError("it has fewer vertices and faces than it says")
    faces = lines[vertex_count : vertex_count + face_count]
    vertices = _vertices(lines[:vertex_count])
    return vertices, triangulated(vertices, *_faces(faces))


def _vertices(lines: list[bytes]) -> NDArray[np.float64]:
    """The coordinates (V, 3) with which lines begin."""
    numbers = [float(word) for line in lines for word in line.split()[:3]]
    if len(numbers) != 3 * len(lines):
        raise ValueError("a vertex has fewer than three coordinates")
    return np.array(numbers).reshape(-1, 3)


def _faces(lines: list[bytes]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The corners (C,) of faces, one a line, and how many each has (F,)."""
    corners, counts = list[int](), list[int]()
    for line in lines:
        words = line.split()
        count = int(words[0])
        if not 0 <= count < len(words):
            raise ValueError("a face has fewer corners than it says")
        corners += map(int, words[1 : 1 + count])
        counts.append(count)
    return np.array(corners, np.int64), np.array(counts, np.int64)
