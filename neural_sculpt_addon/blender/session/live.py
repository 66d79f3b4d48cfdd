# SPDX-License-Identifier: GPL-3.0-or-later
"""Live absorption: what a brush of Sculpt Mode did to a proxy goes into its field by itself.

    a stroke ends -> what it moved is cut out -> one job -> a layer, an entry and one undo step

Blender tells of every change in Sculpt Mode (depsgraph_update_post), so the mesh is compared with
what it was when no brush is at work. Strokes in quick succession are absorbed one by one, each on
the result of the one before, and reach the scene when the artist's hand rests: the brushes' own
undo steps are taken back, and each stroke becomes one of ours (see native_steps). The mesh keeps
its triangles, and its vertices move onto the field. Where a brush has stretched them, and after
changes of the topology, the proxy is made anew.

After undo or redo nothing is absorbed before the next stroke, since a new step would cut off what
can be redone.
"""

import logging
from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_n as n_
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...worker.answers import SNAPPED
from ...worker.client import JobKind, Message
from .. import notice
from ..scene import native_steps
from ..scene.commit import add_brushed, add_entry, new_revision
from ..scene.mesh import native_edits, preview, proxy_mesh
from ..scene.mesh.brushed import Part, cut
from ..scene.objects import find, found
from ..scene.properties import LOCAL, field_of, is_field, shown_as
from ..scene.stroke_list import SCULPTED, Entry
from . import states
from .absorb_job import absorb_job
from .job import Job, JobStatus, Request
from .worker_session import session

log = logging.getLogger(__name__)

LOST = 3e-4
"""Mean distance, model units, from which on the artist is told that a stroke was too fine."""

ROUNDING = 1e-7
"""What vertices may be off, model units, where Blender up to 4.5 takes back its brushes."""

AGAIN = 0.01
"""Seconds between two looks while a brush is at work, some 0.01 ms each: its end is noticed no
later."""
_AT_WORK = ("SCULPT_OT_", "TRANSFORM_OT_", "NEURAL_SCULPT_OT_draw")
_SUFFIX = " Brush"


@dataclass(eq=False)
class _Stroke:
    """A brush stroke that is on its way into the field.

    seen:  all vertices (V, 3) after it
    after: the same, without what moved too little
    """

    name: str
    part: Part
    seen: NDArray[np.float32]
    after: NDArray[np.float32]
    job: Job | None = None
    result: Message | None = None


@dataclass(eq=False)
class _Proxy:
    """A proxy as the field made it.

    filled:    its fingerprint
    positions: (V, 3)
    corners:   (3, F), see `brushed.cut`
    strokes:   what brushes did since, in order
    """

    filled: str
    positions: NDArray[np.float32]
    corners: NDArray[np.int32]
    strokes: list[_Stroke] = field(default_factory=list)

    @property
    def has_failed(self) -> bool:
        """Whether one of them could not be absorbed, or was cancelled, and so none after it."""
        ends = JobStatus.FAILED, JobStatus.CANCELLED
        return any(s.job is not None and s.job.status in ends for s in self.strokes)


_proxies: dict[int, _Proxy] = {}
"""By session_uid of the object."""
_left: dict[int, int] = {}
"""Marks of proxies that undo or redo has brought, and which stay as they are."""


def is_on_its_way(ob: Object) -> bool:
    """Whether all that brushes did to the proxy is being absorbed."""
    proxy = _proxies.get(ob.session_uid)
    if proxy is None or not proxy.strokes or proxy.has_failed:
        return False
    now = preview.true_positions(proxy_mesh.mesh_of(ob))
    return np.array_equal(now, proxy.strokes[-1].seen)


def refuse_edits(ob: Object) -> None:
    """SculptError when brushes did what the field does not know of, nor soon will."""
    if not is_on_its_way(ob):
        native_edits.refuse(ob)


def look() -> None:
    """Absorb what brushes have done to the active field since the last look."""
    ob = bpy.context.active_object
    if ob is None or not _can_absorb(ob):
        return
    target, mesh = ob.session_uid, ob.data
    assert isinstance(mesh, Mesh)
    if target in _left and _left.pop(target) == (mark := native_edits.mark(ob)):
        _left[target] = mark
        return
    now = preview.true_positions(mesh)
    proxy = _known(ob, now)
    if proxy is None:
        if native_edits.edited(ob) and not session.pending(target):
            _left[target] = native_edits.mark(ob)  # if it cannot be, once is enough
            _submit(absorb_job(ob, follows=True))
        return
    if proxy.has_failed:  # what is there is absorbed with the next stroke, or by Absorb
        proxy.strokes.clear()
        _left[target] = native_edits.mark(ob)
        return
    last = proxy.strokes[-1].after if proxy.strokes else proxy.positions
    part = cut(last, now, proxy.corners)
    if part is None:
        _finish(target)
        return
    after = last.copy()
    after[part.vertices] = part.after
    stroke = _Stroke(_name(), part, now, after)
    stroke.job = _job(target, proxy, stroke)
    proxy.strokes.append(stroke)
    if not _submit(stroke.job):
        proxy.strokes.clear()
        _left[target] = native_edits.mark(ob)


def leave() -> None:
    """After undo and redo: drop what is on its way, and let the proxies be as they are now."""
    for proxy in _proxies.values():
        _cancel(proxy, n_("Absorbing was cancelled: its stroke was undone."))
    _left.clear()
    ob = bpy.context.active_object
    if ob is None or not _can_absorb(ob):
        return
    if (known := _proxies.get(ob.session_uid)) is not None:
        _without_rounding(ob, known)
    if native_edits.edited(ob):
        _left[ob.session_uid] = native_edits.mark(ob)
    else:
        _known(ob, preview.true_positions(proxy_mesh.mesh_of(ob)))


def forget() -> None:
    """Before another file is loaded."""
    _proxies.clear()
    _left.clear()


def _can_absorb(ob: Object) -> bool:
    if not is_field(ob) or ob.mode != "SCULPT" or proxy_mesh.why_locked(ob):
        return False
    group = field_of(ob)
    return group.live and group.solver == LOCAL and not states.is_whole(group)


def _known(ob: Object, now: NDArray[np.float32]) -> _Proxy | None:
    """The proxy as the field made it; None when that cannot be told, for it was changed."""
    mesh, target = ob.data, ob.session_uid
    assert isinstance(mesh, Mesh)
    filled = mesh.get(proxy_mesh.FILLED, "")
    proxy = _proxies.get(target)
    if proxy is not None and (proxy.filled, proxy.positions.shape) == (filled, now.shape):
        return proxy
    _drop(target, n_("Absorbing was cancelled: the proxy is another one."))
    if native_edits.edited(ob) or len(mesh.loops) != 3 * len(mesh.polygons):
        return None
    corners = np.ascontiguousarray(proxy_mesh.corners_of(mesh).T)
    _proxies[target] = _Proxy(filled, now, corners)
    return _proxies[target]


def _is_back(now: NDArray[np.float32], proxy: _Proxy) -> bool:
    """Whether vertices (V, 3) are those that the field made, but for ROUNDING."""
    made = proxy.positions
    return now.shape == made.shape and float(np.abs(now - made).max(initial=0)) <= ROUNDING


def _without_rounding(ob: Object, proxy: _Proxy) -> None:
    """Give a mesh that is back the vertices that the field made, to the bit."""
    if _is_back(proxy_mesh.positions(ob), proxy):
        proxy_mesh.put(proxy_mesh.mesh_of(ob), proxy.positions)


def _drop(target: int, why: str) -> None:
    if (proxy := _proxies.pop(target, None)) is not None:
        _cancel(proxy, why)


def _cancel(proxy: _Proxy, why: str) -> None:
    """Forget what is on its way."""
    strokes = [*proxy.strokes]
    proxy.strokes.clear()
    for stroke in strokes:
        if stroke.job is not None and stroke.job.pending:
            session.cancel_job(stroke.job, why)


def _submit(job: Job) -> bool:
    """False where there is no worker."""
    try:
        session.submit(job)
    except SculptError as error:
        log.warning("%s is not absorbed: %s", job.label, error)
        notice.tell(str(error))
        return False
    return True


def _name() -> str:
    """What the brush of the last stroke is called."""
    return next((name.removesuffix(_SUFFIX) for name in native_steps.names()), SCULPTED)


def _job(target: int, proxy: _Proxy, stroke: _Stroke) -> Job:
    def request() -> Request:
        ob = found(target)
        asked = states.request(ob, **shown_as(field_of(ob)), result_revision=new_revision())
        fields, held, remesh = dict(asked.fields), dict(asked.held), False
        for earlier in proxy.strokes[: proxy.strokes.index(stroke)]:
            if (result := earlier.result) is None:
                raise SculptError("The brush stroke before it could not be absorbed.")
            layer = result.arrays["layer"].tobytes()
            named = [*fields["state"]["layers"], [result.fields["layer"], 1.0]]
            fields["state"] = {**fields["state"], "layers": named}
            fields["revision"] = result.fields["revision"]
            held[result.fields["layer"]] = lambda layer=layer: layer
            remesh |= SNAPPED[0] not in result.arrays
        part = stroke.part
        arrays = {"before": part.before, "after": part.after, "triangles": part.triangles}
        return replace(asked, fields={**fields, "remesh": remesh}, held=held, arrays=arrays)

    def apply(result: Message) -> None:
        snapped = result.arrays.get(SNAPPED[0])
        if snapped is not None and len(snapped) != len(stroke.part.vertices):
            raise SculptError("The worker answered with other vertices than it was asked about.")
        stroke.result = result
        _finish(target)

    return Job(JobKind.BRUSHED, stroke.name, request, apply, target=target, follows=True)


def _finish(target: int) -> None:
    """Let the scene have what was absorbed, when all of it was and the artist's hand rests."""
    ob, proxy = find(target), _proxies.get(target)
    if ob is None or proxy is None or not proxy.strokes or is_at_work():
        return
    strokes = proxy.strokes
    if any(stroke.result is None for stroke in strokes):
        return

    def positions() -> NDArray[np.float32]:
        return proxy_mesh.positions(found(target))

    preview.hide()
    if not np.array_equal(positions(), strokes[-1].seen):
        return  # more was done, which the next look will find
    proxy_mesh.refuse_locked(ob)
    shapes = _positions(proxy)
    with session.history_grows():
        native_steps.take_back(
            lambda: proxy_mesh.mesh_of(found(target)),
            lambda: _is_back(positions(), proxy),
        )
        _without_rounding(found(target), proxy)
        del _proxies[target]
        for stroke, now in zip(strokes, shapes, strict=True):
            assert stroke.result is not None
            _commit(found(target), stroke, stroke.result, now)
    proxy_mesh.mesh_of(found(target)).update()
    _known(found(target), positions())  # for the next stroke, which may come at once


def _positions(proxy: _Proxy) -> list[NDArray[np.float32] | None]:
    """The vertices (V, 3) after each stroke, ahead of any change; None where the proxy is made
    anew."""
    found, now = [], proxy.positions
    for stroke in proxy.strokes:
        assert stroke.result is not None
        snapped = stroke.result.arrays.get(SNAPPED[0])
        if snapped is not None:
            now = now.copy()
            now[stroke.part.vertices] = snapped
        found.append(None if snapped is None else now)
    return found


def _commit(
    ob: Object, stroke: _Stroke, result: Message, positions: NDArray[np.float32] | None
) -> None:
    """One stroke into the scene, after which the proxy has these vertices (V, 3)."""
    entry = Entry("", stroke.name)
    if positions is None:
        add_entry(ob, entry, result, stroke.name)
        return
    add_brushed(ob, entry, result, stroke.part.vertices, positions)
    if result.fields["report"].get("error_mean", 0.0) > LOST:
        notice.tell(
            f"The field cannot hold all of {stroke.name}: details finer than its finest level were"
            " left out. The proxy shows what it holds."
        )


def is_at_work() -> bool:
    """Whether a brush, or something else that moves vertices, is being used."""
    windows = bpy.context.window_manager.windows
    return any(op.bl_idname.startswith(_AT_WORK) for w in windows for op in w.modal_operators)


@persistent
def _note(*_: object) -> None:
    """Something has changed."""
    ob = bpy.context.active_object
    if ob is None or ob.mode != "SCULPT" or not is_field(ob):
        return
    if not bpy.app.timers.is_registered(_look_later):
        bpy.app.timers.register(_look_later)


def _look_later() -> float | None:
    if is_at_work():
        return AGAIN
    try:
        look()
    except Exception:
        log.exception("brush strokes cannot be absorbed")
    return None


def register() -> None:
    """Listen to what changes."""
    if not bpy.app.background:
        bpy.app.handlers.depsgraph_update_post.append(_note)


def unregister() -> None:
    """Stop listening."""
    forget()
    if _note in bpy.app.handlers.depsgraph_update_post:
        bpy.app.handlers.depsgraph_update_post.remove(_note)
    if bpy.app.timers.is_registered(_look_later):
        bpy.app.timers.unregister(_look_later)
