# SPDX-License-Identifier: GPL-3.0-or-later
"""The jobs of a stroke: what is prepared while it is drawn, and the edit itself. Model space."""

from bpy.types import Object

from ...common.errors import SculptError
from ...stroke.stroke import Stroke
from ...worker.client import JobKind, Message
from ..scene import stroke_list
from ..scene.commit import add_entry, keep_entries, new_revision, set_history
from ..scene.mesh import native_edits
from ..scene.properties import field_of, find, found, shown_as
from . import reports, states
from .job import Job, Request


def prepare_job(ob: Object) -> Job:
    """The job that, while the artist draws, prepares what only the unedited field determines."""
    target = ob.session_uid

    def request() -> Request:
        if (ob := find(target)) is None:
            raise SculptError("Preparing was dropped: the object is gone.")
        return states.request(ob, **shown_as(field_of(ob)))

    return Job(JobKind.PREPARE, "Preparing", request, lambda _: None)


def edit_job(ob: Object, strokes: tuple[Stroke, ...]) -> Job:
    """The job that applies strokes, `protected` ones, to whatever the object's field is when its
    turn comes.

    One stroke is an edit of the field as it is; several, and the first on a file that is older than
    layers, are a replay of a longer history.
    """
    target = ob.session_uid
    first = strokes[0]
    label = first.name or "Neural Stroke"
    added = [stroke_list.entry_of(stroke) for stroke in strokes]

    def longer() -> list[stroke_list.Entry]:
        return [*stroke_list.entries(found(target)), *added]

    def request() -> Request:
        ob = found(target)
        group = field_of(ob)
        if len(strokes) > 1 or not states.is_simple(group):
            return states.replay_request(ob, longer(), new_revision())
        return states.request(
            ob,
            JobKind.EDIT,
            stroke=first.to_json(),
            solver=states.solver(group),
            **shown_as(group),
            result_revision=new_revision(),
        )

    def apply(result: Message) -> None:
        ob = found(target)
        native_edits.refuse(ob)
        if job.kind is JobKind.EDIT:
            add_entry(ob, added[0], result, label)
            reports.measure(ob)
        else:
            set_history(ob, longer(), label, result)

    def keep() -> None:
        keep_entries(found(target), added, label)

    job = Job(JobKind.EDIT, label, request, apply, target=target, strokes=strokes, keep=keep)
    return job
