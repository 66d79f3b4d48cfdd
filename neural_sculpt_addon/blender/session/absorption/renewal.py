# SPDX-License-Identifier: GPL-3.0-or-later
"""Renewal: the field's own proxy in place of one that brushes have stretched or folded, or that
lies off the field, because a stroke that kept its step has left the mesh as it was brushed.

    the artist rests, or has left Sculpt Mode -> a job behind all others -> one step

In Sculpt Mode Blender takes some 15 ms at 100,000 vertices for another mesh, and as long for the
border ahead of it, so renewal never comes between two strokes in a row. All else is done ahead, in
pieces (see `next_proxy`). The step changes no field, and undo and redo pass over it (see
`sculpt_steps`). It is not made where it would cut off what can be redone.
"""

import logging

import bpy
import numpy as np
from bpy.app.translations import pgettext_n as n_
from bpy.types import Object
from numpy.typing import NDArray

from ....worker.client import JobKind, Message
from ...scene import next_proxy, sculpt_steps
from ...scene.commit import renew_proxy
from ...scene.mesh import native_edits, proxy_mesh
from ...scene.properties import field_of, found, is_field, shown_as
from ...scene.undo_step import begin_border, in_partial_mode, in_window
from .. import states
from ..job import Job, Request
from ..worker_session import session
from .tracked_proxies import proxies

log = logging.getLogger(__name__)

LABEL = n_("Remesh Proxy")
LOOKS = 0.05
"""Seconds between two looks whether the answer is there."""
WORKS = 0.01
"""Seconds between two pieces of the work at the new proxy."""


class _State:
    job: Job | None = None
    asked: tuple[int, str] = (0, "")
    """session_uid of the object that it is about, and revision of the field."""
    result: Message | None = None
    corners: NDArray[np.int32] | None = None
    """Of the triangles of its proxy, as `proxies` tracks them."""
    failed: tuple[int, str] = (0, "")
    """The object and revision for which the worker made no proxy."""


def is_due() -> bool:
    """Whether the active field is to get another proxy as soon as the artist rests."""
    with in_window():
        ob = bpy.context.active_object
    if not is_field(ob) or proxy_mesh.STRETCHED not in (mesh := proxy_mesh.mesh_of(ob)):
        return False
    if mesh.users > 1 or in_partial_mode() or proxy_mesh.why_locked(ob):
        return False
    return (
        (ob.session_uid, field_of(ob).revision) != _State.failed
        and not sculpt_steps.steps()[1]
        and not native_edits.edited(ob)
    )


def go_on() -> float | None:
    """Do a piece of the work; the seconds until the next one, None when there is none."""
    if not is_due() or not session.worker.alive:
        _forget()
        return None
    with in_window():
        ob = bpy.context.active_object
    assert ob is not None
    windows = bpy.context.window_manager.windows
    if not session.rests or any(len(window.modal_operators) for window in windows):
        return LOOKS
    if _State.job is None or _State.asked != (ob.session_uid, field_of(ob).revision):
        _ask(ob)
        return LOOKS
    if _State.result is None:
        if session.behind is not _State.job:  # something else came first
            _forget()
        return LOOKS
    return _bring(ob, _State.result)


def _ask(ob: Object) -> None:
    """Ask for the proxy, when nothing else waits behind all jobs."""
    if session.behind is None:
        _forget()
        _State.job = _job(ob)
        _State.asked = ob.session_uid, field_of(ob).revision
        session.submit_behind(_State.job)


def _bring(ob: Object, result: Message) -> float | None:
    """Bring the proxy into the scene: a border, where one is needed; the mesh, piece by piece; then
    one step."""
    with session.history_grows():
        if begin_border():
            return WORKS
    if next_proxy.prepare(ob, result, field_of(ob).smooth):
        return WORKS
    if _State.corners is None:
        _State.corners = np.ascontiguousarray(result.arrays["triangles"].T, np.int32)
        return WORKS
    with session.history_grows():
        renew_proxy(ob, result)
    if ob.mode == "SCULPT":  # at once: a brush may begin before anything is looked at again
        proxies.drop(ob.session_uid)
        vertices = np.ascontiguousarray(result.arrays["vertices"], np.float32)
        proxies.track(ob, vertices, _State.corners)
    _forget()
    return None


def _job(ob: Object) -> Job:
    target = ob.session_uid

    def request() -> Request:
        ob = found(target)
        return states.request(ob, **shown_as(field_of(ob)), updated=True)

    def apply(result: Message) -> None:
        _State.result = result

    def fail(why: str) -> None:
        log.warning("%s is not renewed: %s", found(target).name, why)
        _State.failed = _State.asked

    return Job(JobKind.MESH, LABEL, request, apply, target=target, told_why=fail)


def _forget() -> None:
    if _State.result is not None:
        next_proxy.forget()
    _State.job = _State.result = _State.corners = None
