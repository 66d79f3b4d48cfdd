# SPDX-License-Identifier: GPL-3.0-or-later
"""Preview of strokes: shown on the proxy at once, until the worker's result takes their place.

`want` is told which strokes an object waits for, and `draw` how far the one under the pen is. What
strokes make of meshes is computed by `preview_strokes`. A mesh that shows some carries its true
positions and normals with it (`preview_attributes`). `hide` brings all meshes back to these, before
Blender saves or steps through its history, and before anything here pushes an undo step.

Nothing is shown in Edit Mode, nor in Sculpt Mode under another tool, whose steps in Blender's
history would hold it: `refresh` looks at the modes.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from bpy.types import Object
from numpy.typing import NDArray

from ....stroke.stroke import Kind, Stroke
from ..chosen import holds_tool
from ..properties import find
from . import brush_attributes, preview_attributes, proxy_mesh, seen_surface
from .preview_display import PreviewDisplay
from .preview_strokes import StrokeShapes, WantedStrokes, listed

MOST_LOOKED_AT = 8000
"""Vertices that are looked at for each move of the pen, and when it is lifted: some 3 ms of work.
The rest is shown later, one stroke after another."""
SOON = 0.001  # seconds after which the rest is worked on: Blender hears the artist in between


class Preview:
    """What all meshes are to show beside what their fields are, and do show; by session_uid of the
    object."""

    def __init__(self) -> None:
        """Nothing is shown."""
        self._wanted = WantedStrokes()
        self._shapes = StrokeShapes()
        self._displays: dict[int, PreviewDisplay] = {}
        self._shown: dict[int, tuple[Stroke, ...]] = {}
        """The waiting strokes as they were when all was shown last; none when it is hidden."""
        self._able: dict[int, bool] = {}
        """Whether the objects that are to show strokes could, when all was shown last."""
        self.timer = self._catch_up_later  # one object, as Blender knows a timer by it

    def want(self, strokes: Mapping[int, Sequence[Stroke]]) -> None:
        """From now on show these strokes, by session_uid of their object, and no others."""
        waiting = listed(strokes)
        if waiting != self._shown or waiting != self._wanted.waiting or self._drawn_is_lost():
            self._wanted.waiting = waiting
            self._shapes.keep(self._wanted.targets)
            self.show()

    def foresee(
        self,
        target: int,
        positions: NDArray[np.float32],
        triangles: NDArray[np.int32],
        strokes: Sequence[Stroke],
    ) -> bool:
        """Displace some of the strokes on the mesh (V, 3), (F, 3) that an object will have next.

        False when nothing is left to do, and `show` need not compute it any more.
        """
        shape = self._shapes.of(target, positions, triangles, strokes)
        if shape.seen is shape.strokes:
            if len(shape.strokes) == len(strokes):
                return False
            shape.begin(strokes[len(shape.strokes)])
        shape.advance(MOST_LOOKED_AT)
        return True

    def draw(self, ob: Object, stroke: Stroke) -> bool:
        """Show the stroke under the pen as it is now; whether the mesh can show it.

        What takes longer than a move of the pen may is shown soon after. `let_go` or `give_up` ends
        it.
        """
        target = ob.session_uid
        if stroke.kind is not Kind.DRAW or not _can_show(ob):
            self.give_up()
            return False
        before, display = self._wanted.drawn_on(target), self._displays.get(target)
        self._wanted.draw(target, stroke)
        if display is None or not display.is_untouched(ob):
            self.show(0)
            if self.goes_on():
                self._go_on_later()
                return target in self._displays
        elif before is None:
            display.advance()
            display.show(ob)
            seen_surface.hold(ob)
            display.shape.begin(stroke, _protection(ob))
        elif stroke != before:
            display.shape.change(stroke)
        self.catch_up()
        return target in self._displays

    def catch_up(self) -> bool:
        """Go on with the strokes for as long as a move may take; whether all are shown."""
        for target, display in self._displays.items():
            if display.is_whole:
                continue
            ob = find(target)
            if ob is not None and display.is_untouched(ob):
                display.advance(MOST_LOOKED_AT)
                display.show(ob)
                if not display.is_whole:
                    self._go_on_later()
                    return False
        return True

    def goes_on(self) -> bool:
        """Whether timers go on with what is not shown yet: they never run in the background."""
        return not bpy.app.background

    def _go_on_later(self) -> None:
        if self.goes_on() and not bpy.app.timers.is_registered(self.timer):
            bpy.app.timers.register(self.timer, first_interval=SOON)

    def _catch_up_later(self) -> float | None:
        return None if self.catch_up() else SOON

    def let_go(self) -> None:
        """No stroke is drawn any more. `settle` hides it, unless it waits for a result by then."""
        self._wanted.let_go()
        seen_surface.release()

    def give_up(self) -> None:
        """Show the stroke that was drawn no more."""
        self.let_go()
        self.settle()

    def settle(self) -> None:
        """Show the wanted strokes and no others."""
        if any(d.strokes != self._shown.get(target, ()) for target, d in self._displays.items()):
            self._shapes.keep(self._wanted.waiting)
            self.show()

    def show(self, most: int | None = None) -> None:
        """Show the wanted strokes, and the drawn one, on the meshes as they are now.

        most: vertices that are looked at now; all in the background, where nothing would go on with
              it
        """
        self.hide()
        self._able = {ob.session_uid: _can_show(ob) for ob in self._objects()}
        for ob in self._objects():
            if self._able[ob.session_uid]:
                self._displace(ob, most)
        self._shown = dict(self._wanted.waiting)

    def refresh(self) -> None:
        """Show or hide the wanted strokes when the artist has changed mode or tool."""
        if {ob.session_uid: _can_show(ob) for ob in self._objects()} != self._able:
            self.show()

    def hide(self) -> None:
        """Bring every mesh back to what its field is, and what the artist moved since."""
        self._shown = {}
        for mesh in bpy.data.meshes:
            if not preview_attributes.is_previewed(mesh):
                continue
            if not mesh.is_editmode:
                preview_attributes.restore(mesh)
                continue
            shown = (each for each in self._displays.values() if each.mesh == mesh.session_uid)
            display = next(shown, None)
            if display is None:
                preview_attributes.restore_edited(mesh, None, -1)
            else:
                vertices, count = display.shape.vertices, len(display.written)
                preview_attributes.restore_edited(mesh, vertices, count)
        self._displays.clear()

    @contextmanager
    def hidden(self) -> Iterator[None]:
        """Hide all previews while a block runs."""
        self.hide()
        try:
            yield
        finally:
            self.show()

    def positions_below(self, ob: Object) -> NDArray[np.float32]:
        """The vertices (V, 3) of a proxy that the next stroke is drawn on.

        They are as the mesh shows them, but without the stroke that is under the pen, or was there
        a moment ago.
        """
        display = self._displays.get(ob.session_uid)
        waiting = len(self._wanted.waiting.get(ob.session_uid, ()))
        if display and len(display.shape.strokes) > waiting and display.is_untouched(ob):
            return display.shape.below
        return proxy_mesh.positions(ob)

    def _objects(self) -> list[Object]:
        """Those that are to show strokes."""
        targets = self._wanted.targets
        return [ob for ob in bpy.data.objects if ob.session_uid in targets] if targets else []

    def _drawn_is_lost(self) -> bool:
        """Whether the stroke under the pen could be shown and is not."""
        return any(
            target not in self._displays and self._able.get(target, False)
            for target in self._wanted.targets
            if self._wanted.drawn_on(target) is not None
        )

    def _displace(self, ob: Object, most: int | None) -> None:
        """Displace the mesh of an object by its strokes, if it is made of triangles.

        most: vertices that are looked at now; None for all, unless a timer goes on
        """
        mesh, target = proxy_mesh.mesh_of(ob), ob.session_uid
        if not len(mesh.loops) == 3 * len(mesh.polygons) > 0:
            return
        strokes, drawn = self._wanted.waiting.get(target, ()), self._wanted.drawn_on(target)
        everything = strokes if drawn is None else (*strokes, drawn)
        positions, triangles = proxy_mesh.positions(ob), proxy_mesh.corners_of(mesh)
        shape = self._shapes.of(target, positions, triangles, everything)
        todo = strokes[len(shape.strokes) :]
        begun = len(shape.strokes) > len(strokes)
        if drawn is not None and not begun and not strokes:
            seen_surface.hold(ob)
        display = self._displays[target] = PreviewDisplay.begin(ob, shape, todo)
        if drawn is not None and not begun:
            if strokes:
                display.advance()
                display.show(ob)
                seen_surface.hold(ob)
            shape.begin(drawn, _protection(ob))
        if most is None and self.goes_on():
            most = MOST_LOOKED_AT
            self._go_on_later()
        display.advance(most)
        display.seen = ()
        display.show(ob)


def _can_show(ob: Object) -> bool:
    """Whether a mesh may show previews: the object's own, not locked, not under other brushes."""
    assert ob.data is not None
    if ob.data.users > 1 or proxy_mesh.why_locked(ob):
        return False
    if ob.mode != "SCULPT":
        return True
    workspace = bpy.context.window_manager.windows[0].workspace
    return holds_tool(workspace, "SCULPT")


def _protection(ob: Object) -> NDArray[np.float32] | None:
    """Protection (V,) of a proxy's vertices, by masks and hidden faces; None without any.

    The stroke under the pen gets the same as its mask when it is drawn.
    """
    return brush_attributes.protection(proxy_mesh.mesh_of(ob), proxy_mesh.corners_of)


preview = Preview()
"""The only one."""
