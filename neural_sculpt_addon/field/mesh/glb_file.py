# SPDX-License-Identifier: GPL-3.0-or-later
"""GLB files, read by trimesh but for what it makes another shape of: that is refused.

The format is glTF 2.0: a header of JSON tells what the numbers in the rest of the file are.
"""

import io
import json
import struct
from pathlib import Path
from typing import Any

import trimesh

from ...common.errors import SculptError

TRIANGLES = (4, 5)  # modes, in rows and strips; up to 3 they are points and lines
FANS = (6,)


def load(path: Path) -> trimesh.Trimesh:
    """The meshes of a file where its scene puts them. SculptError for what cannot be read."""
    with path.open("rb") as file:
        (size,) = struct.unpack("<12xI4x", file.read(20))  # of the first chunk, which is JSON
        header: dict[str, Any] = json.loads(file.read(size))
    _check(path.name, header, path.stat().st_size)
    if "scenes" in header:
        return trimesh.load_mesh(path, process=False, skip_materials=True)
    text = json.dumps(header | _scene(header)).encode()
    text += b" " * (-len(text) % 4)
    rest = path.read_bytes()[20 + size :]
    first = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
    file = io.BytesIO(first + text + rest)
    return trimesh.load_mesh(file, "glb", process=False, skip_materials=True)


def _scene(header: dict[str, Any]) -> dict[str, Any]:
    """A scene of all nodes that have no parent, or of all meshes where there are no nodes."""
    nodes: list[dict[str, Any]] = header.get("nodes") or [
        {"mesh": i} for i in range(len(header.get("meshes", [])))
    ]
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [i for i in range(len(nodes)) if i not in children]
    return {"nodes": nodes, "scenes": [{"nodes": roots}], "scene": 0}


def _check(name: str, header: dict[str, Any], size: int) -> None:
    """SculptError where trimesh reads numbers of triangles as others: as zeros where they are
    compressed or sparse, and as they are where they are shares of the largest integer.

    ValueError where there are more numbers than bytes."""
    required = header.get("extensionsRequired", [])
    if compression := ", ".join(each for each in required if "compression" in each):
        raise SculptError(
            "{} is compressed ({}), which cannot be read. Export it without compression.",
            name,
            f"{compression:.60}",
        )
    accessors = header.get("accessors", [])
    if any(accessor["count"] > size for accessor in accessors):
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
