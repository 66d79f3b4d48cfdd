# SPDX-License-Identifier: GPL-3.0-or-later
"""Next proxy: the mesh that a result brings to an object, with the attributes of the present one.

In a window it is prepared ahead, some milliseconds at a time: what it takes over, and where it is
large a `spare_mesh`, with which less is left to do when it is shown. What was not prepared is made
at once. Model space.
"""

import time
from dataclasses import dataclass, replace

import bpy
from bpy.types import Object

from ...worker.answers import PROXY
from ...worker.client import Message
from . import sculpt_steps
from .mesh import carried, preview_attributes, proxy_mesh, spare_mesh
from .mesh.proxy_mesh import Geometry
from .mesh.spare_mesh import SpareMesh
from .sculpt_steps import Step

LARGE = 60_000
"""Vertices from which on a mesh is made ahead: a smaller one is shown in less than 16 ms as it is,
in Sculpt Mode, too."""
MOST_OBJECTS = 200
"""Objects of a file, up to which a mesh is made ahead. When an object gets another mesh, Blender
looks at all relations in the scene anew, in 40 ms for a thousand objects; it saves 20 at most."""
MODES = {"OBJECT", "SCULPT"}
"""Modes in which an object may get another mesh: brushes of the others hold on to it."""
SECONDS = 0.005
"""Seconds after which no other piece of work is begun."""
UNSEEN = 1.0
"""Seconds after which the mesh that was shown before is removed: a slider that the artist drags may
be of it until the interface is drawn with the next one."""


@dataclass(eq=False)
class _Prepared:
    """A spare mesh for a result.

    step: of Blender's history at which it was begun; whatever the artist changes makes another
    """

    target: int
    result: Message
    smooth: bool
    step: Step
    geometry: Geometry
    spare: SpareMesh


_prepared: list[_Prepared] = []
"""One at most."""


def geometry_of(result: Message, smooth: bool) -> Geometry:
    """The mesh of a result, without attributes; whether it is shaded `smooth`."""
    return proxy_mesh.geometry(*(result.arrays[name] for name in PROXY), smooth=smooth)


def next_geometry(ob: Object, result: Message, smooth: bool) -> Geometry:
    """The mesh of a result, with the attributes of the object's mesh."""
    if (ready := _ready(ob, result, smooth)) is not None:
        return ready.geometry
    geometry, mesh = geometry_of(result, smooth), proxy_mesh.mesh_of(ob)
    painted, kept = carried.carried(ob, lambda: preview_attributes.true_positions(mesh), geometry)
    return replace(geometry, painted=painted, attributes=kept)


def carries(ob: Object, result: Message) -> bool:
    """Work for some milliseconds at the attributes that `next_geometry` takes over; whether there
    is more to do."""
    mesh, arrays = proxy_mesh.mesh_of(ob), result.arrays
    return carried.foresee(
        ob, lambda: preview_attributes.true_positions(mesh), arrays["vertices"], arrays["triangles"]
    )


def prepare(ob: Object, result: Message, smooth: bool) -> bool:
    """Work for some milliseconds at the mesh that a checked result brings; whether there is more to
    do. Where Blender's history cannot be read, nothing would tell what the artist changes
    meanwhile, and no mesh is made ahead."""
    if proxy_mesh.why_locked(ob):
        return False
    if (ready := _ready(ob, result, smooth)) is None:
        if carries(ob, result):
            return True
        step = sculpt_steps.active()
        if step is None or len(result.arrays["vertices"]) < LARGE or not _can_swap(ob):
            return False
        geometry = next_geometry(ob, result, smooth)
        spare = SpareMesh(geometry, sculpted=ob.mode == "SCULPT")
        ready = _Prepared(ob.session_uid, result, smooth, step, geometry, spare)
        forget()
        _prepared.append(ready)
    end = time.perf_counter() + SECONDS
    while more := ready.spare.work(ob):
        if time.perf_counter() > end:
            break
    return more


def show(ob: Object, geometry: Geometry) -> bool:
    """Let the object show the mesh that was prepared for this geometry; False when none was."""
    ready = next((each for each in _prepared if each.geometry is geometry), None)
    if ready is None or not (ready.spare.is_done and ready.spare.is_there and _can_swap(ob)):
        return False
    ready.spare.show(ob)
    _prepared.clear()
    if bpy.app.background:
        spare_mesh.sweep()
    elif not bpy.app.timers.is_registered(_sweep):
        bpy.app.timers.register(_sweep, first_interval=UNSEEN)
    return True


def forget() -> None:
    """Nothing comes any more."""
    carried.forget()
    if _prepared:
        follow()


def _sweep() -> None:
    """Remove the mesh that an object showed before. While another one is being made it waits for
    the end of that, which sweeps all."""
    if not _prepared:
        spare_mesh.sweep()


def follow() -> None:
    """After undo and redo, which may have brought a spare mesh back or taken this one away."""
    _prepared.clear()
    spare_mesh.sweep()


def _ready(ob: Object, result: Message, smooth: bool) -> _Prepared | None:
    """What was prepared for this, unless something else was done since."""
    for each in _prepared:
        if each.result is result and (each.target, each.smooth) == (ob.session_uid, smooth):
            now = each.step == sculpt_steps.active() and each.spare.is_there
            return each if now else None
    return None


def _can_swap(ob: Object) -> bool:
    """Whether the object may get another mesh, and that saves time."""
    alone = proxy_mesh.mesh_of(ob).users == 1
    return alone and ob.mode in MODES and len(bpy.data.objects) <= MOST_OBJECTS
