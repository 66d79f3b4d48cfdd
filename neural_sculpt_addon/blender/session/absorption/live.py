# SPDX-License-Identifier: GPL-3.0-or-later
"""Live absorption: each stroke of a brush of Sculpt Mode on a proxy goes into the field by itself.

    a stroke ends -> what it moved is cut out -> one job -> a layer, an entry and one undo step

Blender tells of every change in Sculpt Mode (depsgraph_update_post), so the mesh is compared with
what it was when no brush is at work. Strokes in quick succession are absorbed one by one, each on
the result of the one before, and reach the scene between two strokes or when the artist's hand
rests (see `brush_results`). The mesh keeps its triangles. Where brushes have stretched them,
another proxy comes when the artist rests (see `renewal`), up to Blender 4.5 with the last of their
strokes. Changes of the topology bring one, too.
"""

import logging
from collections.abc import Callable
from dataclasses import replace

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from ....common.errors import SculptError
from ....worker.answers import SNAPPED
from ....worker.client import JobKind, Message
from ...scene import kept_steps, native_steps, next_proxy, sculpt_steps
from ...scene.commit import new_revision
from ...scene.mesh import native_edits, preview_attributes, proxy_mesh
from ...scene.mesh.moved_part import cut
from ...scene.mesh.preview import preview
from ...scene.properties import LOCAL, field_of, find, found, is_field, shown_as
from ...scene.sculpt_steps import Step
from ...scene.stroke_list import SCULPTED
from ...scene.undo_step import in_window
from .. import states
from ..job import Job, Request
from ..session_hooks import Arrivals
from ..worker_session import session
from . import brush_results, settling
from .brush_results import BrushResults
from .tracked_proxies import BrushStroke, TrackedProxy, is_at_work, is_brushing, proxies
from .whole_proxy import absorb_job

log = logging.getLogger(__name__)

AGAIN = 0.01
"""Seconds between two looks while a brush is at work, of some 0.01 ms each: the stroke's end is
noticed within this time."""
_BRUSH_SUFFIX = " Brush"

_left: dict[int, int] = {}
"""Marks (see `native_edits`) of proxies that are left as they are, by session_uid of the object:
undo or redo has brought them, or they could not be absorbed."""


class _State:
    brushes: bool = False
    """Whether a brush was at work when something changed last, and was not looked at since."""
    jumped: Step | None = None
    """A step of Blender's history to which redo has led, past the proxy that its strokes began
    with."""


class LiveResults(BrushResults):
    """Those of the strokes that are absorbed by themselves."""

    def take(self) -> bool:
        """Normals may be behind then."""
        taken = super().take()
        if taken and not _in_sculpt_mode():
            settling.leave_sculpt_mode()
        else:
            settling.wait_for_rest(begins=taken)
        return taken

    def may_come(self, job: Job) -> bool:
        """Whether a brush is at work, or what it did on the object of the job was not looked at
        yet. A brush stroke's own result changes nothing in the scene."""
        if job.kind is JobKind.ABSORB_STROKE:
            return False
        if is_brushing():
            return True
        ob = None if job.target is None else find(job.target)
        return ob is not None and _can_absorb(ob) and _will_look() and not is_at_work()

    def follow(self, job: Job) -> None:
        """Track the proxy at once: a brush may begin before the next look."""
        ob = None if job.target is None else find(job.target)
        if ob is not None and job.kind is not JobKind.ABSORB_STROKE and _can_absorb(ob):
            _known(ob, preview_attributes.true_positions(proxy_mesh.mesh_of(ob)))

    def come_again(self) -> None:
        """Absorb a stroke that redo has brought and that nobody knows: it was undone before any
        look, or undo has led to another proxy since, with which it was forgotten."""
        ob = bpy.context.active_object
        if ob is None or not _can_absorb(ob):
            return
        if _known(ob, preview_attributes.true_positions(proxy_mesh.mesh_of(ob))) is not None:
            _left.clear()
            look(again=True)
        else:
            _State.jumped = sculpt_steps.active()
            _look_soon()


def is_on_its_way(ob: Object) -> bool:
    """Whether all that brushes did to the proxy is being absorbed."""
    proxy = proxies.get(ob.session_uid)
    if proxy is None or any(stroke.has_failed for stroke in proxy.strokes):
        return False
    return brush_results.shows(ob, proxy)


def refuse_edits(ob: Object) -> None:
    """SculptError when brushes have changed the proxy and that is not being absorbed."""
    if not is_on_its_way(ob):
        native_edits.refuse(ob)


def let_come(ob: Object) -> bool:
    """Let the strokes of brushes come into the field, even if that cuts off what can be redone;
    whether all of them were on their way."""
    proxy = proxies.get(ob.session_uid)
    if proxy is None or not is_on_its_way(ob):
        return False
    proxy.rests = False
    session.watcher.work_came()
    return True


def look(again: bool = False) -> None:
    """Absorb what brushes have done to the active field since the last look.

    again: redo has brought it, and a step would cut off what can be redone
    """
    ob = bpy.context.active_object
    if ob is None or not _is_sculpted(ob):
        return
    target, mesh = ob.session_uid, ob.data
    assert isinstance(mesh, Mesh)
    step = sculpt_steps.active()
    kept_steps.look(step)
    if not _can_absorb(ob):  # undo may have to put back vertices that it rounds
        _known(ob, preview_attributes.true_positions(mesh))
        return
    if target in _left and _left.pop(target) == (mark := native_edits.mark(ob)):
        _left[target] = mark
        return
    now = preview_attributes.true_positions(mesh)
    proxy = _known(ob, now)
    if proxy is None:
        if native_edits.edited(ob) and not session.pending(target):
            _left[target] = native_edits.mark(ob)  # if absorbing fails, it is not tried again
            _submit(absorb_job(ob, follows=True))
        return
    strokes = proxy.strokes
    failed = next((i for i, stroke in enumerate(strokes) if stroke.has_failed), None)
    if failed is not None:  # what it did is absorbed with the next stroke, or by Absorb
        proxy.keep(failed)
        if np.array_equal(now, strokes[-1].seen):
            _left[target] = native_edits.mark(ob)
            return
    last = proxy.strokes[-1].after if proxy.strokes else proxy.told
    part = cut(last, now, proxy.corners)
    if part is None:
        if not proxy.count:
            proxy.step = step
        session.watcher.work_came()  # the hand rests
        return
    after = last.copy()
    after[part.vertices] = part.after
    stroke = BrushStroke(_name(), part, now, after, step)
    stroke.job = _job(target, proxy, stroke)
    proxy.add(stroke)
    proxy.rests = again
    if not _submit(stroke.job, again):
        proxy.keep(proxy.count - 1)
        _left[target] = native_edits.mark(ob)


def _look_one_by_one() -> None:
    """Absorb what a jump in Blender's history has brought, which has passed over the proxy that it
    began with: go back to that, and look at each stroke as it is redone."""
    end, _State.jumped = _State.jumped, None
    ob = bpy.context.active_object
    if ob is None or end != sculpt_steps.active() or not _can_absorb(ob):
        return
    target = ob.session_uid
    with preview.hidden():
        with native_steps.ours():
            for _ in native_steps.names():
                bpy.ops.ed.undo()
        ob = find(target)
        is_made = ob is not None and _known(ob, proxy_mesh.positions(ob)) is not None
        if is_made:
            _left.clear()
        while (step := sculpt_steps.active()) != end:
            with native_steps.ours():
                bpy.ops.ed.redo()
            if sculpt_steps.active() == step:
                break
            if is_made:
                look(again=True)
        if not is_made and (ob := find(target)) is not None:
            _left[target] = native_edits.mark(ob)


def leave() -> None:
    """After undo and redo: track the proxies as they are now."""
    _State.jumped = None
    kept_steps.follow()
    next_proxy.follow()
    settling.wait_for_rest()
    for target, proxy in proxies.each():
        if (ob := find(target)) is None:
            proxies.drop(target)
        else:
            brush_results.find_place(ob, proxy)
    _left.clear()
    ob = bpy.context.active_object
    if ob is None or not _is_sculpted(ob):
        return
    if native_edits.edited(ob):
        _left[ob.session_uid] = native_edits.mark(ob)
    else:
        _known(ob, preview_attributes.true_positions(proxy_mesh.mesh_of(ob)))


def forget() -> None:
    """Another file was loaded."""
    _State.brushes, _State.jumped = False, None
    proxies.forget()
    kept_steps.forget()
    _left.clear()


def _in_sculpt_mode() -> bool:
    with in_window():
        return bpy.context.mode == "SCULPT"


def _is_sculpted(ob: Object) -> bool:
    return is_field(ob) and ob.mode == "SCULPT" and not proxy_mesh.why_locked(ob)


def _can_absorb(ob: Object) -> bool:
    if not _is_sculpted(ob):
        return False
    group = field_of(ob)
    return group.live and group.solver == LOCAL and not states.is_whole(group)


def _known(ob: Object, now: NDArray[np.float32]) -> TrackedProxy | None:
    """The tracked proxy of an object, tracked from now on if it was not. None when it was changed
    already, so that nobody knows how the field had made it."""
    mesh, target = ob.data, ob.session_uid
    assert isinstance(mesh, Mesh)
    filled = mesh.get(proxy_mesh.FILLED, "")
    proxy = proxies.get(target)
    if proxy is not None and (proxy.filled, proxy.positions.shape) == (filled, now.shape):
        return proxy
    proxies.drop(target)
    if native_edits.edited(ob) or len(mesh.loops) != 3 * len(mesh.polygons):
        return None
    return proxies.track(ob, now)


def _submit(job: Job, again: bool = False) -> bool:
    """False where there is no worker."""
    try:
        (session.submit_again if again else session.submit)(job)
    except SculptError as error:
        log.warning("%s is not absorbed: %s", job.label, error)
        session.watcher.warned(error.text)
        return False
    return True


def _name() -> str:
    """What the brush of the last stroke is called."""
    return next((name.removesuffix(_BRUSH_SUFFIX) for name in native_steps.names()), SCULPTED)


def _job(target: int, proxy: TrackedProxy, stroke: BrushStroke) -> Job:
    def request() -> Request:
        ob = found(target)
        asked = states.request(ob, **shown_as(field_of(ob)), result_revision=new_revision())
        fields, held = dict(asked.fields), dict(asked.held)
        remesh = proxy_mesh.STRETCHED in proxy_mesh.mesh_of(ob)
        place = proxy.known.index(stroke)
        for earlier in proxy.known[:place]:
            if (result := earlier.result) is None:
                raise SculptError("The brush stroke before it could not be absorbed.")
            layer = result.arrays["layer"].tobytes()
            named = [*fields["state"]["layers"], [result.fields["layer"], 1.0]]
            fields["state"] = {**fields["state"], "layers": named}
            fields["revision"] = result.fields["revision"]
            held[result.fields["layer"]] = lambda layer=layer: layer
            remesh |= result.fields["stretched"]
        part = stroke.part
        arrays = {"before": part.before, "after": part.after, "triangles": part.triangles}
        keep, later = place + 1 < len(proxy.known), kept_steps.EXACT  # see `renewal`
        fields |= {"remesh": remesh and not later, "keep": keep or later}
        return replace(asked, fields=fields, held=held, arrays=arrays)

    def apply(result: Message) -> None:
        if len(result.arrays[SNAPPED[0]]) != len(stroke.part.vertices):
            raise SculptError("The worker answered with other vertices than it was asked about.")
        stroke.result = result

    return Job(JobKind.ABSORB_STROKE, stroke.name, request, apply, target=target, follows=True)


@persistent
def _note(*_: object) -> None:
    """Something has changed.

    Blender tells of a stroke's end before it draws the window, and calls timers after that. So
    where the worker has nothing else to do it gets the stroke here, without waiting for the timer.
    """
    at_work = is_at_work()
    if (session.jobs or proxies.have_strokes()) and not at_work:
        session.watcher.work_came()  # a mode may have been left in which results wait
    if bpy.context.window is None:  # while a file is saved, Blender draws a picture of it
        return
    ob = bpy.context.active_object
    if ob is None or ob.mode != "SCULPT":
        settling.leave_sculpt_mode()
        return
    if not is_field(ob):
        return
    _look_soon()
    if at_work:
        _State.brushes = True
    elif _State.brushes and session.worker.alive and not session.jobs:
        _try_to_look(look)


def expect_no_stroke() -> None:
    """Before undo and redo: the change that follows is not a stroke, even if a brush has just
    ended."""
    _State.brushes = False


def _will_look() -> bool:
    return bpy.app.timers.is_registered(look_later)


def _look_soon() -> None:
    if not _will_look():
        bpy.app.timers.register(look_later)


def look_later() -> float | None:
    if is_at_work():
        return AGAIN
    _try_to_look(look if _State.jumped is None else _look_one_by_one)
    return None


def _try_to_look(how: Callable[[], None]) -> None:
    """Look for strokes. A defect is logged, and the next stroke is looked at all the same."""
    _State.brushes = False
    try:
        how()
    except Exception:
        log.exception("brush strokes cannot be absorbed")


def register() -> None:
    """Listen to what changes."""
    session.arrivals = LiveResults()
    if not bpy.app.background:
        bpy.app.handlers.depsgraph_update_post.append(_note)


def unregister() -> None:
    """Stop listening."""
    forget()
    session.arrivals = Arrivals()
    if _note in bpy.app.handlers.depsgraph_update_post:
        bpy.app.handlers.depsgraph_update_post.remove(_note)
    settling.stop()
    if _will_look():
        bpy.app.timers.unregister(look_later)
