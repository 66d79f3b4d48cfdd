# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracked proxies: what brushes of Sculpt Mode did to each proxy since its field was told of it."""

from dataclasses import dataclass, field

import bpy
import numpy as np
from bpy.app.translations import pgettext_n as n_
from bpy.types import Object
from numpy.typing import NDArray

from ....worker.client import Message
from ...scene import sculpt_steps
from ...scene.mesh import proxy_mesh
from ...scene.mesh.moved_part import MovedPart
from ...scene.sculpt_steps import Step
from ..job import Job, JobStatus
from ..worker_session import session

Vectors = NDArray[np.float32]

UNDONE = n_("Absorbing was cancelled: its stroke was undone.")
REPLACED = n_("Absorbing was cancelled: the proxy is another one.")
_BRUSH_OPERATORS = (
    *("SCULPT_OT_", "TRANSFORM_OT_", "PAINT_OT_", "SCULPT_CURVES_OT_"),
    *("GREASE_PENCIL_OT_", "GPENCIL_OT_"),
)
_AT_WORK = (*_BRUSH_OPERATORS, "NEURAL_SCULPT_OT_draw")


@dataclass(eq=False)
class BrushStroke:
    """A brush stroke that is on its way into the field.

    seen:  all vertices (V, 3) after it
    after: the same, without what moved too little
    step:  of Blender's history that it left
    """

    name: str
    part: MovedPart
    seen: Vectors
    after: Vectors
    step: Step | None
    job: Job | None = None
    result: Message | None = None

    @property
    def has_failed(self) -> bool:
        """Whether it could not be absorbed, or was cancelled."""
        ends = JobStatus.FAILED, JobStatus.CANCELLED
        return self.job is not None and self.job.status in ends


@dataclass(eq=False)
class TrackedProxy:
    """A proxy as the field made it, and what brushes did since.

    filled:    its fingerprint
    positions: (V, 3)
    told:      the same, without what moved too little for the field to be told of it
    corners:   (3, F), see `moved_part.cut`
    step:      of Blender's history at which it was so
    known:     the strokes, in order, and those that undo took from the mesh
    count:     how many of them the mesh has
    half_way:  how many of them the mesh has alone, and not Blender's history as well
    rests:     whether undo or redo has led here: a step would cut off what can be redone
    """

    filled: str
    positions: Vectors
    told: Vectors
    corners: NDArray[np.int32]
    step: Step | None
    known: list[BrushStroke] = field(default_factory=list)
    count: int = 0
    half_way: int = 0
    rests: bool = False

    @property
    def strokes(self) -> list[BrushStroke]:
        """Those that the mesh has."""
        return self.known[: self.count]

    def add(self, stroke: BrushStroke) -> None:
        """One more, instead of what could be redone."""
        self.keep(self.count)
        self.known.append(stroke)
        self.count += 1

    def keep(self, count: int, why: str = UNDONE) -> None:
        """Forget all strokes but the first ones."""
        dropped = self.known[count:]
        del self.known[count:]
        self.count, self.half_way = min(self.count, count), min(self.half_way, count)
        for stroke in dropped:
            if stroke.job is not None and stroke.job.pending:
                session.cancel_job(stroke.job, why)


class TrackedProxies:
    """The tracked proxies of all fields, by session_uid of the object."""

    def __init__(self) -> None:
        """None is tracked yet."""
        self._proxies: dict[int, TrackedProxy] = {}

    def get(self, target: int | None) -> TrackedProxy | None:
        """The proxy of an object; None where none is tracked."""
        return None if target is None else self._proxies.get(target)

    def each(self) -> list[tuple[int, TrackedProxy]]:
        """All that are tracked now, with the session_uids of their objects."""
        return [*self._proxies.items()]

    def have_strokes(self) -> bool:
        """Whether strokes of any of them are on their way into the field."""
        return any(proxy.count for proxy in self._proxies.values())

    def track(
        self, ob: Object, positions: Vectors, corners: NDArray[np.int32] | None = None
    ) -> TrackedProxy:
        """From now on track what brushes do to a proxy of triangles, whose vertices are these
        (V, 3), as the field made them.

        corners: (3, F), where they are known; otherwise they are read
        """
        mesh = proxy_mesh.mesh_of(ob)
        if corners is None:
            corners = np.ascontiguousarray(proxy_mesh.corners_of(mesh).T)
        filled, step = mesh.get(proxy_mesh.FILLED, ""), sculpt_steps.active()
        proxy = TrackedProxy(filled, positions, positions, corners, step)
        self._proxies[ob.session_uid] = proxy
        return proxy

    def drop(self, target: int) -> None:
        """Track the proxy of an object no more, for it is another one; its jobs are cancelled."""
        if (proxy := self._proxies.pop(target, None)) is not None:
            proxy.keep(0, REPLACED)

    def forget(self) -> None:
        """Track none, for another file was loaded, with which all jobs end."""
        self._proxies.clear()


proxies = TrackedProxies()
"""The only ones."""


def is_at_work() -> bool:
    """Whether a brush, or something else that moves what it began with, is being used. A step of
    ours in the midst of it would hold it half done, and Blender crashes when a brush of Sculpt Mode
    goes on after that."""
    return _runs(_AT_WORK)


def is_brushing() -> bool:
    """The same, but for a neural stroke."""
    return _runs(_BRUSH_OPERATORS)


def _runs(names: tuple[str, ...]) -> bool:
    windows = bpy.context.window_manager.windows
    return any(op.bl_idname.startswith(names) for w in windows for op in w.modal_operators)
