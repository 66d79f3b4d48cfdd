# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of an object as the viewports show it, with its modifiers: what the mouse hits and
strokes are drawn on.

Its triangles are sorted into a grid when they are first asked for, and again after Blender has
evaluated another shape. While a stroke is drawn, the surface is held as it was when the stroke
began, so the pen does not climb on what its own stroke has raised. Local space of the object, which
is model space for a field.
"""

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.types import Depsgraph, Mesh, Object

from ....interaction.triangle_grid import TriangleGrid
from . import proxy_mesh

_grids: dict[int, TriangleGrid] = {}
"""By session_uid of the object."""
_held: set[int] = set()
"""Objects whose grid stays, whatever their meshes show."""


def grid_of(ob: Object) -> TriangleGrid | None:
    """The surface of a mesh object; None while there is none to be seen."""
    if ob.session_uid in _held:
        return _grids[ob.session_uid] if ob.visible_get() else None
    depsgraph = bpy.context.evaluated_depsgraph_get()  # evaluates what has changed: see `_forget`
    if not ob.visible_get():
        return None
    if ob.session_uid not in _grids:
        mesh = ob.evaluated_get(depsgraph).data
        assert isinstance(mesh, Mesh)
        if not len(mesh.polygons):
            return None
        _grids[ob.session_uid] = TriangleGrid(*_read(mesh))
    return _grids[ob.session_uid]


def hold(ob: Object) -> None:
    """Let the surface be what it is now until it is released; another one is not held any more."""
    release()
    if grid_of(ob) is not None:
        _held.add(ob.session_uid)


def release() -> None:
    """Follow what the meshes show again."""
    for target in _held:
        del _grids[target]
    _held.clear()


def _read(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3)."""
    if len(mesh.loops) != 3 * len(mesh.polygons):
        return proxy_mesh.read(mesh)
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.attributes["position"].data.foreach_get("vector", vertices)  # pyright: ignore[reportAttributeAccessIssue]
    mesh.attributes[".corner_vert"].data.foreach_get("value", corners)  # pyright: ignore[reportAttributeAccessIssue]
    return vertices.reshape(-1, 3), corners.reshape(-1, 3)


@persistent
def _forget(_scene: object, depsgraph: Depsgraph | None = None) -> None:
    """Forget what is no longer seen, after Blender has evaluated the scene or loaded another."""
    if depsgraph is None:
        _held.clear()
    if depsgraph is None or any(update.is_updated_geometry for update in depsgraph.updates):
        for target in [*_grids]:
            if target not in _held:
                del _grids[target]


_HANDLERS = ("depsgraph_update_post", "frame_change_post", "load_post")


def register() -> None:
    """Listen to changes."""
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).append(_forget)


def unregister() -> None:
    """Stop listening."""
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(_forget)
    _held.clear()
    _grids.clear()
