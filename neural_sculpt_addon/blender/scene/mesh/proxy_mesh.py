# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy as a Blender mesh: it is filled with the triangles that show the field, moved and read.

Model space, which is the local space of the object.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from bpy.types import Mesh, MultiresModifier, Object
from numpy.typing import NDArray

from ....common.errors import SculptError
from ....common.text import Text
from . import brush_attributes
from .attributes import Attributes

CUSTOM_NORMALS = bpy.app.version >= (4, 5, 0)
"""Whether Blender shows normals that are kept as an attribute. Earlier versions ignore it and show
smooth normals of their own."""

FILLED = "neural_sculpt_filled"
"""Custom property of a proxy's mesh: the fingerprint of the vertices that it was filled with."""

STRETCHED = "neural_sculpt_stretched"
"""Custom property of a proxy's mesh whose triangles do not show the field well any more."""


OF_OTHER_STEPS = {"TEXTURE_PAINT", "PARTICLE_EDIT"}
"""Modes of an object, beside Edit Mode, whose undo steps do not hold its mesh."""


def why_locked(ob: Object) -> str:
    """The reason why the object's mesh cannot be replaced now, as a sentence; empty when it can
    be."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    if ob.library or mesh.library or ob.override_library:
        return Text("{} is linked from another file. Make it local to sculpt it.", ob.name)
    if mesh.shape_keys:
        return Text(
            "{} has shape keys, which a new proxy would break. Remove them to sculpt.", ob.name
        )
    if has_multires(ob):
        return Text(
            "{} has a Multires modifier, whose sculpting a new proxy would lose. Apply or remove it"
            " to sculpt the field.",
            ob.name,
        )
    return _why_mode_locks(ob, mesh)


def _why_mode_locks(ob: Object, mesh: Mesh) -> str:
    """The reason that lies in the object's mode, as of `why_locked`."""
    if mesh.is_editmode:
        return Text("{} is in Edit Mode. Leave Edit Mode to sculpt the field.", ob.name)
    if ob.mode in OF_OTHER_STEPS:
        return Text(
            "{} is in a mode in which undo knows nothing of strokes. Leave it for Object Mode to"
            " sculpt the field.",
            ob.name,
        )
    if in_dyntopo(ob):
        return Text(
            "Dyntopo owns the mesh of {} while it is on. Turn it off to sculpt the field.", ob.name
        )
    return ""


def refuse_locked(ob: Object) -> None:
    """SculptError when the object's mesh cannot be replaced now."""
    if reason := why_locked(ob):
        raise SculptError(reason)


def has_multires(ob: Object) -> bool:
    """Whether a Multires modifier has levels, which Sculpt Mode sculpts in place of the mesh."""
    return any(isinstance(each, MultiresModifier) and each.total_levels for each in ob.modifiers)


def in_dyntopo(ob: Object) -> bool:
    """Whether Sculpt Mode works on a mesh of its own and will write it over the object's."""
    return ob.mode == "SCULPT" and ob.use_dynamic_topology_sculpting


@dataclass(frozen=True)
class Geometry:
    """Arrays to fill a mesh with, flat and of the types that Blender copies as blocks.

    normals:    of a mesh that is shaded smooth, else None
    flat:       whether each face is shaded flat; None where all are smooth
    filled:     the fingerprint of the vertices, see FILLED
    painted:    the values of `brush_attributes` by their names
    attributes: all others of the object's mesh, which `attributes.write` writes
    """

    vertices: NDArray[np.float32]  # (3 V,)
    normals: NDArray[np.float32] | None  # (3 V,)
    edges: NDArray[np.int32]  # (2 E,)
    corners: NDArray[np.int32]  # (3 F,)
    corner_edges: NDArray[np.int32]  # (3 F,)
    starts: NDArray[np.int32]  # (F,)
    flat: NDArray[np.bool_] | None  # (F,)
    filled: str
    painted: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    attributes: Attributes | None = None


def geometry(
    vertices: NDArray[np.float32],
    normals: NDArray[np.float32],
    triangles: NDArray[np.int32],
    edges: NDArray[np.int32],
    corner_edges: NDArray[np.int32],
    smooth: bool = True,
) -> Geometry:
    """Arrays to fill a mesh with. Made ahead of a change, for this is what can run out of memory.

    vertices, normals: (V, 3); normals are unit and point outward
    triangles:         (F, 3), counter-clockwise seen from outside
    edges:             (E, 2), each once
    corner_edges:      (F, 3), of each corner the edge to the next
    smooth:            whether it is shaded by the normals; otherwise triangles are flat
    """
    return Geometry(
        _flat(vertices, np.float32),
        _flat(normals, np.float32) if smooth and CUSTOM_NORMALS else None,
        _flat(edges, np.int32),
        _flat(triangles, np.int32),
        _flat(corner_edges, np.int32),
        np.arange(0, triangles.size, 3, np.int32),
        None if smooth else np.ones(len(triangles), bool),
        fill_mark(vertices),
    )


def fill(mesh: Mesh, new: Geometry) -> None:
    """Replace the mesh's geometry; materials stay. The mesh must not be locked.

    With 100,000 triangles this takes some 4 ms. Without the edges Blender would find them itself,
    in 9 ms more.
    """
    resize(mesh, new)
    shape(mesh, new)
    shade(mesh, new)
    mesh.update()


def resize(mesh: Mesh, new: Geometry) -> None:
    """Make room for new triangles, which `shape` must follow. Nothing is left of the old ones, nor
    of what hangs on them."""
    mesh.clear_geometry()
    mesh.vertices.add(len(new.vertices) // 3)
    mesh.edges.add(len(new.edges) // 2)
    mesh.loops.add(len(new.corners))
    mesh.polygons.add(len(new.starts))


def shape(mesh: Mesh, new: Geometry) -> None:
    """Write new triangles, for which there is room, up to `Mesh.update`."""
    _write(mesh, "position", "vector", new.vertices)
    _write(mesh, ".edge_verts", "value", new.edges)
    _write(mesh, ".corner_vert", "value", new.corners)
    _write(mesh, ".corner_edge", "value", new.corner_edges)
    # Blender copies these one by one, and from a memoryview twice as fast as from an array
    mesh.polygons.foreach_set("loop_start", new.starts.data)


def shade(mesh: Mesh, new: Geometry) -> None:
    """Give new triangles their normals and what brushes painted, and mark them as the field's."""
    if new.flat is not None:
        mesh.attributes.new("sharp_face", "BOOLEAN", "FACE")
        _write(mesh, "sharp_face", "value", new.flat)
    if new.normals is not None:
        mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        _write(mesh, "custom_normal", "vector", new.normals)
    brush_attributes.write(mesh, new.painted)
    mesh[FILLED] = new.filled
    if STRETCHED in mesh:
        del mesh[STRETCHED]


def move(
    mesh: Mesh,
    vertices: NDArray[np.float32],
    some: NDArray[np.intp],
    normals: NDArray[np.float32],
) -> None:
    """Give a proxy other vertices (V, 3), and `some` (P,) of them other normals (P, 3); it keeps
    its triangles, and all that hangs on them. Below 1 ms.

    `Mesh.update` is not called, so Blender draws the mesh as it was. That makes the next undo step
    30 ms faster, for Blender does not sort the vertices into the tree of its brushes again.
    """
    put(mesh, vertices)
    if (every := normals_of(mesh)) is not None:
        every[some] = normals
        put_normals(mesh, every)
    mesh[FILLED] = fill_mark(vertices)


def put(mesh: Mesh, vertices: NDArray[np.float32]) -> None:
    """Put the vertices (V, 3) of a mesh where they are to be, model space."""
    _write(mesh, "position", "vector", np.ascontiguousarray(vertices).ravel())


def put_normals(mesh: Mesh, normals: NDArray[np.float32]) -> None:
    """Replace the normals (V, 3) of a mesh that has its own, see `normals_of`."""
    _write(mesh, "custom_normal", "vector", normals.ravel())


def normals_of(mesh: Mesh) -> NDArray[np.float32] | None:
    """The custom normals (V, 3) of a mesh, None where it has none and is shaded by its shape."""
    if "custom_normal" not in mesh.attributes:
        return None
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["custom_normal"].data.foreach_get("vector", flat)  # pyright: ignore[reportAttributeAccessIssue]
    return flat.reshape(-1, 3)


def mesh_of(ob: Object) -> Mesh:
    """The mesh of a field."""
    assert isinstance(ob.data, Mesh)
    return ob.data


def corners_of(mesh: Mesh) -> NDArray[np.int32]:
    """The triangles (F, 3) of a mesh that has no other faces."""
    flat = np.empty(len(mesh.loops), np.int32)
    mesh.attributes[".corner_vert"].data.foreach_get("value", flat)  # pyright: ignore[reportAttributeAccessIssue]
    return flat.reshape(-1, 3)


def positions(ob: Object) -> NDArray[np.float32]:
    """The vertices (V, 3) of the object's mesh, in model space."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", flat)  # pyright: ignore[reportAttributeAccessIssue]
    return flat.reshape(-1, 3)


def fill_mark(vertices: NDArray[np.float32]) -> str:
    """FILLED of a mesh that has these vertices (V, 3) from the field."""
    return f"{fingerprint(vertices):08x}"


def fingerprint(vertices: NDArray[np.float32]) -> int:
    """CRC-32 of vertices (V, 3): tells whether they are others."""
    return zlib.crc32(np.ascontiguousarray(vertices, np.float32).data)


def read(mesh: Mesh) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (F, 3) of any mesh, in its own coordinates."""
    mesh.calc_loop_triangles()
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.vertices.foreach_get("co", vertices)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    return vertices.reshape(-1, 3), triangles.reshape(-1, 3)


def _flat(values: NDArray[np.generic], dtype: type) -> NDArray[Any]:
    """Only flat contiguous float32 and int32 arrays are copied as blocks, 50 times faster."""
    return np.ascontiguousarray(values, dtype).ravel()


def _write(mesh: Mesh, attribute: str, member: str, flat: NDArray[np.generic]) -> None:
    mesh.attributes[attribute].data.foreach_set(member, flat)  # pyright: ignore[reportAttributeAccessIssue]
