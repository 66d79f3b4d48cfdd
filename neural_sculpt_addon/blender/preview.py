# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes shown on the proxy at once, until the worker's result takes their place.

Which strokes an object waits for is told to `want`. A mesh that shows some carries its true
positions and normals with it, as attributes: so whatever Blender does meanwhile, an undo step or a
copy of it can be brought back to what the field is. `hide` does that for all meshes, before Blender
saves or steps through its history, and before anything here pushes an undo step.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from ..stroke.stroke import Stroke
from . import proxy_mesh
from .displaced import Displaced

TRUE = {"position": ".neural_sculpt_position", "custom_normal": ".neural_sculpt_normal"}
"""Attributes that a preview changes, and those that keep what they were."""

_Strokes = dict[int, tuple[Stroke, ...]]
_wanted: _Strokes = {}
"""By session_uid of the object."""
_shown: _Strokes = {}
"""What of it the meshes show, which costs some 10 ms: so nothing is shown twice."""
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
    for ob in bpy.data.objects if _wanted else ():
        if strokes := _wanted.get(ob.session_uid):
            _displace(ob, strokes)
    _shown.update(_wanted)


def hide() -> None:
    """Bring every mesh back to what its field is."""
    _shown.clear()
    for mesh in bpy.data.meshes:
        if TRUE["position"] in mesh.attributes and not mesh.is_editmode:
            for shown, true in TRUE.items():
                if true in mesh.attributes:
                    _write(mesh, shown, _read(mesh, true))
                    mesh.attributes.remove(mesh.attributes[true])
            mesh.update()


@contextmanager
def hidden() -> Iterator[None]:
    """Without previews meanwhile."""
    hide()
    try:
        yield
    finally:
        show()


def _displace(ob: Object, strokes: Sequence[Stroke]) -> None:
    """Only a mesh that is the object's own, made of triangles, and not locked."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    of_triangles = len(mesh.loops) == 3 * len(mesh.polygons) > 0
    if mesh.users > 1 or not of_triangles or proxy_mesh.why_locked(ob):
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
