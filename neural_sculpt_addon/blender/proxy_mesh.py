# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy: triangles of the field's surface written into a Blender mesh, in model space."""

import zlib

import bpy
import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from ..stroke.errors import SculptError

CUSTOM_NORMALS = bpy.app.version >= (4, 5, 0)
"""Earlier Blenders ignore the attribute; their own smooth normals serve."""

FILLED = "neural_sculpt_filled"
"""Custom property of a proxy's mesh: the fingerprint of the vertices that it was filled with."""


def why_locked(ob: Object) -> str:
    """Why the object's mesh cannot be replaced now, as a sentence; empty when it can."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    if ob.library or mesh.library or ob.override_library:
        return f"{ob.name} is linked from another file. Make it local to sculpt it."
    if mesh.is_editmode:
        return f"{ob.name} is in Edit Mode. Leave Edit Mode to sculpt the field."
    if mesh.shape_keys:
        return f"{ob.name} has shape keys, which a new proxy would break. Remove them to sculpt."
    if in_dyntopo(ob):
        return (
            f"Dyntopo owns the mesh of {ob.name} while it is on. Turn it off to sculpt the field."
        )
    return ""


def refuse_locked(ob: Object) -> None:
    """SculptError when the object's mesh cannot be replaced now."""
    if reason := why_locked(ob):
        raise SculptError(reason)


def in_dyntopo(ob: Object) -> bool:
    """Whether Sculpt Mode works on a mesh of its own and will write it over the object's."""
    return ob.mode == "SCULPT" and ob.use_dynamic_topology_sculpting


def fill(
    mesh: Mesh,
    vertices: NDArray[np.float32],
    normals: NDArray[np.float32],
    triangles: NDArray[np.int32],
    edges: NDArray[np.int32],
    corner_edges: NDArray[np.int32],
    smooth: bool = True,
) -> None:
    """Replace the mesh's geometry; materials stay. The mesh must not be locked.

    vertices, normals: (V, 3); normals are unit and point outward
    triangles:         (F, 3), counter-clockwise seen from outside
    edges:             (E, 2), each once
    corner_edges:      (F, 3), of each corner the edge to the next
    smooth:            whether it is shaded by the normals; otherwise triangles are flat

    With 100,000 triangles this takes some 4 ms; that Blender need not find the edges itself saves
    9 ms.
    """
    mesh.clear_geometry()
    mesh.vertices.add(len(vertices))
    mesh.edges.add(len(edges))
    mesh.loops.add(triangles.size)
    mesh.polygons.add(len(triangles))
    _write(mesh, "position", "vector", vertices)
    _write(mesh, ".edge_verts", "value", edges)
    _write(mesh, ".corner_vert", "value", triangles)
    _write(mesh, ".corner_edge", "value", corner_edges)
    starts = np.arange(0, triangles.size, 3, np.int32)
    # Blender takes these one at a time, which of a view of the numbers it does twice as fast
    mesh.polygons.foreach_set("loop_start", starts.data)
    if not smooth:
        flat = mesh.attributes.new("sharp_face", "BOOLEAN", "FACE")
        flat.data.foreach_set("value", np.ones(len(triangles), bool))  # pyright: ignore
    elif CUSTOM_NORMALS:
        mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        _write(mesh, "custom_normal", "vector", normals)
    mesh[FILLED] = f"{fingerprint(vertices):08x}"
    mesh.update()


def positions(ob: Object) -> NDArray[np.float32]:
    """The vertices (V, 3) of the object's mesh, in model space."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", flat)  # pyright: ignore
    return flat.reshape(-1, 3)


def fingerprint(vertices: NDArray[np.float32]) -> int:
    """A number that tells vertices (V, 3) from others."""
    return zlib.crc32(np.ascontiguousarray(vertices, np.float32).data)


def read(mesh: Mesh) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (F, 3) of any mesh, in its own coordinates."""
    mesh.calc_loop_triangles()
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.vertices.foreach_get("co", vertices)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    return vertices.reshape(-1, 3), triangles.reshape(-1, 3)


def _write(mesh: Mesh, attribute: str, member: str, values: NDArray[np.generic]) -> None:
    """Only flat contiguous float32 and int32 arrays are copied as blocks, 50 times faster."""
    dtype = np.float32 if member == "vector" else np.int32
    flat = np.ascontiguousarray(values, dtype).ravel()
    mesh.attributes[attribute].data.foreach_set(member, flat)  # pyright: ignore
