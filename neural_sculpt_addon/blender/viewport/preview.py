# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes shown on the proxy at once, until the worker's result takes their place.

Which strokes an object waits for is told to `want`. A mesh that shows some carries its true
positions and normals with it, as attributes: so whatever Blender does meanwhile, an undo step or a
copy of it can be brought back to what the field is. `hide` does that for all meshes, before Blender
saves or steps through its history, and before anything here pushes an undo step. What the artist
moved meanwhile stays moved: the mesh also carries what was shown, from which that is told.

Nothing is shown in Edit Mode, nor in Sculpt Mode under another tool, whose steps in Blender's
history would hold it: `refresh` looks at the modes.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import bmesh
import bpy
import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from ...stroke.stroke import Stroke
from ..scene import proxy_mesh
from . import overlay
from .displaced import Displaced

TRUE = {"position": ".neural_sculpt_position", "custom_normal": ".neural_sculpt_normal"}
"""Attributes that a preview changes, and those that keep what they were."""
SHOWN = ".neural_sculpt_shown"
"""The attribute that keeps where the preview put the vertices."""

_Strokes = dict[int, tuple[Stroke, ...]]
_wanted: _Strokes = {}
"""By session_uid of the object."""
_shown: _Strokes = {}
"""What of it the meshes show, which costs some 10 ms: so nothing is shown twice."""
_able: dict[int, bool] = {}
"""Of the wanted ones, whether the object could show them then."""
_displaced: dict[int, tuple[int, NDArray[np.intp]]] = {}
"""By session_uid of the mesh the number of its vertices, and which of them are displaced."""
_shapes: dict[int, tuple[int, Displaced]] = {}
"""By session_uid of the object the fingerprint of a mesh, and what strokes make of it: so that each
is displaced once."""


def want(strokes: Mapping[int, Sequence[Stroke]]) -> None:
    """From now on show these strokes, by session_uid of their object, and no others."""
    wanted = {target: tuple(listed) for target, listed in strokes.items()}
    if wanted != _shown or wanted != _wanted:
        _wanted.clear()
        _wanted.update(wanted)
        for target in [*_shapes]:
            if target not in wanted:
                del _shapes[target]
        show()


def foresee(
    target: int,
    positions: NDArray[np.float32],
    triangles: NDArray[np.int32],
    strokes: Sequence[Stroke],
) -> bool:
    """Displace one of the strokes on the mesh (V, 3), (F, 3) that an object will have next.

    False when nothing is left to do, and `show` need not compute it any more.
    """
    shape = _shape(target, positions, triangles, strokes)
    if len(shape.strokes) == len(strokes):
        return False
    shape.add(strokes[len(shape.strokes)])
    return True


def show() -> None:
    """Show the wanted strokes on the meshes as they are now."""
    hide()
    _able.clear()
    for ob in bpy.data.objects if _wanted else ():
        if strokes := _wanted.get(ob.session_uid):
            _able[ob.session_uid] = _can_show(ob)
            if _able[ob.session_uid]:
                _displace(ob, strokes)
    _shown.update(_wanted)


def refresh() -> None:
    """Show or hide the wanted strokes when the artist has changed mode or tool."""
    wanted = (ob for ob in bpy.data.objects if ob.session_uid in _wanted) if _wanted else ()
    if {ob.session_uid: _can_show(ob) for ob in wanted} != _able:
        show()


def hide() -> None:
    """Bring every mesh back to what its field is, and what the artist moved since."""
    _shown.clear()
    for mesh in bpy.data.meshes:
        if TRUE["position"] not in mesh.attributes:
            continue
        if mesh.is_editmode:
            _hide_in_edit_mode(mesh)
            continue
        _write(mesh, "position", true_positions(mesh))
        for shown, true in TRUE.items():
            if true in mesh.attributes:
                if shown != "position":
                    _write(mesh, shown, _read(mesh, true))
                mesh.attributes.remove(mesh.attributes[true])
        if SHOWN in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[SHOWN])
        mesh.update()
    _displaced.clear()


def true_positions(mesh: Mesh) -> NDArray[np.float32]:
    """The vertices (V, 3) of a mesh out of Edit Mode without a preview; some 1 ms."""
    now = _read(mesh, "position")
    if TRUE["position"] not in mesh.attributes:
        return now
    true = _read(mesh, TRUE["position"])
    if SHOWN in mesh.attributes:
        moved = now - _read(mesh, SHOWN)
        by_artist = moved.any(axis=1)
        true[by_artist] += moved[by_artist]
    return true


@contextmanager
def hidden() -> Iterator[None]:
    """Without previews meanwhile."""
    hide()
    try:
        yield
    finally:
        show()


def _can_show(ob: Object) -> bool:
    """Only on a mesh that is the object's own, not locked, and not under Blender's own brushes."""
    assert ob.data is not None
    if ob.data.users > 1 or proxy_mesh.why_locked(ob):
        return False
    if ob.mode != "SCULPT":
        return True
    workspace = bpy.context.window_manager.windows[0].workspace  # pyright: ignore
    tool = workspace.tools.from_space_view3d_mode("SCULPT", create=False)
    return tool is not None and tool.idname == overlay.TOOL


def _hide_in_edit_mode(mesh: Mesh) -> None:
    """The same for a mesh that is edited already; only at first are vertices known by number."""
    edited = bmesh.from_edit_mesh(mesh)
    layers = edited.verts.layers.float_vector
    true, shown = (layers.get(name) for name in (TRUE["position"], SHOWN))
    if true is None:
        return
    normal, true_normal = (layers.get(n) for n in ("custom_normal", TRUE["custom_normal"]))
    count, chosen = _displaced.get(mesh.session_uid, (-1, None))
    edited.verts.ensure_lookup_table()
    every = edited.verts
    vertices = [every[i] for i in chosen] if chosen is not None and count == len(every) else every
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


def _displace(ob: Object, strokes: Sequence[Stroke]) -> None:
    """Only a mesh made of triangles."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    if not len(mesh.loops) == 3 * len(mesh.polygons) > 0:
        return
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.attributes[".corner_vert"].data.foreach_get("value", corners)  # pyright: ignore
    now = {shown: _read(mesh, shown) for shown in TRUE if shown in mesh.attributes}
    moved = _shape(ob.session_uid, now["position"], corners.reshape(-1, 3), strokes)
    for stroke in strokes[len(moved.strokes) :]:
        moved.add(stroke)
    for shown, values in zip(TRUE, (moved.positions, moved.normals), strict=True):
        if shown in now:
            mesh.attributes.new(TRUE[shown], "FLOAT_VECTOR", "POINT")
            _write(mesh, TRUE[shown], now[shown])
            now[shown][moved.vertices] = values
            _write(mesh, shown, now[shown])
    mesh.attributes.new(SHOWN, "FLOAT_VECTOR", "POINT")
    _write(mesh, SHOWN, now["position"])
    _displaced[mesh.session_uid] = len(mesh.vertices), moved.vertices
    mesh.update()


def _shape(
    target: int,
    positions: NDArray[np.float32],
    triangles: NDArray[np.int32],
    strokes: Sequence[Stroke],
) -> Displaced:
    """A mesh displaced by the first of the strokes, as many of them as were added already."""
    mesh = proxy_mesh.fingerprint(positions)
    known = _shapes.get(target)
    if known and known[0] == mesh and known[1].strokes == tuple(strokes[: len(known[1].strokes)]):
        return known[1]
    shape = Displaced(positions, triangles)
    _shapes[target] = mesh, shape
    return shape


def _read(mesh: Mesh, attribute: str) -> NDArray[np.float32]:
    """Vectors (V, 3) of a point attribute."""
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes[attribute].data.foreach_get("vector", flat)  # pyright: ignore
    return flat.reshape(-1, 3)


def _write(mesh: Mesh, attribute: str, vectors: NDArray[np.float32]) -> None:
    mesh.attributes[attribute].data.foreach_set("vector", vectors.ravel())  # pyright: ignore
