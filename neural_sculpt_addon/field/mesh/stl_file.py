# SPDX-License-Identifier: GPL-3.0-or-later
"""STL files, of bytes and of text, of one solid or several.

A file of bytes has 80 of anything, the number of its triangles, and 50 for each of these. One of
text has words: after `solid` and a name follow `facet normal`, three times `vertex` with its
coordinates, `endfacet`, and at the end `endsolid`.
"""

import re
from codecs import BOM_UTF8
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

START = np.dtype([("any", "V80"), ("count", "<u4")])
ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])
NAME = re.compile(rb"^[ \t]*(?:end)?solid\b.*?(?=\bfacet\s+normal\b|$)", re.I | re.M)
CORNER = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.I)
WORD = re.compile(rb"\b(?:facet|vertex|endfacet)\b", re.I)
FACET = b"fvvve"  # the first letters of its words


def read(path: Path) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Vertices (V, 3), three of its own for each of the triangles (T, 3). ValueError when the file
    is damaged."""
    data = path.read_bytes()
    start = data[: START.itemsize].ljust(START.itemsize, b"\0")
    count = int(np.frombuffer(start, START)["count"][0])
    is_text = data.removeprefix(BOM_UTF8).lstrip()[:5].lower() == b"solid"
    is_whole = START.itemsize + count * ROW.itemsize == len(data)
    if is_text and not is_whole and b"\0" not in start:
        vertices = _of_text(data.replace(b"\r\n", b"\n").replace(b"\r", b"\n"))
    else:
        vertices = _of_rows(data, count)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _of_rows(data: bytes, count: int) -> NDArray[np.float32]:
    """The corners (V, 3) of so many triangles of a file of bytes."""
    beyond = len(data) - START.itemsize - count * ROW.itemsize
    if beyond < 0:
        raise ValueError("it has fewer triangles than it says")
    if beyond >= ROW.itemsize:
        raise ValueError("it has more triangles than it says")
    return np.frombuffer(data, ROW, count, START.itemsize)["corners"].reshape(-1, 3)


def _of_text(text: bytes) -> NDArray[np.float32]:
    """The corners (V, 3) of a file of text, whose lines end in a line feed."""
    lower = text.lower()
    end = lower.rfind(b"endsolid")
    if end < lower.rfind(b"endfacet") or text[end:].partition(b"\n")[2].strip():
        raise ValueError("it ends before its last solid does")
    text = NAME.sub(b"", text)
    words = b"".join(word[:1] for word in WORD.findall(text)).lower()
    if words != FACET * (len(words) // len(FACET)):
        raise ValueError("one of its facets is no triangle")
    corners = CORNER.findall(text)
    if FACET.count(b"v") * (len(words) // len(FACET)) != len(corners):
        raise ValueError("a vertex has fewer than three coordinates")
    numbers = [float(word) for corner in corners for word in corner]
    return np.array(numbers, np.float32).reshape(-1, 3)
