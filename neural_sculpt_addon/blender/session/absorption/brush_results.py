# SPDX-License-Identifier: GPL-3.0-or-later
"""Absorbed brush strokes on their way into the scene: one piece of work at a time, so that Blender
answers meanwhile, however many strokes there are.

A stroke keeps the undo step of its brush where it can (see `kept_steps`), and comes in between two
strokes as soon as it has a result. Otherwise steps of ours take the place of the brushes':

    a brush's undo step is taken back; ...; the first stroke becomes an undo step of ours; ...

A single stroke does both in one piece, for to draw the window in between would take longer than
both. This begins when all strokes have their results and the artist's hand rests. Between two
pieces the proxy is *half-way*: its mesh shows all strokes, and Blender's history has fewer. Undo
and redo let the rest come in first (`finish`), and jobs on the object wait for it. What is brushed
meanwhile is one more stroke. A file that is saved half-way has the rest on its mesh alone.

A stroke that undo takes from the mesh is remembered here until undo has led to another proxy; after
that, it is absorbed anew when redo brings it (`LiveResults.come_again`). Until the next stroke or
change no step of ours is made, since it would cut off what can be redone: strokes keep their steps
then, in any Blender.
"""

import logging
import time

import bpy
import numpy as np
from bpy.types import Object
from numpy.typing import NDArray

from ....common.errors import SculptError
from ....common.text import Text
from ....worker.answers import SNAPPED, is_remade
from ....worker.client import JobKind, Message
from ...scene import kept_steps, native_steps, sculpt_steps
from ...scene.commit import add_brushed, add_entry, add_kept
from ...scene.mesh import preview_attributes, proxy_mesh
from ...scene.mesh.preview import preview
from ...scene.properties import field_of, find, found
from ...scene.sculpt_steps import BORDER, Step
from ...scene.stroke_list import Entry
from ...scene.undo_step import in_partial_mode
from .. import reports
from ..job import Job, JobStatus
from ..session_hooks import Arrivals
from ..worker_session import session
from .tracked_proxies import BrushStroke, TrackedProxy, is_at_work, proxies

log = logging.getLogger(__name__)

Vectors = NDArray[np.float32]

SEEN_OFF = 5e-4
"""Distance, model units, from which on a vertex that a brush moved is seen to be off the field: a
quarter of a pixel where the field's box is 1000 wide."""


def find_place(ob: Object, proxy: TrackedProxy) -> None:
    """After undo and redo: find out how many of the strokes the mesh has now.

    Strokes that are half-way stay on the mesh, even if Blender has brought back a state of its
    history that lacks them.
    """
    mesh = proxy_mesh.mesh_of(ob)
    if mesh.is_editmode or mesh.get(proxy_mesh.FILLED, "") != proxy.filled:
        proxy.keep(0)
        return
    now, least = proxy_mesh.positions(ob), proxy.half_way
    states = [proxy.positions, *(stroke.seen for stroke in proxy.known)]
    places = (i for i in reversed(range(least, len(states))) if kept_steps.is_back(now, states[i]))
    place = next(places, least if least and now.shape == proxy.positions.shape else None)
    if place is None:
        before, _ = sculpt_steps.steps()
        proxy.keep(sum(stroke.step in before for stroke in proxy.strokes))  # and something else
        return
    proxy.count, proxy.rests = place, True
    kept_steps.put_back(ob, states[place])


def finish(unless_undone: bool = False) -> None:
    """Bring strokes into the scene at once: those that are half-way, and those that need no step of
    ours.

    unless_undone: leave those that are half-way where something can be redone
    """
    for target, proxy in proxies.each():
        while can_keep(target, proxy):
            take(target, proxy)
        if proxy.half_way and not (unless_undone and proxy.rests):
            proxy.rests = False
            while is_ready(target, proxy):
                take(target, proxy)
    session.tell_bases()


def is_ready(target: int, proxy: TrackedProxy) -> bool:
    """Whether a piece of work can be done."""
    return can_keep(target, proxy) or can_enter(target, proxy)


def can_enter(target: int, proxy: TrackedProxy) -> bool:
    """Whether a step of ours can be made. What was brushed since must be known first."""
    if any(stroke.result is None for stroke in proxy.strokes):
        return False
    return (not proxy.rests or _change_comes(target, proxy)) and _is_free(target, proxy)


def can_keep(target: int, proxy: TrackedProxy) -> bool:
    """Whether the brush's own undo step of the first stroke can stay in Blender's history: it is
    the only step of that stroke, and those after it are brushes' as well, or hold the proxy as they
    left it, as when Sculpt Mode was left. Where Blender is not exact, no step of ours must be able
    to take its place: something can be redone, there is a step after it that stays, or Global Undo
    is off."""
    if proxy.half_way or not proxy.count:
        return False
    stroke = proxy.strokes[0]
    if stroke.result is None or not _is_free(target, proxy):
        return False
    before, _ = sculpt_steps.steps()
    if proxy_mesh.mesh_of(found(target)).users > 1 or proxy.step not in before:
        return False
    since = before[before.index(proxy.step) + 1 :]
    others = [step for step in since if not sculpt_steps.is_native(step)]
    cannot_go = proxy.rests or any(step.name != BORDER for step in others)
    cannot_go |= not bpy.context.preferences.edit.use_global_undo
    if since[:1] != [stroke.step] or not all(map(sculpt_steps.is_ordinary, others)):
        return False
    return kept_steps.EXACT or cannot_go


def _is_off(stroke: BrushStroke, result: Message) -> bool:
    """Whether brushed vertices lie so far off the field that it is seen, so that another proxy is
    to come."""
    off = np.abs(result.arrays[SNAPPED[0]] - stroke.after[stroke.part.vertices])
    return float(off.max(initial=0)) > SEEN_OFF


def _is_free(target: int, proxy: TrackedProxy) -> bool:
    ob = find(target)
    if ob is None or is_at_work() or in_partial_mode() or proxy_mesh.why_locked(ob):
        return False
    return shows(ob, proxy)


def _change_comes(target: int, proxy: TrackedProxy) -> bool:
    """Whether a job waits whose step, made on the result of these strokes, cuts off what can be
    redone anyway. While the proxy is half-way, only the strokes' own steps can be redone."""
    changes = (job for job in session.pending(target) if job.kind is not JobKind.ABSORB_STROKE)
    return any(proxy.half_way or not session.keeps_redo(job) for job in changes)


def shows(ob: Object, proxy: TrackedProxy) -> bool:
    """Whether the mesh of an object has the strokes, and nothing else was done to it."""
    mesh = proxy_mesh.mesh_of(ob)
    if not proxy.count or mesh.is_editmode or mesh.get(proxy_mesh.FILLED, "") != proxy.filled:
        return False
    return np.array_equal(preview_attributes.true_positions(mesh), proxy.strokes[-1].seen)


TAKE_SECONDS = 0.008
"""Seconds of work after which the window is drawn before more is begun. A stroke that keeps its
step costs 2 ms; otherwise to take back a step costs 4 ms and more, and to make one some 35 ms, of
which Blender itself takes 30."""


class BrushResults(Arrivals):
    """Those of the strokes on all proxies."""

    def wait(self) -> bool:
        """Whether there is a piece that `take` would bring into the scene now."""
        return any(is_ready(*each) for each in proxies.each())

    def take(self) -> bool:
        """Do a piece of work for the first proxy that has one, and more while TAKE_SECONDS are not
        over; whether there was one."""
        begun = time.perf_counter()
        taken = False
        while not taken or time.perf_counter() - begun < TAKE_SECONDS:
            ready = next((each for each in proxies.each() if is_ready(*each)), None)
            if ready is None:
                break
            take(*ready)
            taken = True
        return taken

    def hold(self, job: Job) -> bool:
        """Whether a job must wait for strokes that are on their way, for it is to be done on their
        result. A job that only reads the field takes no notice of strokes that came after it
        began."""
        target = job.reads if job.target is None and job.status is JobStatus.QUEUED else job.target
        ob, proxy = find(target or 0), proxies.get(target)
        if ob is None or proxy is None or job.kind is JobKind.ABSORB_STROKE:
            return False
        if not proxy.count or any(stroke.has_failed for stroke in proxy.strokes):
            return False
        return is_at_work() or shows(ob, proxy)


def take(target: int, proxy: TrackedProxy) -> None:
    """One piece of work."""
    seen = proxy.strokes[-1].seen
    try:
        if can_keep(target, proxy):
            keep_next(target, proxy)
        else:
            make_step(target, proxy)
    except Exception as error:  # the jobs to come must not suffer for it
        if not isinstance(error, SculptError):  # a defect
            log.exception("brush strokes cannot come into the scene")
        ob = find(target)
        if ob is not None and proxy_mesh.positions(ob).shape == seen.shape:
            proxy_mesh.put(proxy_mesh.mesh_of(ob), seen)  # as sculpted by other brushes
        proxy.keep(0)
        why = error.text if isinstance(error, SculptError) else Text("The system console says why.")
        session.watcher.warned(
            Text("Brush strokes stay on the mesh, and the field has not got them. {}", why)
        )


def make_step(target: int, proxy: TrackedProxy) -> None:
    """Take back a brush's step or, when all are, make a step of ours of the first stroke. For a
    single stroke do both."""
    proxy.keep(proxy.count)
    proxy.half_way, seen = proxy.count, proxy.strokes[-1].seen
    with preview.hidden(), session.history_grows():
        back = native_steps.take_back(lambda: proxy_mesh.mesh_of(found(target)), proxy.step)
        if not back or (proxy.count == 1 and sculpt_steps.active() == proxy.step):
            enter_next(target, proxy)
        if proxy.count:
            proxy_mesh.put(proxy_mesh.mesh_of(found(target)), seen)


def keep_next(target: int, proxy: TrackedProxy) -> None:
    """Make an entry of the first stroke whose undo step is the one that Blender's brush has
    made."""
    ob, stroke, result = found(target), proxy.strokes[0], proxy.strokes[0].result
    assert result is not None and proxy.step is not None and stroke.step is not None
    before = kept_steps.field_at(ob, proxy.step, proxy.positions)
    proxy.filled = proxy_mesh.fill_mark(stroke.seen)
    off = _is_off(stroke, result) or _is_lost(result)
    entry = add_kept(ob, Entry("", stroke.name), result, proxy.filled, off)
    layer, normals = result.arrays["layer"].tobytes(), result.arrays[SNAPPED[1]]
    after = kept_steps.grown(ob, before, entry, layer, stroke.part.vertices, normals, stroke.seen)
    kept_steps.know(ob, proxy.step, before)
    kept_steps.know(ob, stroke.step, after)
    for step, seen in _ordinary_behind(stroke.step, proxy):
        kept_steps.know(ob, step, after.with_more(seen))
    kept_steps.unsettle(ob, after)
    _rebase(target, stroke.step)
    _tell_lost(stroke.name, result)
    proxy.positions, proxy.told, proxy.step = stroke.seen, stroke.after, stroke.step
    del proxy.known[0]
    proxy.count -= 1


def _ordinary_behind(step: Step, proxy: TrackedProxy) -> list[tuple[Step, Vectors]]:
    """The ordinary steps after a stroke's own, and those that redo would bring, for all were made
    before the field had it; and the vertices (V, 3) that each of them holds."""
    before, after = sculpt_steps.steps()
    every, seen = [*before, *after], {stroke.step: stroke.seen for stroke in proxy.known}
    last, behind = seen[step], []
    for each in every[every.index(step) + 1 :]:
        last = seen.get(each, last)
        if sculpt_steps.is_ordinary(each):
            behind.append((each, last))
    return behind


def _rebase(target: int, step: Step) -> None:
    """Let the jobs on an object begin again from its new state. Brush strokes that the worker has
    already were asked for on that state, and go on."""
    session.forget_bases(target, step)
    for job in session.pending(target):
        if job.kind is JobKind.ABSORB_STROKE and job.base:
            job.base = field_of(found(target)).revision


def enter_next(target: int, proxy: TrackedProxy) -> None:
    """Make an undo step of ours of the first stroke. Only the last stroke may bring another
    proxy."""
    stroke, result = proxy.strokes[0], proxy.strokes[0].result
    assert result is not None
    entry, now = Entry("", stroke.name), proxy.positions.copy()
    now[stroke.part.vertices] = result.arrays[SNAPPED[0]]
    if sculpt_steps.active() == proxy.step:  # a border may be made, which holds the scene as it is
        proxy_mesh.put(proxy_mesh.mesh_of(found(target)), proxy.positions)
    if proxy.count == 1 and is_remade(result.arrays):
        add_entry(found(target), entry, result, stroke.name)
    else:
        add_brushed(found(target), entry, result, stroke.part.vertices, now)
    session.forget_bases(target)
    _tell_lost(stroke.name, result)
    if proxy.count == 1:
        proxy.keep(0)
        proxy_mesh.mesh_of(found(target)).update()
        # at once, for the next stroke may come before anything is looked at again
        proxies.track(found(target), proxy_mesh.positions(found(target)))
        return
    proxy.positions = proxy.told = now
    proxy.step = sculpt_steps.active()
    proxy.filled = proxy_mesh.mesh_of(found(target))[proxy_mesh.FILLED]
    del proxy.known[0]
    proxy.count, proxy.half_way = proxy.count - 1, proxy.half_way - 1


def _is_lost(result: Message) -> bool:
    """Whether the field has not got all of a stroke, which its report tells in sentences."""
    return bool(reports.notes_of(result.fields["report"]))


def _tell_lost(name: str, result: Message) -> None:
    """Tell the artist when that is so."""
    if _is_lost(result):
        session.watcher.warned(
            Text(
                "The field cannot hold all of {}: it folds over itself, or is finer than the finest"
                " level. The proxy shows what the field holds when you rest.",
                name,
            )
        )
