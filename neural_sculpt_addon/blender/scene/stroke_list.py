# SPDX-License-Identifier: GPL-3.0-or-later
"""The history of a field: strokes and absorbed sculpting, in the order in which they apply.

Each entry is an item of a collection on the object, together with its layer. Here entries are read
and written as plain values, and a layer's bytes are written once, when it is new. Model space.
"""

import json
import uuid
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Object

from ...common.errors import SculptError
from ...stroke.stroke import Stroke
from . import chosen
from .properties import GROUP, NEURAL_SCULPT_PG_listed_stroke, field_of

SCULPTED = n_("Sculpted")
"""Name of an entry of absorbed sculpting."""


@dataclass(frozen=True)
class Entry:
    """A line of the history. `uid` tells it from an equal one, wherever it is moved.

    data:    the stroke as in a stroke file, without its name; empty of absorbed sculpting
    layer:   id of what it adds to the field; empty until the worker has computed it
    context: what the layer was computed for
    """

    data: str
    name: str = ""
    muted: bool = False
    strength: float = 1.0
    layer: str = ""
    context: str = ""
    uid: str = field(default_factory=lambda: uuid.uuid4().hex)

    @property
    def stroke(self) -> Stroke:
        """SculptError when it is none."""
        if not self.data:
            raise SculptError(
                "{} was absorbed from other brushes and is no stroke. It can be muted, moved,"
                " weakened and deleted.",
                f"{self.name:.100}",
            )
        return replace(_parsed(self.data), name=self.name)

    def to_json(self) -> dict[str, Any] | None:
        """The stroke as in a stroke file; None of absorbed sculpting."""
        return json.loads(self.data) | {"name": self.name} if self.data else None


def entry_of(stroke: Stroke) -> Entry:
    """A new entry."""
    return Entry(_text(stroke), stroke.name)


def entries(ob: Object) -> list[Entry]:
    """All entries of a field. SculptError when an item is damaged, which no tool of ours wrote."""
    return [_entry(item) for item in field_of(ob).strokes]


def readable(ob: Object) -> list[Entry]:
    """The entries of a field but those that are damaged."""
    found = []
    for item in field_of(ob).strokes:
        with suppress(SculptError):
            found.append(_entry(item))
    return found


def listed_entry(ob: Object, uid: str) -> Entry:
    """An entry of the list. SculptError when it is not there, or damaged."""
    return _found(entries(ob), uid)


def stroke_of(ob: Object, uid: str) -> Stroke:
    """A stroke of the list. SculptError when it is not there, or damaged, or none."""
    return listed_entry(ob, uid).stroke


def shown(item: NEURAL_SCULPT_PG_listed_stroke) -> Stroke | None:
    """The stroke of an item, cheap from the second time on; None of absorbed sculpting, and when it
    is damaged."""
    with suppress(ValueError, RecursionError, SculptError):
        return _parsed(item.data)
    return None


def heard(listed: Iterable[Entry]) -> list[tuple[str, float, str]]:
    """The entries of a list that the field depends on; they are equal for lists that make the same
    field."""
    return [(e.data, e.strength, e.layer) for e in listed if not e.muted]


def muted(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list with one entry muted, or heard again."""
    return [replace(e, muted=not e.muted) if e.uid == uid else e for e in listed]


def soloed(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list with all other entries muted. If they are muted already, no entry is."""
    alone = [entry.uid for entry in listed if not entry.muted] == [uid]
    return [replace(entry, muted=not alone and entry.uid != uid) for entry in listed]


def weakened(listed: Sequence[Entry], uid: str, strength: float) -> list[Entry]:
    """The list with one entry at another strength."""
    return [replace(entry, strength=strength) if entry.uid == uid else entry for entry in listed]


def deleted(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list without one entry."""
    return [entry for entry in listed if entry.uid != uid]


def duplicated(listed: Sequence[Entry], uid: str) -> list[Entry]:
    """The list with a copy of one stroke right after it. SculptError when it is no stroke."""
    place = listed.index(original := _found(listed, uid))
    copy = replace(entry_of(original.stroke), muted=original.muted, strength=original.strength)
    return [*listed[: place + 1], copy, *listed[place + 1 :]]


def moved(listed: Sequence[Entry], uid: str, step: int) -> list[Entry]:
    """The list with one entry `step` places farther down, as far as there are any."""
    index = next((i for i, entry in enumerate(listed) if entry.uid == uid), None)
    if index is None:
        return [*listed]
    rest = deleted(listed, uid)
    rest.insert(min(max(index + step, 0), len(rest)), listed[index])
    return rest


def changed(listed: Sequence[Entry], uid: str, stroke: Stroke) -> list[Entry]:
    """The list with one stroke replaced by another, whose layer is to be computed. SculptError when
    it is not in the list."""
    _found(listed, uid)
    new = {"data": _text(stroke), "layer": "", "context": ""}
    return [replace(e, **new) if e.uid == uid and e.data != new["data"] else e for e in listed]


def write(ob: Object, listed: Sequence[Entry], layers: Mapping[str, bytes]) -> None:
    """Replace the list; the entry that was active remains so while it is there.

    layers: bytes by id of those layers that the object does not have yet
    """
    group = field_of(ob)
    active, index = active_uid(ob), group.active_stroke
    order = [item.uid for item in group.strokes]
    kept = {entry.uid for entry in listed}
    for place in reversed(range(len(order))):
        if order[place] not in kept:
            group.strokes.remove(place)
            del order[place]
    for place, entry in enumerate(listed):
        if entry.uid in order[place:]:
            now = order.index(entry.uid, place)
        else:
            now = len(order)
            group.strokes.add().uid = entry.uid
            order.append(entry.uid)
        if now != place:
            group.strokes.move(now, place)
            order.insert(place, order.pop(now))
        _put(group.strokes[place], entry, layers, _numbered(place + 1))
    for place in reversed(range(len(listed), len(order))):  # two of the same uid: a damaged file
        group.strokes.remove(place)
    order = order[: len(listed)]
    _activate(ob, order.index(active) if active in order else min(index, len(order) - 1))
    chosen.forget()


def append(ob: Object, added: Sequence[Entry], layers: Mapping[str, bytes]) -> None:
    """Add entries at the end, the last of which becomes the active one."""
    group = field_of(ob)
    for entry in added:
        item = group.strokes.add()
        item.uid = entry.uid
        _put(item, entry, layers, _numbered(len(group.strokes)))
    _activate(ob, len(group.strokes) - 1)
    chosen.forget()


def _activate(ob: Object, place: int) -> None:
    """Make an entry the active one, without choosing it (see `chosen`).

    A property of ours that tells when it is set has Blender evaluate the mesh as well, 25 ms with
    100,000 vertices in Sculpt Mode. From 5.0 on it can be set without that.
    """
    group = field_of(ob)
    if group.active_stroke == place:
        return
    if hasattr(ob, "bl_system_properties_get"):
        ob.bl_system_properties_get()[GROUP]["active_stroke"] = place
    else:
        group.active_stroke = place


def _numbered(number: int) -> str:
    """The name of a stroke that was given none."""
    return iface_("Stroke {}").format(number)


def active_uid(ob: Object) -> str:
    """The uid of the entry that is chosen in the list; empty when none is."""
    group = field_of(ob)
    chosen = 0 <= group.active_stroke < len(group.strokes)
    return group.strokes[group.active_stroke].uid if chosen else ""


def _put(
    item: NEURAL_SCULPT_PG_listed_stroke, entry: Entry, layers: Mapping[str, bytes], unnamed: str
) -> None:
    """Write an entry. The bytes of its layer are written only when they have changed."""
    item.name = entry.name or unnamed
    item.muted, item.strength, item.context = entry.muted, entry.strength, entry.context
    if item.data != entry.data:
        item.data = entry.data
    if item.layer_id != entry.layer:
        item.layer = layers[entry.layer] if entry.layer else b""
        item.layer_id = entry.layer


def _found(listed: Sequence[Entry], uid: str) -> Entry:
    for entry in listed:
        if entry.uid == uid:
            return entry
    raise SculptError("The stroke is no longer in the list. Choose another one.")


def _entry(item: NEURAL_SCULPT_PG_listed_stroke) -> Entry:
    kept = item.name, item.muted, item.strength, item.layer_id, item.context, item.uid
    entry = Entry(item.data, *kept)
    try:
        if entry.data or not entry.layer:
            _parsed(entry.data)
    except (ValueError, RecursionError, SculptError) as error:
        raise SculptError(
            "{} cannot be read ({}). The history of this field is damaged; Apply to Base"
            " keeps the field as it is and ends that.",
            f"{item.name:.100}",
            error,
        ) from error
    return entry


@lru_cache(maxsize=1024)
def _parsed(text: str) -> Stroke:
    return Stroke.from_json(json.loads(text))


def _text(stroke: Stroke) -> str:
    """A stroke as it is kept, without the name, which is beside it."""
    return json.dumps(replace(stroke, name="").to_json(), allow_nan=False)
