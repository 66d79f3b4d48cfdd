# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY files, binary and text: their vertices, and faces of any number of corners, which may be
unequal, as Blender's own exporter writes them. All else is passed over.

The format is that of Greg Turk, "The PLY polygon file format", 1994: lines of a header, and then
the rows of one element after another; a list in them is its length and so many items. In text each
row is a line.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .polygons import ranges, triangulated

HEADER = 1 << 16  # bytes in which a header ends
ORDERS = {b"binary_little_endian": "<", b"binary_big_endian": ">", b"ascii": "<"}
TYPES = {
    **{b"char": "i1", b"uchar": "u1", b"short": "i2", b"ushort": "u2", b"int": "i4"},
    **{b"uint": "u4", b"float": "f4", b"double": "f8", b"int8": "i1", b"uint8": "u1"},
    **{b"int16": "i2", b"uint16": "u2", b"int32": "i4", b"uint32": "u4"},
    **{b"float32": "f4", b"float64": "f8", b"float16": "f2", b"int64": "i8", b"uint64": "u8"},
}
VERTEX, AXES = b"vertex", (b"x", b"y", b"z")
FACE, CORNERS = b"face", {b"vertex_indices", b"vertex_index"}
STRIPS = b"tristrips"

Polygons = tuple[NDArray[np.int64], NDArray[np.int64]]  # corners (C,), and how many each has (F,)


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
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        """Whether its rows have lists."""
        return any(each.length is not None for each in self.properties)

    def axes(self) -> tuple[list[int], type[np.floating]]:
        """Which properties are coordinates, and how precise these are. ValueError where one of them
        has no place of its own."""
        names = [each.name for each in self.properties]
        if self.has_lists:
            raise ValueError("its vertices have lists")
        places = [names.index(axis) for axis in AXES]
        item = self.properties[places[0]].item
        return places, np.float32 if item.kind == "f" and item.itemsize <= 4 else np.float64


def read(path: Path) -> tuple[NDArray[np.floating], NDArray[np.int64]]:
    """Vertices (V, 3), as precise as the file has them, and triangles (T, 3), which each face
    becomes. ValueError or LookupError when the file is damaged."""
    with path.open("rb") as file:
        header, ends, _ = file.read(HEADER).partition(b"\nend_header")
        if not ends or header[:3] != b"ply":
            raise ValueError("it does not begin as a PLY file")
        kind, elements = _read(header.splitlines())
        data = mmap(file.fileno(), 0, access=ACCESS_READ)
    start = data.find(b"\n", len(header) + 1) + 1
    parts = (
        _of_text(data[start:], elements) if kind == b"ascii" else _of_rows(data, start, elements)
    )
    vertices, (corners, counts) = parts
    return vertices, triangulated(vertices, corners, counts)


def _read(lines: Iterable[bytes]) -> tuple[bytes, list[_Element]]:
    """The format of a header, and its elements."""
    kind, order, elements = b"", "", list[_Element]()
    for line in lines:
        match line.split():
            case [b"format", kind, *_]:
                order = ORDERS[kind]
            case [b"element", name, count]:
                elements.append(_Element(name, int(count)))
                if elements[-1].count < 0:
                    raise ValueError("it has fewer rows than none")
                if name == STRIPS:
                    raise ValueError("it has strips of triangles; export it with faces")
            case [b"property", b"list", length, item, name]:
                types = (np.dtype(order + TYPES[each]) for each in (item, length))
                elements[-1].properties.append(_Property(name, *types))
            case [b"property", item, name]:
                elements[-1].properties.append(_Property(name, np.dtype(order + TYPES[item]), None))
    return kind, elements


def _of_text(data: bytes, elements: list[_Element]) -> tuple[NDArray[np.floating], Polygons]:
    """The vertices (V, 3) and faces of a file of text, whose rows are lines."""
    lines = [line for line in data.splitlines() if line.strip()]
    vertices, corners, counts = np.empty((0, 3)), list[int](), list[int]()
    first = 0
    for element in elements:
        rows = lines[first : first + element.count]
        first += element.count
        if len(rows) < element.count:
            raise ValueError("it has fewer rows than its header says")
        if element.name == VERTEX:
            places, precision = element.axes()
            numbers = [float(words[i]) for words in map(bytes.split, rows) for i in places]
            vertices = np.array(numbers, precision).reshape(-1, 3)
        elif element.name == FACE:
            for row in rows:
                mine = _text_corners(row.split(), element)
                corners += mine
                counts.append(len(mine))
    return vertices, (np.array(corners, np.int64), np.array(counts, np.int64))


def _text_corners(words: list[bytes], faces: _Element) -> list[int]:
    """The corners of a face in a line of words."""
    place = 0
    for each in faces.properties:
        if each.length is None:
            place += 1
            continue
        count = int(words[place])
        if not 0 <= count < len(words) - place:
            raise ValueError("a face has fewer corners than it says")
        if each.name in CORNERS:
            return list(map(int, words[place + 1 : place + 1 + count]))
        place += 1 + count
    return []


def _of_rows(
    data: mmap, place: int, elements: list[_Element]
) -> tuple[NDArray[np.floating], Polygons]:
    """The vertices (V, 3) and faces of a binary file whose rows begin at a place."""
    vertices, none = np.empty((0, 3)), np.empty(0, np.int64)
    faces, wanted = (none, none), {VERTEX, FACE}
    for element in elements:
        if not wanted:
            break
        wanted.discard(element.name)
        if element.has_lists or element.name == FACE:
            polygons, place = _polygons(data, place, element)
            if element.name == VERTEX:
                element.axes()
            if element.name == FACE:
                faces = polygons
            continue
        fields = np.dtype([(str(i), each.item) for i, each in enumerate(element.properties)])
        size = element.count * fields.itemsize
        rows = np.frombuffer(data[place : place + size], fields)
        place += size
        if element.name == VERTEX and element.count:
            places, precision = element.axes()
            axes = [rows[fields.names[each]] for each in places] if fields.names else []
            vertices = np.stack(axes, axis=1).astype(precision)
            if len(vertices) < element.count:
                raise ValueError("it has fewer vertices than its header says")
    return vertices, faces


def _list(data: mmap, place: int, each: _Property) -> tuple[int, int]:
    """Where the items of a list begin that is at a place of the file, and how many they are."""
    assert each.length is not None
    first = place + each.length.itemsize
    (count,) = np.frombuffer(data[place:first], each.length).tolist() or [-1]
    if count < 0 or first + count * each.item.itemsize > len(data):
        raise ValueError("a face goes beyond the end of the file")
    return first, int(count)


def _polygons(data: mmap, place: int, faces: _Element) -> tuple[Polygons, int]:
    """The corners of all rows of an element, which begin at a place of the file, and where they
    end. A second for a million rows that are not alike."""
    alike = _of_rows_alike(data, place, faces)
    if alike is not None:
        return alike
    if faces.count > len(data):
        raise ValueError("it has fewer faces than its header says")
    starts, counts, kind = list[int](), list[int](), np.dtype("i4")
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
    lengths, size = np.array(counts, np.int64), kind.itemsize
    taken = ranges(np.array(starts, np.int64), size * lengths)
    return (np.frombuffer(data, np.uint8)[taken].view(kind).astype(np.int64), lengths), place


def _of_rows_alike(data: mmap, start: int, faces: _Element) -> tuple[Polygons, int] | None:
    """The same where the lists of all rows have the lengths of those of the first one; None where
    they have not."""
    none = np.empty(0, np.int64)
    if not faces.count:
        return (none, none), start
    if not faces.has_lists:
        raise ValueError("its faces have no corners")
    place, lengths, corners, kind = start, list[slice](), slice(0), np.dtype("i4")
    for each in faces.properties:
        if each.length is None:
            place += each.item.itemsize
            continue
        first, count = _list(data, place, each)
        lengths.append(slice(place - start, first - start))
        place = first + count * each.item.itemsize
        if each.name in CORNERS:
            corners, kind = slice(first - start, place - start), each.item
    row = place - start
    if start + faces.count * row > len(data):
        return None
    rows = np.frombuffer(data, np.uint8, faces.count * row, start).reshape(faces.count, row)
    if not all((rows[:, each] == rows[:1, each]).all() for each in lengths):
        return None
    numbers = np.ascontiguousarray(rows[:, corners]).view(kind)
    counts = np.full(faces.count, numbers.shape[1])
    return (numbers.astype(np.int64).ravel(), counts), start + faces.count * row
