# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes as files, read and written by trimesh.

Files come from outside: when trimesh fails on a damaged one, a SculptError says so in a sentence.
"""

import io
import struct
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...common.whole_file import write_whole
from .proxy import Proxy
from .refinement.refine import Refined

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".off")
LARGEST_FILE = 2 << 30  # bytes

SINGLE = (b"float", b"float32")  # names that PLY has for it
HEADER = 1 << 16  # bytes of a PLY file in which its header ends

# What trimesh raises on damaged files.
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
        if path.stat().st_size > LARGEST_FILE:
            raise SculptError("{} is larger than 2 GiB; decimate the mesh first.", path.name)
        mesh = trimesh.load_mesh(path, process=False, skip_materials=True)
        vertices = np.asarray(getattr(mesh, "vertices", []), float).reshape(-1, 3)
        vertices = vertices.astype(np.float32 if _is_single(path) else np.float64)
        triangles = np.asarray(getattr(mesh, "faces", []), np.int64).reshape(-1, 3)
    except OSError as error:
        raise SculptError("{} cannot be read: {}.", path, error.strerror or error) from error
    except DAMAGE as error:
        raise SculptError("{} is no readable mesh ({}).", path.name, f"{error!s:.100}") from error
    if not len(triangles):
        raise SculptError("{} holds no triangles; choose a mesh with a surface.", path.name)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise SculptError("{} is damaged: a triangle has a corner that is not there.", path.name)
    return vertices, triangles


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
