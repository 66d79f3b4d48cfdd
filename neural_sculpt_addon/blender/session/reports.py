# SPDX-License-Identifier: GPL-3.0-or-later
"""Reports, which tell how good fields are, by revision.

A report of a fit or of absorbed sculpting comes with its result. That of a stroke is measured after
its result is shown, when nothing else waits, and so is no part of the undo step. It is kept here by
its revision, and on the object while that is at this revision.
"""

import json
from collections import OrderedDict
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, TypeGuard

import bpy
from bpy.types import Object

from ...common.text import Text, from_json
from ...worker.client import JobKind, Message
from ..scene.properties import field_of, is_field
from .job import Job, Request
from .worker_session import session

DIGITS = 16  # from which on a number counts nothing
MOST_PLACES = 16  # worst ones that are shown
REMEMBERED = 1024
"""Reports, some 1 kB each."""

Place = tuple[float, float, float]

_known: OrderedDict[str, str] = OrderedDict()
"""Reports as JSON, by revision; empty where a stroke has not been measured yet."""


def report_of(ob: Object) -> dict[str, Any]:
    """The report of the field as it is; empty when there is none, or none that can be read."""
    try:
        report = json.loads(field_of(ob).report or "{}", parse_int=_integer)
        json.dumps(report, allow_nan=False)  # a .blend can hold NaN, which nothing can show
    except (ValueError, RecursionError):
        return {}
    return report if isinstance(report, dict) else {}


def _integer(text: str) -> float:
    """A number of JSON without a point; infinite when no float holds it, as panels need."""
    return int(text) if len(text) < DIGITS else float(text)


def worst_places(report: dict[str, Any]) -> list[Place]:
    """Where the normals of the untouched surface have turned most, or the mesh that the field was
    fitted to is farthest off, the worst first; model space. Empty when nowhere, or not measured."""
    most, place = report.get("untouched_normal_max"), report.get("untouched_worst")
    places = [place] if isinstance(most, int | float) and most > 0 else report.get("worst")
    if not isinstance(places, list):
        return []
    return [(float(x[0]), float(x[1]), float(x[2])) for x in places[:MOST_PLACES] if _is_place(x)]


def notes_of(report: Mapping[str, Any]) -> list[Text]:
    """What a fit says of its mesh, in sentences."""
    notes = report.get("notes")
    told = []
    for note in notes if isinstance(notes, list) else ():
        with suppress(ValueError):  # in a .blend can be anything
            told.append(from_json(note))
    return told


def _is_place(value: object) -> TypeGuard[list[float]]:
    return (
        isinstance(value, list)
        and len(value) == 3
        and all(isinstance(x, int | float) for x in value)
    )


def is_measured_now(ob: Object) -> bool:
    """Whether the report is on its way."""
    job = session.behind
    return job is not None and job.base == field_of(ob).revision


def measure(ob: Object) -> None:
    """Have the last stroke measured, when nothing else waits."""
    revision = field_of(ob).revision
    _known.setdefault(revision, "")
    while len(_known) > REMEMBERED:
        _known.popitem(last=False)
    if _known[revision]:
        return

    def keep(result: Message) -> None:
        _known[revision] = json.dumps(result.fields["report"])
        follow()
        session.watcher.changed()

    request = Request({"revision": revision})
    job = Job(JobKind.MEASURE, "Measuring", lambda: request, keep, ob.session_uid, base=revision)
    session.submit_behind(job)


def follow() -> None:
    """Show on each field the report of its revision: after undo, redo, and when one has come."""
    for ob in bpy.data.objects:
        known = _known.get(field_of(ob).revision) if is_field(ob) else None
        if known and field_of(ob).report != known and ob.library is None:
            field_of(ob).report = known


def measure_again(ob: Object) -> None:
    """Have the revision of the field measured if that was cancelled before."""
    if _known.get(field_of(ob).revision) == "":
        measure(ob)


def measure_at_rest() -> None:
    """Have the active field measured if something else came first and is over now."""
    ob = bpy.context.active_object
    if ob is not None and not session.jobs and session.behind is None:
        measure_again(ob)
