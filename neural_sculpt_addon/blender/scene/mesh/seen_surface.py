# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of an object as the viewports show it, with its modifiers: what the mouse hits and
strokes are drawn on.

Its triangles are sorted into a grid when they are first asked for, and again after Blender has
evaluated another shape. For what acts on it that is done at once; for what is only looked at in
steps, and the last grid is seen until then: 300,000 triangles take 30 ms in a window. While a
stroke is drawn, the surface is held as it was when the stroke began, so the pen does not climb on
what its own stroke has raised. Local space of the object, which is model space for a field.
"""

import time
from collections.abc import Callable, Generator

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.types import Depsgraph, Mesh, Object

from ....interaction.steps import finish
from ....interaction.triangle_grid import TriangleGrid
from . import proxy_mesh

STEPS = 0.004
"""Seconds after which no other step is begun before Blender hears the artist."""
SOON = 0.001

_grids: dict[int, TriangleGrid] = {}
"""By session_uid of the object."""
_before: dict[int, TriangleGrid] = {}
"""The same as they were before the last change."""
_sorting: dict[int, Generator[None, None, TriangleGrid]] = {}
"""Those that are being made."""
_held: set[int] = set()
"""Objects whose grid stays, whatever their meshes show."""
_told: list[Callable[[], None]] = []
"""Called when a grid is sorted that `grid_soon` was asked for; one at most."""


def grid_of(ob: Object) -> TriangleGrid | None:
    """The surface of a mesh object; None while there is none to be seen."""
    if _is_begun(ob) and (steps := _sorting.pop(ob.session_uid, None)) is not None:
        _grids[ob.session_uid] = finish(steps)
    return _grids.get(ob.session_uid) if ob.visible_get() else None


def grid_soon(ob: Object, then: Callable[[], None]) -> TriangleGrid | None:
    """The surface of a mesh object, for what is only looked at: while its grid is being sorted the
    one before, None without any, and `then` is called at the end."""
    target = ob.session_uid
    if not _is_begun(ob) or not ob.visible_get():
        return None
    if target in _sorting:
        _told[:] = [then]
        if not bpy.app.timers.is_registered(_go_on):
            bpy.app.timers.register(_go_on, first_interval=SOON)
        return _before.get(target)
    return _grids.get(target)


def _is_begun(ob: Object) -> bool:
    """Have the grid of the surface sorted, unless it is or is being; whether there is a surface to
    be seen."""
    target = ob.session_uid
    if target in _held:
        return True
    depsgraph = bpy.context.evaluated_depsgraph_get()  # evaluates what has changed: see `_forget`
    if not ob.visible_get():
        return False
    if target not in _grids and target not in _sorting:
        mesh = ob.evaluated_get(depsgraph).data
        assert isinstance(mesh, Mesh)
        if not len(mesh.polygons):
            return False
        _sorting[target] = TriangleGrid.sorting(*_read(mesh))
    return True


def _go_on() -> float | None:
    """Take some steps; the seconds until the next ones, None when all is made."""
    end = time.perf_counter() + STEPS
    while _sorting and time.perf_counter() < end:
        target, steps = _sorting.popitem()
        try:
            next(steps)
            _sorting[target] = steps
        except StopIteration as made:
            _grids[target] = made.value
            for gone in {*_before} - {ob.session_uid for ob in bpy.data.objects} | {target}:
                _before.pop(gone, None)
            for tell in _told:
                tell()
    return SOON if _sorting else None


def hold(ob: Object) -> None:
    """Let the surface be what it is now until it is released; another one is not held any more."""
    release()
    if grid_of(ob) is not None:
        _held.add(ob.session_uid)


def release() -> None:
    """Follow what the meshes show again."""
    for target in _held:
        _before[target] = _grids.pop(target)
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
        _clear()
    elif any(update.is_updated_geometry for update in depsgraph.updates):
        _sorting.clear()
        for target in {*_grids} - _held:
            _before[target] = _grids.pop(target)


_HANDLERS = ("depsgraph_update_post", "frame_change_post", "load_post")


def register() -> None:
    """Listen to changes."""
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).append(_forget)


def unregister() -> None:
    """Stop listening."""
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(_forget)
    if bpy.app.timers.is_registered(_go_on):
        bpy.app.timers.unregister(_go_on)
    _clear()


def _clear() -> None:
    for known in (_held, _grids, _before, _sorting, _told):
        known.clear()
