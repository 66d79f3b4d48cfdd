# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of a mesh that shows a preview: its true vertices and normals, and those of the
preview.

With these, an undo step or a copy of the mesh can always be brought back to what the field is,
whatever Blender did meanwhile. A vertex that the artist moved meanwhile stays there: it is no
longer where the preview has put it.
"""

from collections.abc import Mapping

import bmesh
import numpy as np
from bpy.types import Mesh
from numpy.typing import NDArray

TRUE = {"position": ".neural_sculpt_position", "custom_normal": ".neural_sculpt_normal"}
"""Attributes that a preview changes, and the names under which their true values are kept."""
SHOWN = ".neural_sculpt_shown"
"""The attribute that keeps where the preview put the vertices."""

Vectors = NDArray[np.float32]  # (V, 3)


def own(mesh: Mesh) -> dict[str, Vectors]:
    """The mesh's own values, by the attribute that a preview changes."""
    return {shown: _read(mesh, shown) for shown in TRUE if shown in mesh.attributes}


def keep(mesh: Mesh, true: Mapping[str, Vectors]) -> None:
    """Begin a preview: the mesh carries its own values, as of `own`, from now on."""
    for shown, values in true.items():
        mesh.attributes.new(TRUE[shown], "FLOAT_VECTOR", "POINT")
        _write(mesh, TRUE[shown], values)
    mesh.attributes.new(SHOWN, "FLOAT_VECTOR", "POINT")
    _write(mesh, SHOWN, true["position"])


def put(
    mesh: Mesh,
    true: Mapping[str, Vectors],
    vertices: NDArray[np.intp],
    positions: Vectors,
    normals: Vectors,
) -> Vectors:
    """Write what the preview makes of some `vertices` (P,): `positions` and `normals` (P, 3).

    true: as of `own`; the mesh keeps them, too

    The vertices (V, 3) as they are now are given back.
    """
    written = true["position"]
    for (shown, values), changed in zip(true.items(), (positions, normals), strict=False):
        now = values.copy()
        now[vertices] = changed
        _write(mesh, shown, now)
        if shown == "position":
            _write(mesh, SHOWN, now)
            written = now
    mesh.update()
    return written


def is_previewed(mesh: Mesh) -> bool:
    """Whether the mesh shows a preview."""
    return TRUE["position"] in mesh.attributes


def is_as_put(mesh: Mesh, written: Vectors) -> bool:
    """Whether all vertices of a mesh out of Edit Mode are where the preview put them."""
    return len(mesh.vertices) == len(written) and np.array_equal(_read(mesh, "position"), written)


def true_positions(mesh: Mesh) -> Vectors:
    """The vertices (V, 3) of a mesh out of Edit Mode without a preview; some 1 ms."""
    now = _read(mesh, "position")
    if not is_previewed(mesh):
        return now
    true = _read(mesh, TRUE["position"])
    if SHOWN in mesh.attributes and not np.array_equal(now, shown := _read(mesh, SHOWN)):
        moved = now - shown
        by_artist = moved.any(axis=1)
        true[by_artist] += moved[by_artist]
    return true


def restore(mesh: Mesh) -> None:
    """Bring a mesh out of Edit Mode back to what it is without its preview."""
    _write(mesh, "position", true_positions(mesh))
    for shown, true in TRUE.items():
        if true in mesh.attributes:
            if shown != "position":
                _write(mesh, shown, _read(mesh, true))
            mesh.attributes.remove(mesh.attributes[true])
    if SHOWN in mesh.attributes:
        mesh.attributes.remove(mesh.attributes[SHOWN])
    mesh.update()


def restore_edited(mesh: Mesh, changed: NDArray[np.intp] | None, count: int) -> None:
    """Bring back the true values of a mesh in Edit Mode.

    changed: numbers (P,) of the vertices that the preview changed, when it had `count` of them;
             None when nobody knows. Edit Mode numbers them anew when some are added or removed
    """
    edited = bmesh.from_edit_mesh(mesh)
    layers = edited.verts.layers.float_vector
    true, shown = (layers.get(name) for name in (TRUE["position"], SHOWN))
    if true is None:
        return
    normal, true_normal = (layers.get(n) for n in ("custom_normal", TRUE["custom_normal"]))
    edited.verts.ensure_lookup_table()
    every = edited.verts
    vertices = every
    if changed is not None and count == len(every):
        vertices = [every[i] for i in changed]
    for vertex in vertices:
        if shown is None or vertex.co == vertex[shown]:
            vertex.co = vertex[true]
        else:
            vertex.co += vertex[true] - vertex[shown]
        if normal is not None and true_normal is not None:
            vertex[normal] = vertex[true_normal]
    for name in (*TRUE.values(), SHOWN):
        if (layer := layers.get(name)) is not None:
            layers.remove(layer)
    bmesh.update_edit_mesh(mesh, loop_triangles=True, destructive=False)


def _read(mesh: Mesh, attribute: str) -> Vectors:
    """Vectors of a point attribute."""
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes[attribute].data.foreach_get("vector", flat)  # pyright: ignore[reportAttributeAccessIssue]
    return flat.reshape(-1, 3)


def _write(mesh: Mesh, attribute: str, vectors: Vectors) -> None:
    mesh.attributes[attribute].data.foreach_set("vector", vectors.ravel())  # pyright: ignore[reportAttributeAccessIssue]
