# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes as files, written by trimesh, which reads GLB files; others have readers here.

Files come from outside: when reading fails on a damaged one, a SculptError says so in a sentence.
"""

import io
import struct
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...common.whole_file import write_whole
from . import glb_file, obj_file, off_file, ply_file, stl_file
from .proxy import Proxy
from .refinement.refine import Refined

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".off")
READERS = {
    **{".glb": glb_file.read, ".obj": obj_file.read, ".off": off_file.read},
    **{".ply": ply_file.read, ".stl": stl_file.read},
}
LARGEST_FILE = 2 << 30  # bytes


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
        vertices, triangles = READERS[path.suffix.lower()](path)
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
