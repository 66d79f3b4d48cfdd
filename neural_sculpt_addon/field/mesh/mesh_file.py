# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes as files, read and written by trimesh; OFF files are read by `off_file`.

Files come from outside: when reading fails on a damaged one, a SculptError says so in a sentence.
"""

import io
import json
import re
import struct
from codecs import BOM_UTF8
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...common.whole_file import write_whole
from . import off_file
from .ply_faces import HEADER, triangulated
from .proxy import Proxy
from .refinement.refine import Refined

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".off")
LARGEST_FILE = 2 << 30  # bytes

SINGLE = (b"float", b"float32")  # names that PLY has for it
NOISE = re.compile(rb"^ +|#.*", re.MULTILINE)  # what is no part of a line of an OBJ file
RELATIVE = re.compile(rb"^f .*-", re.MULTILINE)  # a face of an OBJ file that counts back

# What trimesh and the modules here raise on damaged files.
DAMAGE = (
    *(ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, MemoryError),
    *(NameError, RuntimeError, SyntaxError, TypeError, ValueError, struct.error),
)


def read(path: Path) -> tuple[NDArray[np.floating], NDArray[np.int64]]:
    """Vertices (V, 3) and triangles (F, 3) of a mesh file. SculptError when it holds none.

    Vertices are as precise as the file has them: float32 or float64.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise SculptError("{}: meshes are read from {} files.", path.name, ", ".join(SUFFIXES))
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise SculptError("{} is larger than 2 GiB; decimate the mesh first.", path.name)
        header = _header(path)
        if compression := _compression(header):
            raise SculptError(
                "{} is compressed ({}), which cannot be read. Export it without compression.",
                path.name,
                f"{compression:.60}",
            )
        if any(accessor["count"] > size for accessor in header.get("accessors", [])):
            raise ValueError("it has fewer numbers than it says")
        mesh = _load(path)
        vertices = np.asarray(getattr(mesh, "vertices", []), float).reshape(-1, 3)
        vertices = vertices.astype(np.float32 if _is_single(path) else np.float64)
        triangles = np.asarray(getattr(mesh, "faces", []), np.int64).reshape(-1, 3)
    except OSError as error:
        raise SculptError("{} cannot be read: {}.", path, error.strerror or error) from error
    except DAMAGE as error:
        why = f"{error!s:.100}" or type(error).__name__
        raise SculptError("{} is no readable mesh ({}).", path.name, why) from error
    if not len(triangles):
        raise SculptError("{} holds no triangles; choose a mesh with a surface.", path.name)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise SculptError("{} is damaged: a triangle has a corner that is not there.", path.name)
    return vertices, triangles


def _header(path: Path) -> dict[str, Any]:
    """What a .glb file tells of its data; nothing for other files."""
    if path.suffix.lower() != ".glb":
        return {}
    with path.open("rb") as file:
        (size,) = struct.unpack("<12xI4x", file.read(20))  # of the first chunk, which is JSON
        return json.loads(file.read(size))


def _compression(header: dict[str, Any]) -> str:
    """The extension by which the meshes of a .glb file are compressed; empty where they are not.

    trimesh makes them zeros.
    """
    return ", ".join(name for name in header.get("extensionsRequired", []) if "compression" in name)


def _load(path: Path) -> trimesh.Trimesh:
    """What trimesh makes of a file. Of an OBJ file it knows numbers from the start alone and lines
    that begin with their word and a space, of a binary PLY file faces that are alike."""
    if path.suffix.lower() == ".obj":
        data = path.read_bytes().removeprefix(BOM_UTF8).replace(b"\t", b" ")
        data = NOISE.sub(b"", data)
        text = io.BytesIO(_from_start(data) if RELATIVE.search(data) else data)
        return trimesh.load_mesh(text, "obj", process=False, skip_materials=True)
    if path.suffix.lower() == ".off":
        return trimesh.Trimesh(*off_file.read(path), process=False)
    if path.suffix.lower() == ".ply" and (data := triangulated(path)) is not None:
        return trimesh.load_mesh(io.BytesIO(data), "ply", process=False)
    return trimesh.load_mesh(path, process=False, skip_materials=True)


def _from_start(data: bytes) -> bytes:
    """The text of an OBJ file whose faces count from its start: negative numbers count back from
    the last vertex, texture coordinate or normal before the face."""
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    lines = re.sub(rb"\\\r?\n", b" ", data).splitlines()
    for number, line in enumerate(lines):
        word, *corners = line.split() or [b""]
        if word in counts:
            counts[word] += 1
        elif word == b"f":
            corners = [_corner_from_start(corner, counts.values()) for corner in corners]
            lines[number] = b" ".join([word, *corners])
    return b"\n".join(lines)


def _corner_from_start(corner: bytes, counts: Iterable[int]) -> bytes:
    """A corner of a face, as `3/-1/-2`, after so many vertices, texture coordinates and normals.
    ValueError when it counts back beyond the first."""
    numbers = corner.split(b"/")
    for place, (number, count) in enumerate(zip(numbers, counts, strict=False)):
        if number.startswith(b"-"):
            if int(number) + count < 0:
                raise ValueError("a face counts back beyond the first vertex")
            numbers[place] = b"%d" % (int(number) + count + 1)
    return b"/".join(numbers)


def _is_single(path: Path) -> bool:
    """Whether the file's coordinates have single precision; those of text count as double."""
    if path.suffix.lower() == ".stl":
        return True
    if path.suffix.lower() != ".ply":
        return False
    with path.open("rb") as file:
        header = file.read(HEADER).partition(b"end_header")[0]
    words = (line.split() for line in header.splitlines())
    kinds = [line[1] for line in words if line[:1] == [b"property"] and line[2:] == [b"x"]]
    return bool(kinds) and kinds[0] in SINGLE


def write(path: Path, proxy: Proxy | Refined) -> None:
    """Write a proxy, refined or not; the suffix chooses the format.

    SculptError when it cannot be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise SculptError("{}: meshes are written as {} files.", path.name, ", ".join(SUFFIXES))
    mesh = trimesh.Trimesh(
        proxy.vertices, proxy.triangles, vertex_normals=proxy.normals, process=False
    )
    buffer = io.BytesIO()
    mesh.export(buffer, file_type=path.suffix.lower().removeprefix("."))
    write_whole(path, buffer.getvalue())
