# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes without a result yet, as muted entries of the history: in a file that is saved meanwhile,
and in the scene when the extension is disabled.

While a file is written the scene has them, and not after that, so no step of Blender's history
holds them.
"""

from dataclasses import replace

from ..scene import chosen, stroke_list
from ..scene.properties import field_of, find
from .worker_session import session

_places: dict[int, int] = {}
"""By session_uid of the object the place of the active entry before."""
_uids: set[str] = set()
"""Of the entries that are there for a file alone."""


def add() -> None:
    """Put them into the histories, before a file is saved."""
    for job in session.jobs:
        ob = find(job.target or 0)
        if ob is None or not job.strokes or not job.pending or ob.library or ob.override_library:
            continue
        _places.setdefault(ob.session_uid, field_of(ob).active_stroke)
        entries = [replace(stroke_list.entry_of(stroke), muted=True) for stroke in job.strokes]
        _uids.update(entry.uid for entry in entries)
        stroke_list.append(ob, entries, {})


def remove() -> None:
    """Take them out again, after the file was saved or could not be."""
    for target, place in _places.items():
        if (ob := find(target)) is None:
            continue
        listed = field_of(ob).strokes
        for index in reversed(range(len(listed))):
            if listed[index].uid in _uids:
                listed.remove(index)
        field_of(ob).active_stroke = place
        chosen.forget()
    _forget()


def leave() -> None:
    """Put them into the histories for good, before the worker ends with the extension."""
    add()
    _forget()


def _forget() -> None:
    _places.clear()
    _uids.clear()
