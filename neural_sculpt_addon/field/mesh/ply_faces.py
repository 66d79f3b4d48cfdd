# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of binary PLY files that have unequal numbers of corners, as Blender's own exporter writes
them: trimesh reads such files where all faces are alike.

The format is that of Greg Turk, "The PLY polygon file format", 1994: lines of a header, and then
the rows of one element after another; a list in them is its length and so many items.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import takewhile
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .polygons import fans

HEADER = 1 << 16  # bytes in which a header ends
ORDERS = {b"binary_little_endian": "<", b"binary_big_endian": ">"}
TYPES = {
    **{b"char": "i1", b"uchar": "u1", b"short": "i2", b"ushort": "u2", b"int": "i4"},
    **{b"uint": "u4", b"float": "f4", b"double": "f8", b"int8": "i1", b"uint8": "u1"},
    **{b"int16": "i2", b"uint16": "u2", b"int32": "i4", b"uint32": "u4"},
    **{b"float32": "f4", b"float64": "f8", b"float16": "f2", b"int64": "i8", b"uint64": "u8"},
}
FACE, CORNERS = b"face", {b"vertex_indices", b"vertex_index"}


class _Property(NamedTuple):
    """A number in each row of an element, or a list of them, whose length has a type of its own."""

    name: bytes
    item: np.dtype
    length: np.dtype | None


@dataclass
class _Element:
    """An element as the lines of a header tell it: so many rows with these properties."""

    name: bytes
    count: int
    lines: list[bytes]
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        """Whether its rows have lists."""
        return any(each.length is not None for each in self.properties)

    @property
    def size(self) -> int:
        """Bytes of all rows, which have no lists."""
        return self.count * sum(each.item.itemsize for each in self.properties)


def triangulated(path: Path) -> bytes | None:
    """The same file with triangles alone, a fan of them for each face; None where all faces are
    alike, and for what this cannot tell: text, other elements with lists before the faces.
    ValueError or LookupError when the file is damaged."""
    with path.open("rb") as file:
        header, ends, _ = file.read(HEADER).partition(b"end_header")
        kind, elements = _read(header.splitlines())
        faces = next((element for element in elements if element.name == FACE), None)
        if not ends or kind not in ORDERS or faces is None:
            return None
        data = mmap(file.fileno(), 0, access=ACCESS_READ)
    start = data.find(b"\n", len(header)) + 1
    before = list(takewhile(lambda element: element is not faces, elements))
    if any(element.has_lists for element in before):
        return None
    place = start + sum(element.size for element in before)
    if _are_alike(data, place, faces):
        return None
    starts, counts, item = _corners(data, place, faces)
    triangles = _triangles(data, starts, counts, item)
    rows = np.empty(len(triangles), [("count", "u1"), ("corners", ORDERS[kind] + "i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    lines = [b"ply", b"format " + kind + b" 1.0", *(x for each in before for x in each.lines)]
    lines += [b"element face %d" % len(rows), b"property list uchar int vertex_indices"]
    return b"\n".join([*lines, b"end_header", b""]) + data[start:place] + rows.tobytes()


def _read(lines: Iterable[bytes]) -> tuple[bytes, list[_Element]]:
    """The format of a header, and its elements, unless it is one of text."""
    kind, order, elements = b"", "", list[_Element]()
    for line in lines:
        match line.split():
            case [b"format", kind, *_] if kind in ORDERS:
                order = ORDERS[kind]
            case [b"format", *_]:
                break
            case [b"element", name, count]:
                elements.append(_Element(name, int(count), [line]))
            case [b"property", b"list", length, item, name]:
                types = (np.dtype(order + TYPES[each]) for each in (item, length))
                elements[-1].properties.append(_Property(name, *types))
            case [b"property", item, name]:
                elements[-1].properties.append(_Property(name, np.dtype(order + TYPES[item]), None))
                elements[-1].lines.append(line)
    return kind, elements


def _list(data: mmap, place: int, each: _Property) -> tuple[int, int]:
    """Where the items of a list begin that is at a place of the file, and how many they are."""
    assert each.length is not None
    first = place + each.length.itemsize
    (count,) = np.frombuffer(data[place:first], each.length).tolist() or [-1]
    if count < 0 or first + count * each.item.itemsize > len(data):
        raise ValueError("a face goes beyond the end of the file")
    return first, int(count)


def _are_alike(data: mmap, place: int, faces: _Element) -> bool:
    """Whether the lists of all faces have the lengths of those of the first one."""
    if faces.count <= 0:
        return True
    start, lengths = place, list[slice]()
    for each in faces.properties:
        if each.length is None:
            place += each.item.itemsize
            continue
        first, count = _list(data, place, each)
        lengths.append(slice(place - start, first - start))
        place = first + count * each.item.itemsize
    row = place - start
    if start + faces.count * row > len(data):
        return False
    rows = np.frombuffer(data, np.uint8, faces.count * row, start).reshape(faces.count, row)
    return all((rows[:, each] == rows[:1, each]).all() for each in lengths)


def _corners(
    data: mmap, place: int, faces: _Element
) -> tuple[NDArray[np.int64], NDArray[np.int64], np.dtype]:
    """Where in the file the corners of each face begin (F,), how many these are (F,), and the type
    of their numbers. A second for a million faces."""
    if faces.count > len(data):
        raise ValueError("it has fewer faces than its header says")
    starts, counts, kind = [], [], np.dtype("i4")
    for _ in range(faces.count):
        for each in faces.properties:
            if each.length is None:
                place += each.item.itemsize
                continue
            first, count = _list(data, place, each)
            place = first + count * each.item.itemsize
            if each.name in CORNERS:
                starts.append(first)
                counts.append(count)
                kind = each.item
    return np.array(starts, np.int64), np.array(counts, np.int64), kind


def _triangles(
    data: mmap, starts: NDArray[np.int64], counts: NDArray[np.int64], item: np.dtype
) -> NDArray[np.int64]:
    """The triangles (T, 3) of faces whose corners begin at `starts` (F,) of the file, `counts` (F,)
    of them."""
    first, every = fans(starts, counts, item.itemsize), np.frombuffer(data, np.uint8)
    taken = np.stack([every[first + byte] for byte in range(item.itemsize)], axis=-1)
    return taken.view(item)[..., 0].astype(np.int64)
