# SPDX-License-Identifier: GPL-3.0-or-later
"""The jobs of a stroke: what is prepared while it is drawn, and the edit itself. Model space."""

import numpy as np
from bpy.types import Object

from ..stroke.stroke import Stroke
from ..worker.client import JobKind, Message
from . import native_edits
from .commit import add_strokes, keep_strokes, new_revision
from .job import Job, Request, found
from .properties import field_of
from .stroke_list import state_after
from .worker_session import session

SOLVER = "gauss_newton"


def prepare_job(ob: Object) -> Job:
    """The job that, while the artist draws, prepares what only the unedited field determines."""
    group = field_of(ob)
    request: Request = (
        {"revision": group.revision},
        {"field": np.frombuffer(group.weights, np.uint8)},
    )
    return Job(JobKind.PREPARE, "Preparing", lambda: request, lambda _: None)


def edit_job(ob: Object, strokes: tuple[Stroke, ...]) -> Job:
    """The job that applies strokes to whatever the object's field is when its turn comes."""
    target = ob.session_uid
    label = strokes[0].name or "Neural Stroke"

    def request() -> Request:
        ob = found(target)
        group = field_of(ob)
        fields = {
            "strokes": [stroke.to_json() for stroke in strokes],
            "solver": SOLVER,
            "resolution": group.resolution,
            "revision": group.revision,
            "result_revision": new_revision(),
            "result_state": state_after(ob, SOLVER, strokes),
        }
        if not session.waits:
            fields["quick_revision"] = new_revision()
        return fields, {"field": np.frombuffer(group.weights, np.uint8)}

    def apply(result: Message) -> None:
        native_edits.refuse(found(target))
        add_strokes(found(target), strokes, result, label)

    def keep() -> None:
        keep_strokes(found(target), strokes, label)

    return Job(JobKind.EDIT, label, request, apply, target=target, strokes=strokes, keep=keep)
