# SPDX-License-Identifier: GPL-3.0-or-later
"""STL files, binary and text, of one solid or several.

A binary file has a header of 80 bytes, the number of its triangles, and 50 bytes for each of them.
A text file has for each solid the line `solid` with a name, its facets and the line `endsolid`; a
facet has the word `facet` with a normal, three times `vertex` with coordinates, and `endfacet`.
"""

import re
import warnings
from codecs import BOM_UTF8
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

START = np.dtype([("any", "V80"), ("count", "<u4")])
ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])
NAME = re.compile(rb"^[ \t]*(?:end)?solid\b.*?(?=\bfacet\s+normal\b|$)", re.M)
WORDS = (b"endfacet", b"facet", b"normal", b"outer", b"endloop", b"loop", b"vertex")
NUMBERS = (4, 3)  # of a facet: its normal and three corners


def read(path: Path) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Vertices (V, 3), three of its own for each of the triangles (T, 3). ValueError when the file
    is damaged."""
    data = path.read_bytes().removeprefix(BOM_UTF8)
    start = data[: START.itemsize].ljust(START.itemsize, b"\0")
    count = int(np.frombuffer(start, START)["count"][0])
    is_text = data[: START.itemsize].lstrip()[:5].lower() == b"solid"
    is_whole = START.itemsize + count * ROW.itemsize == len(data)
    if is_text and not is_whole and b"\0" not in data[: START.itemsize]:
        vertices = _of_text(data.lower().replace(b"\r", b"\n"))
    else:
        vertices = _of_rows(data, count)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _of_rows(data: bytes, count: int) -> NDArray[np.float32]:
    """The corners (V, 3) of the triangles of a binary file that says it has `count` of them."""
    beyond = len(data) - START.itemsize - count * ROW.itemsize
    if beyond < 0:
        raise ValueError("it has fewer triangles than it says")
    if beyond >= ROW.itemsize:
        raise ValueError("it has more triangles than it says")
    return np.frombuffer(data, ROW, count, START.itemsize)["corners"].reshape(-1, 3)


def _of_text(text: bytes) -> NDArray[np.float32]:
    """The corners (V, 3) of a text file in lower case, whose lines end in a line feed."""
    end = text.rfind(b"endsolid")
    if end < text.rfind(b"endfacet") or text[end:].strip(b"\n").count(b"\n"):
        raise ValueError("it ends before its last solid does")
    text = NAME.sub(b"", text[: max(end, 0)])
    facets, *others = (text.count(word) for word in (b"endfacet", b"facet", b"vertex"))
    if others != [2 * facets, 3 * facets]:
        raise ValueError("one of its facets is no triangle")
    if not facets:
        return np.empty((0, 3), np.float32)
    for word in WORDS:
        text = text.replace(word, b"")
    with warnings.catch_warnings():  # of a word that is no number
        warnings.simplefilter("ignore", DeprecationWarning)
        numbers = np.fromstring(text, np.float32, sep=" ")
    if len(numbers) != facets * np.prod(NUMBERS):
        raise ValueError("one of its facets has words that are no numbers, or too few of them")
    return numbers.reshape(-1, *NUMBERS)[:, 1:].reshape(-1, 3)
