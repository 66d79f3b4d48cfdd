# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a field's history. The list and the field that follows from it change together, or not
at all.

A change is a function from the old list to the new one. One that leaves the unmuted strokes as they
are is made at once. For all others the worker adds up the layers, and solves strokes again that now
lie on other layers than before. A change that is asked for while others wait or run is made on
their result, as an undo step of its own.
"""

from collections.abc import Callable, Sequence

from bpy.types import Object

from ...worker.client import JobKind, Message
from ..scene import stroke_list
from ..scene.commit import new_revision, set_history
from ..scene.mesh import native_edits
from ..scene.properties import found
from ..scene.stroke_list import Entry
from . import states
from .absorption import live
from .job import Job, Request
from .worker_session import session

Change = Callable[[Sequence[Entry]], Sequence[Entry]]


def change_history(ob: Object, label: str, change: Change) -> Job | None:
    """Change the history of `ob`; the job to launch, None when there is nothing to compute.

    label: of the undo step

    SculptError when the change cannot be made.
    """
    target = ob.session_uid
    pending = session.pending(target) or session.arrivals.wait()
    listed = stroke_list.entries(ob)
    wanted = change(listed)
    if not pending and stroke_list.heard(wanted) == stroke_list.heard(listed):
        if wanted != listed:
            set_history(ob, wanted, label)
        return None
    live.refuse_edits(ob)

    def changed() -> Sequence[Entry]:
        return change(stroke_list.entries(found(target)))

    def request() -> Request:
        return states.replay_request(found(target), changed(), new_revision())

    def apply(result: Message) -> None:
        native_edits.refuse(found(target))
        if (listed := changed()) != stroke_list.entries(found(target)):
            set_history(found(target), listed, label, result)

    return Job(JobKind.REPLAY, label, request, apply, target=target)
