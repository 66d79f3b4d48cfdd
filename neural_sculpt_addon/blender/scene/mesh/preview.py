# SPDX-License-Identifier: GPL-3.0-or-later
"""Preview of strokes: shown on the proxy at once, until the worker's result takes their place.

Which strokes an object waits for is told to `want`, and to `draw` the one under the pen, which is
one more of them and grows. A mesh that shows some carries its true positions and normals with it
(`preview_attributes`). `hide` brings all meshes back to these, before Blender saves or steps
through its history, and before anything here pushes an undo step.

Nothing is shown in Edit Mode, nor in Sculpt Mode under another tool, whose steps in Blender's
history would hold it: `refresh` looks at the modes.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from bpy.types import Object
from numpy.typing import NDArray

from ....interaction.displaced import Displaced
from ....stroke.stroke import Kind, Stroke
from ..objects import find
from ..tool import holds_tool
from . import brush_attributes, preview_attributes, proxy_mesh, seen_surface
from .preview_display import Display

MOST_LOOKED_AT = 8000
"""Vertices that are looked at for one move of the pen, and when it is lifted; that takes some 3 ms.
What takes more is shown later, one stroke after another."""
SOON = 0.001  # seconds after which the rest is worked on: Blender hears the artist in between

_Strokes = dict[int, tuple[Stroke, ...]]
_wanted: _Strokes = {}
"""By session_uid of the object."""
_shown: _Strokes = {}
"""Those of them that the meshes show. To show one takes some 10 ms, so none is shown twice."""
_able: dict[int, bool] = {}
"""Of the wanted ones, whether the object could show them then."""
_shapes: dict[int, tuple[int, Displaced]] = {}
"""By session_uid of the object: the fingerprint of a mesh, and what strokes make of that mesh. It
is kept so that each stroke is displaced once."""
_drawn: dict[int, Stroke] = {}
"""The one that is being drawn, by session_uid of its object."""
_displays: dict[int, Display] = {}
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
    shape.advance(MOST_LOOKED_AT)
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
    if display is None or not display.is_untouched(ob):
        show(0)
    elif before is None:
        display.advance()
        display.show(ob)
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
        if ob is not None and display.is_untouched(ob):
            display.advance(MOST_LOOKED_AT)
            display.show(ob)
            if not display.is_whole:
                _go_on_later()
                return False
    return True


def goes_on() -> bool:
    """Whether timers go on with what is not shown yet: they never run in the background."""
    return not bpy.app.background


def _go_on_later() -> None:
    if goes_on() and not bpy.app.timers.is_registered(catch_up_later):
        bpy.app.timers.register(catch_up_later, first_interval=SOON)


def catch_up_later() -> float | None:
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
        if not preview_attributes.is_previewed(mesh):
            continue
        if not mesh.is_editmode:
            preview_attributes.restore(mesh)
            continue
        display = next((d for d in _displays.values() if d.mesh == mesh.session_uid), None)
        if display is None:
            preview_attributes.restore_edited(mesh, None, -1)
        else:
            preview_attributes.restore_edited(mesh, display.shape.vertices, len(display.written))
    _displays.clear()


def positions_below(ob: Object) -> NDArray[np.float32]:
    """The vertices (V, 3) of a proxy that the next stroke is drawn on.

    They are as the mesh shows them, but without the stroke that is under the pen, or was there a
    moment ago.
    """
    target = ob.session_uid
    display, waiting = _displays.get(target), len(_wanted.get(target, ()))
    if display and len(display.shape.strokes) > waiting and display.is_untouched(ob):
        return display.shape.below
    return proxy_mesh.positions(ob)


@contextmanager
def hidden() -> Iterator[None]:
    """Hide all previews while a block runs."""
    hide()
    try:
        yield
    finally:
        show()


def _can_show(ob: Object) -> bool:
    """Whether a mesh may show previews: the object's own, not locked, not under other brushes."""
    assert ob.data is not None
    if ob.data.users > 1 or proxy_mesh.why_locked(ob):
        return False
    if ob.mode != "SCULPT":
        return True
    workspace = bpy.context.window_manager.windows[0].workspace
    return holds_tool(workspace, "SCULPT")


def _displace(
    ob: Object, strokes: Sequence[Stroke], drawn: Stroke | None, most: int | None
) -> None:
    """Displace the mesh of an object by strokes, `drawn` the last one, if it is made of triangles.

    most: vertices that are looked at now; None for all, unless a stroke goes on
    """
    mesh, target = proxy_mesh.mesh_of(ob), ob.session_uid
    if not len(mesh.loops) == 3 * len(mesh.polygons) > 0:
        return
    everything = tuple(strokes) if drawn is None else (*strokes, drawn)
    shape = _shape(target, proxy_mesh.positions(ob), proxy_mesh.corners_of(mesh), everything)
    todo = tuple(strokes[len(shape.strokes) :])
    begun = len(shape.strokes) > len(strokes)
    if drawn is not None and not begun and not strokes:
        seen_surface.hold(ob)
    display = _displays[target] = Display.begin(ob, shape, todo)
    if drawn is not None and not begun:
        if strokes:
            display.advance()
            display.show(ob)
            seen_surface.hold(ob)
        shape.begin(drawn, _protection(ob))
    if most is None and goes_on():
        most = MOST_LOOKED_AT
        _go_on_later()
    display.advance(most)
    display.seen = ()
    display.show(ob)


def _protection(ob: Object) -> NDArray[np.float32] | None:
    """Protection (V,) of a proxy's vertices, by masks and hidden faces; None without any.

    The stroke under the pen gets the same as its mask when it is drawn.
    """
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
    """The mesh displaced by the first strokes, as many as were added already. The last of these may
    have grown since."""
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
