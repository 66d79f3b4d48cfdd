# SPDX-License-Identifier: GPL-3.0-or-later
"""GLB files: trimesh reads their meshes, which are put here where the nodes of their scene are.
What trimesh makes another shape of is refused.

The format is glTF 2.0: a header of JSON tells what the numbers in the rest of the file are.
"""

import io
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...common.errors import SculptError

TRIANGLES = (4, 5)  # modes, in rows and strips; up to 3 they are points and lines
FANS = (6,)
OF_LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")
QUANTIZED = "KHR_mesh_quantization"
NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
OVERLAP = 16  # numbers for each byte of a file, at most: meshes may share them
MOST_CORNERS = 1 << 26  # vertices and corners of triangles, with all copies of meshes

Header = dict[str, Any]


def read(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3) and triangles (T, 3) of a file's scene, or, without one, of all its nodes or
    meshes. SculptError for what cannot be read; LookupError, TypeError or ValueError when it is
    damaged."""
    data = path.read_bytes()
    (size,) = struct.unpack("<12xI4x", data[:20])  # of the first chunk, which is JSON
    header: Header = json.loads(data[20 : 20 + size])
    _check(path.name, header, len(data))
    nodes = [{"mesh": mesh, "matrix": place.T.ravel().tolist()} for mesh, place in _placed(header)]
    _check_copies(path.name, header, nodes)
    header |= {"nodes": nodes, "scenes": [{"nodes": list(range(len(nodes)))}], "scene": 0}
    chunk = json.dumps(header).encode()
    chunk += b" " * (-len(chunk) % 4)
    rest = data[20 + size :]
    first = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(chunk) + len(rest), len(chunk), b"JSON")
    file = io.BytesIO(first + chunk + rest)
    mesh = trimesh.load_mesh(file, "glb", process=False, skip_materials=True)
    vertices = np.asarray(getattr(mesh, "vertices", []), float).reshape(-1, 3)
    return vertices, np.asarray(getattr(mesh, "faces", []), np.int64).reshape(-1, 3)


def _placed(header: Header) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Each node's mesh, and the matrix (4, 4) that puts it into the scene. The format has a mesh
    with a skin follow its joints, not its node: at rest it stays where its own coordinates are."""
    nodes: list[Header] = header.get("nodes") or [
        {"mesh": i} for i in range(len(header.get("meshes", [])))
    ]
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [i for i in range(len(nodes)) if i not in children]
    if scenes := header.get("scenes"):
        roots = scenes[header.get("scene", 0)].get("nodes", [])
    seen = set[int]()
    waiting = [(root, np.eye(4)) for root in reversed(roots)]
    while waiting:
        number, around = waiting.pop()
        if number in seen:
            raise ValueError("a node has two parents")
        seen.add(number)
        place = around @ _matrix(nodes[number])
        if "mesh" in nodes[number]:
            yield nodes[number]["mesh"], np.eye(4) if "skin" in nodes[number] else place
        waiting += [(child, place) for child in reversed(nodes[number].get("children", []))]


def _matrix(node: Header) -> NDArray[np.float64]:
    """The matrix (4, 4) of a node in its parent."""
    if "matrix" in node:
        return np.reshape(np.array(node["matrix"], float), (4, 4)).T
    matrix = np.eye(4)
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    matrix[:3, :3] = trimesh.transformations.quaternion_matrix([w, x, y, z])[:3, :3]
    matrix[:3, :3] *= np.array(node.get("scale", (1.0, 1.0, 1.0)), float)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _check(name: str, header: Header, size: int) -> None:
    """SculptError where trimesh reads numbers of triangles as others: as zeros where they are
    compressed, sparse or not there, and as they are where they are shares of the largest integer.

    ValueError where there are more numbers than bytes."""
    required = header.get("extensionsRequired", [])
    odd = [each for each in required if not each.startswith(OF_LOOKS) and each != QUANTIZED]
    if odd:
        raise SculptError(
            "{} needs what cannot be read here ({}). Export it without, and without compression.",
            name,
            f"{', '.join(odd):.60}",
        )
    if any(
        not buffer.get("uri", "data:").startswith("data:") for buffer in header.get("buffers", [])
    ):
        raise ValueError("its numbers are in another file; export it as one")
    accessors: list[Header] = header.get("accessors", [])
    counts = [accessor["count"] * NUMBERS[accessor["type"]] for accessor in accessors]
    if min(counts, default=0) < 0 or sum(counts) > OVERLAP * size:
        raise ValueError("it has fewer numbers than it says")
    for part in (part for mesh in header.get("meshes", []) for part in mesh["primitives"]):
        mode = part.get("mode", TRIANGLES[0])
        if mode in FANS:
            raise SculptError(
                "{} holds fans of triangles, which cannot be read. Export it with triangles.", name
            )
        if mode not in TRIANGLES:
            continue
        positions = accessors[part["attributes"]["POSITION"]]
        if positions.get("normalized"):
            raise SculptError(
                "{} has quantized coordinates, which cannot be read. Export it without them.",
                name,
            )
        indices = accessors[part["indices"]] if "indices" in part else {}
        if "sparse" in positions or "sparse" in indices:
            raise SculptError(
                "{} has sparse coordinates, which cannot be read. Export it without them.", name
            )
        if "bufferView" not in positions or (indices and "bufferView" not in indices):
            raise ValueError("the coordinates of a mesh are not there")


def _check_copies(name: str, header: Header, nodes: list[Header]) -> None:
    """SculptError when the meshes of all nodes together are too large."""
    meshes, accessors = header.get("meshes", []), header.get("accessors", [])
    corners = 0
    for node in nodes:
        for part in meshes[node["mesh"]]["primitives"]:
            corners += accessors[part["attributes"]["POSITION"]]["count"]
            corners += accessors[part["indices"]]["count"] if "indices" in part else 0
        if corners > MOST_CORNERS:
            raise SculptError(
                "{} has copies of meshes with more than {} triangles in all; decimate them first.",
                name,
                f"{MOST_CORNERS // 3:,}",
            )
