# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes shown on the proxy at once, while they are drawn and until the worker's result takes
their place.

Which strokes an object waits for is told to `want`, and to `draw` the one under the pen, which is
one more of them and grows. A mesh that shows some carries its true positions and normals with it,
as attributes: so whatever Blender does meanwhile, an undo step or a copy of it can be brought back
to what the field is. `hide` does that for all meshes, before Blender saves or steps through its
history, and before anything here pushes an undo step. What the artist moved meanwhile stays moved:
the mesh also carries what was shown, from which that is told.

Nothing is shown in Edit Mode, nor in Sculpt Mode under another tool, whose steps in Blender's
history would hold it: `refresh` looks at the modes.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import bmesh
import bpy
import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from ....interaction.displaced import Displaced
from ....stroke.stroke import Kind, Stroke
from ..objects import find
from ..tool import holds_tool
from . import brush_attributes, proxy_mesh, seen_surface

MOST = 8000
"""Vertices that are looked at in a move of the pen, and when it is lifted, some 3 ms: what takes
more is shown later, one stroke after another."""
SOON = 0.001  # seconds after which the rest is worked on: Blender hears the artist in between

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
_shapes: dict[int, tuple[int, Displaced]] = {}
"""By session_uid of the object the fingerprint of a mesh, and what strokes make of it: so that each
is displaced once."""
_drawn: dict[int, Stroke] = {}
"""The one that is being drawn, by session_uid of its object."""


@dataclass
class _Display:
    """What a mesh shows.

    true:    its own values, by the attributes that a preview changes
    written: where its vertices (V, 3) were put
    todo:    strokes that the shape is to be given after those that it has
    seen:    strokes of the shape that are in it
    """

    mesh: int  # its session_uid
    shape: Displaced
    true: dict[str, NDArray[np.float32]]
    written: NDArray[np.float32]
    todo: tuple[Stroke, ...] = ()
    seen: tuple[Stroke, ...] = ()

    @property
    def strokes(self) -> tuple[Stroke, ...]:
        """What it shows, or will soon."""
        return *self.shape.strokes, *self.todo

    @property
    def is_whole(self) -> bool:
        """Whether it shows all of them."""
        return self.seen is self.shape.strokes and not self.todo

    def advance(self, most: int | None = None) -> None:
        """Displace by the strokes until some `most` vertices were looked at."""
        looked = self.shape.advance(most)
        while self.todo and (most is None or looked < most):
            self.shape.begin(self.todo[0])
            self.todo = self.todo[1:]
            looked += self.shape.advance(None if most is None else most - looked)


_displays: dict[int, _Display] = {}
"""By session_uid of the object."""


def want(strokes: Mapping[int, Sequence[Stroke]]) -> None:
    """From now on show these strokes, by session_uid of their object, and no others."""
    wanted = {target: tuple(listed) for target, listed in strokes.items()}
    if wanted != _shown or wanted != _wanted or _drawn_is_lost():
        _wanted.clear()
        _wanted.update(wanted)
        for target in [*_shapes]:
            if target not in wanted and target not in _drawn:
                del _shapes[target]
        show()


def foresee(
    target: int,
    positions: NDArray[np.float32],
    triangles: NDArray[np.int32],
    strokes: Sequence[Stroke],
) -> bool:
    """Displace some of the strokes on the mesh (V, 3), (F, 3) that an object will have next.

    False when nothing is left to do, and `show` need not compute it any more.
    """
    shape = _shape(target, positions, triangles, strokes)
    if shape.seen is shape.strokes:
        if len(shape.strokes) == len(strokes):
            return False
        shape.begin(strokes[len(shape.strokes)])
    shape.advance(MOST)
    return True


def draw(ob: Object, stroke: Stroke) -> bool:
    """Show the stroke under the pen as it is now; whether the mesh can show it.

    What takes longer than a move of the pen may is shown soon after. `let_go` or `give_up` ends it.
    """
    target = ob.session_uid
    if stroke.kind is not Kind.DRAW or not _can_show(ob):
        give_up()
        return False
    before, display = _drawn.get(target), _displays.get(target)
    _drawn.clear()
    _drawn[target] = stroke
    if display is None or not _is_untouched(ob, display):
        show(0)
    elif before is None:
        display.advance()
        _show_shape(ob, display)
        seen_surface.hold(ob)
        display.shape.begin(stroke, _protection(ob))
    elif stroke != before:
        display.shape.change(stroke)
    catch_up()
    return target in _displays


def catch_up() -> bool:
    """Go on with the strokes for as long as a move may take; whether all are shown."""
    for target, display in _displays.items():
        if display.is_whole:
            continue
        ob = find(target)
        if ob is not None and _is_untouched(ob, display):
            display.advance(MOST)
            _show_shape(ob, display)
            if not display.is_whole:
                _go_on_later()
                return False
    return True


def goes_on() -> bool:
    """Whether timers go on with what is not shown yet: they never run in the background."""
    return not bpy.app.background


def _go_on_later() -> None:
    if goes_on() and not bpy.app.timers.is_registered(_catch_up_later):
        bpy.app.timers.register(_catch_up_later, first_interval=SOON)


def _catch_up_later() -> float | None:
    return None if catch_up() else SOON


def let_go() -> None:
    """No stroke is drawn any more; `settle` forgets it, unless it waits for a result by then."""
    _drawn.clear()
    seen_surface.release()


def give_up() -> None:
    """Show the stroke that was drawn no more."""
    let_go()
    settle()


def settle() -> None:
    """Show the wanted strokes and no others."""
    if any(d.strokes != _shown.get(target, ()) for target, d in _displays.items()):
        for target in [*_shapes]:
            if target not in _wanted:
                del _shapes[target]
        show()


def show(most: int | None = None) -> None:
    """Show the wanted strokes, and the drawn one, on the meshes as they are now.

    most: vertices that are looked at now; all in the background, where nothing would go on with it
    """
    hide()
    _able.clear()
    for ob in bpy.data.objects if _wanted or _drawn else ():
        strokes, drawn = _wanted.get(ob.session_uid, ()), _drawn.get(ob.session_uid)
        if strokes or drawn:
            _able[ob.session_uid] = _can_show(ob)
            if _able[ob.session_uid]:
                _displace(ob, strokes, drawn, most)
    _shown.update(_wanted)


def refresh() -> None:
    """Show or hide the wanted strokes when the artist has changed mode or tool."""
    wanted = {*_wanted, *_drawn}
    objects = (ob for ob in bpy.data.objects if ob.session_uid in wanted) if wanted else ()
    if {ob.session_uid: _can_show(ob) for ob in objects} != _able:
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
    _displays.clear()


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


def positions_below(ob: Object) -> NDArray[np.float32]:
    """The vertices (V, 3) of a proxy that the next stroke is drawn on: as the mesh shows them, but
    without the stroke under the pen, or that was until just now."""
    target = ob.session_uid
    display, waiting = _displays.get(target), len(_wanted.get(target, ()))
    if display and len(display.shape.strokes) > waiting and _is_untouched(ob, display):
        return display.shape.below
    return proxy_mesh.positions(ob)


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
    return holds_tool(workspace, "SCULPT")


def _hide_in_edit_mode(mesh: Mesh) -> None:
    """The same for a mesh that is edited already; only at first are vertices known by number."""
    edited = bmesh.from_edit_mesh(mesh)
    layers = edited.verts.layers.float_vector
    true, shown = (layers.get(name) for name in (TRUE["position"], SHOWN))
    if true is None:
        return
    normal, true_normal = (layers.get(n) for n in ("custom_normal", TRUE["custom_normal"]))
    display = next((d for d in _displays.values() if d.mesh == mesh.session_uid), None)
    count = -1 if display is None else len(display.written)
    chosen = None if display is None else display.shape.vertices
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


def _displace(
    ob: Object, strokes: Sequence[Stroke], drawn: Stroke | None, most: int | None
) -> None:
    """Only a mesh made of triangles."""
    mesh, target = proxy_mesh.mesh_of(ob), ob.session_uid
    if not len(mesh.loops) == 3 * len(mesh.polygons) > 0:
        return
    true = {shown: _read(mesh, shown) for shown in TRUE if shown in mesh.attributes}
    everything = tuple(strokes) if drawn is None else (*strokes, drawn)
    shape = _shape(target, true["position"], proxy_mesh.corners_of(mesh), everything)
    todo = tuple(strokes[len(shape.strokes) :])
    begun = len(shape.strokes) > len(strokes)
    if drawn is not None and not begun and not strokes:
        seen_surface.hold(ob)
    for shown, values in true.items():
        mesh.attributes.new(TRUE[shown], "FLOAT_VECTOR", "POINT")
        _write(mesh, TRUE[shown], values)
    mesh.attributes.new(SHOWN, "FLOAT_VECTOR", "POINT")
    display = _displays[target] = _Display(mesh.session_uid, shape, true, true["position"], todo)
    if drawn is not None and not begun:
        if strokes:
            display.advance()
            _show_shape(ob, display)
            seen_surface.hold(ob)
        shape.begin(drawn, _protection(ob))
    if most is None and goes_on():
        most = MOST
        _go_on_later()
    display.advance(most)
    display.seen = ()
    _show_shape(ob, display)


def _show_shape(ob: Object, display: _Display) -> None:
    """Write what the shape has become since; below 1 ms."""
    shape, mesh = display.shape, proxy_mesh.mesh_of(ob)
    if display.seen is shape.seen and display.seen:
        return
    vertices = shape.vertices
    for (shown, true), values in zip(
        display.true.items(), (shape.positions, shape.normals), strict=False
    ):
        now = true.copy()
        now[vertices] = values
        _write(mesh, shown, now)
        if shown == "position":
            _write(mesh, SHOWN, now)
            display.written = now
    display.seen = shape.seen
    mesh.update()


def _is_untouched(ob: Object, display: _Display) -> bool:
    """Whether the mesh still is as it was shown."""
    mesh = proxy_mesh.mesh_of(ob)
    if mesh.session_uid != display.mesh or mesh.is_editmode:
        return False
    if len(mesh.vertices) != len(display.written):
        return False
    return SHOWN in mesh.attributes and np.array_equal(_read(mesh, "position"), display.written)


def _protection(ob: Object) -> NDArray[np.float32] | None:
    """What is masked or hidden on a proxy, which the stroke under the pen gets as its mask in the
    end."""
    mesh = proxy_mesh.mesh_of(ob)
    return brush_attributes.protection(mesh, proxy_mesh.corners_of(mesh))


def _drawn_is_lost() -> bool:
    """Whether the stroke under the pen could be shown and is not."""
    return any(target not in _displays and _able.get(target, False) for target in _drawn)


def _shape(
    target: int,
    positions: NDArray[np.float32],
    triangles: NDArray[np.int32],
    strokes: Sequence[Stroke],
) -> Displaced:
    """A mesh displaced by the first of the strokes, as many of them as were added already; the last
    of these may have grown since."""
    mesh = proxy_mesh.fingerprint(positions)
    known = _shapes.get(target)
    if known and known[0] == mesh and 0 < (count := len(known[1].strokes)) <= len(strokes):
        shape = known[1]
        if shape.strokes[:-1] == tuple(strokes[: count - 1]):
            if shape.strokes[-1] != strokes[count - 1]:
                shape.change(strokes[count - 1])
            return shape
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
