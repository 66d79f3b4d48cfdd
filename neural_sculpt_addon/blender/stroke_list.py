# SPDX-License-Identifier: GPL-3.0-or-later
"""The strokes of a field, in the order in which they were applied to its base weights.

They are kept on the object, one item each, and are read and written here as plain values. The
weights of the object are always what its unmuted strokes made of the base weights. Model space.
"""

import hashlib
import json
import uuid
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from bpy.types import Object

from ..stroke.errors import SculptError
from ..stroke.stroke import Stroke
from .properties import NEURAL_SCULPT_PG_listed_stroke, field_of


@dataclass(frozen=True)
class Entry:
    """A stroke in the list. `uid` tells it from an equal one, wherever it is moved."""

    stroke: Stroke
    muted: bool = False
    uid: str = field(default_factory=lambda: uuid.uuid4().hex)


def entries(ob: Object) -> list[Entry]:
    """All strokes of a field. SculptError when an item holds none, which no tool of ours wrote."""
    return [_entry(item) for item in field_of(ob).strokes]


def readable(ob: Object) -> list[Entry]:
    """The strokes of a field but those that are damaged."""
    found = []
    for item in field_of(ob).strokes:
        with suppress(SculptError):
            found.append(_entry(item))
    return found


def stroke_of(ob: Object, uid: str) -> Stroke:
    """A stroke of the list. SculptError when it is not there, or damaged."""
    for entry in entries(ob):
        if entry.uid == uid:
            return entry.stroke
    raise SculptError("The stroke is no longer in the list. Choose another one.")


def active_strokes(ob: Object) -> tuple[Stroke, ...]:
    """The strokes that made the weights, in order."""
    return unmuted(entries(ob))


def unmuted(chosen: Sequence[Entry]) -> tuple[Stroke, ...]:
    """The strokes that are applied, in order."""
    return tuple(entry.stroke for entry in chosen if not entry.muted)


def muted(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list with one stroke muted, or heard again."""
    return [replace(e, muted=not e.muted) if e.uid == uid else e for e in listed]


def soloed(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list with all other strokes muted; when they are already, with none muted."""
    alone = [entry.uid for entry in listed if not entry.muted] == [uid]
    return [replace(entry, muted=not alone and entry.uid != uid) for entry in listed]


def deleted(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list without one stroke."""
    return [entry for entry in listed if entry.uid != uid]


def duplicated(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list with a copy of one stroke right after it."""
    return [
        copy for e in listed for copy in ((e, Entry(e.stroke, e.muted)) if e.uid == uid else (e,))
    ]


def moved(listed: Sequence[Entry], uid: str, step: int) -> list[Entry]:
    """The list with one stroke `step` places farther down, as far as there are any."""
    index = next((i for i, entry in enumerate(listed) if entry.uid == uid), None)
    if index is None:
        return [*listed]
    rest = deleted(listed, uid)
    rest.insert(min(max(index + step, 0), len(rest)), listed[index])
    return rest


def changed(listed: Sequence[Entry], uid: str, stroke: Stroke) -> list[Entry]:
    """The list with another stroke in the place of one."""
    return [replace(entry, stroke=stroke) if entry.uid == uid else entry for entry in listed]


def append(ob: Object, strokes: Iterable[Stroke], muted: bool = False) -> None:
    """Add strokes at the end, the last of which becomes the active one."""
    group = field_of(ob)
    for stroke in strokes:
        _add(ob, Entry(stroke, muted))
    group.active_stroke = len(group.strokes) - 1


def write(ob: Object, chosen: Iterable[Entry]) -> None:
    """Replace the list; the stroke that was active remains so while it is there."""
    group = field_of(ob)
    active, index = active_uid(ob), group.active_stroke
    group.strokes.clear()
    for entry in chosen:
        _add(ob, entry)
    uids = [item.uid for item in group.strokes]
    group.active_stroke = uids.index(active) if active in uids else min(index, len(uids) - 1)


def active_uid(ob: Object) -> str:
    """The uid of the stroke that is chosen in the list; empty when none is."""
    group = field_of(ob)
    chosen = 0 <= group.active_stroke < len(group.strokes)
    return group.strokes[group.active_stroke].uid if chosen else ""


def states(ob: Object, solver: str, strokes: Iterable[Stroke]) -> list[str]:
    """Names of the states that strokes on the base weights lead to: before all, after the first,
    and so on."""
    return _states(ob, solver, map(_text, strokes))


def state_after(ob: Object, solver: str, strokes: Iterable[Stroke]) -> str:
    """The name of the state that further strokes lead to."""
    kept = (item.data for item in field_of(ob).strokes if not item.muted)
    return _states(ob, solver, (*kept, *map(_text, strokes)))[-1]


def _states(ob: Object, solver: str, texts: Iterable[str]) -> list[str]:
    names = [hashlib.sha256(solver.encode() + field_of(ob).base_weights).hexdigest()]
    for text in texts:
        names.append(hashlib.sha256((names[-1] + text).encode()).hexdigest())
    return names


def _add(ob: Object, entry: Entry) -> None:
    item = field_of(ob).strokes.add()
    item.name = entry.stroke.name or f"Stroke {len(field_of(ob).strokes)}"
    item.muted, item.uid, item.data = entry.muted, entry.uid, _text(entry.stroke)


def _entry(item: NEURAL_SCULPT_PG_listed_stroke) -> Entry:
    try:
        stroke = Stroke.from_json(json.loads(item.data))
    except (ValueError, RecursionError, SculptError) as error:
        raise SculptError(
            f"{item.name} cannot be read ({error}). The history of this field is damaged; Apply to"
            " Base keeps the field as it is and ends that."
        ) from error
    return Entry(replace(stroke, name=item.name), item.muted, item.uid)


def _text(stroke: Stroke) -> str:
    """A stroke as it is kept, without the name, which is beside it."""
    return json.dumps(replace(stroke, name="").to_json(), allow_nan=False)
