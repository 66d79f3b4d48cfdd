# SPDX-License-Identifier: GPL-3.0-or-later
"""The state of a field, as it is sent to the worker: its base and visible layers by their ids, and
their bytes.

An id is the SHA-256 of the bytes. The worker gave it together with them and it is kept beside them,
so nothing is hashed here but the weights of older files. Bytes are read only when they are sent.
"""

import hashlib
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from bpy.types import Object

from ...worker.client import JobKind
from ..scene.properties import NETWORK, NEURAL_SCULPT_PG_field, field_of, shown_as
from ..scene.stroke_list import Entry
from .job import Request

Held = dict[str, Callable[[], bytes]]


def request(ob: Object, kind: JobKind | None = None, **fields: Any) -> Request:
    """A request about the field as it is."""
    group = field_of(ob)
    state, held = _state(group)
    return Request({"state": state, "revision": group.revision, **fields}, held=held, kind=kind)


def replay_request(ob: Object, listed: Sequence[Entry], result_revision: str) -> Request:
    """A request for the field that the unmuted entries of `listed` make of the base of `ob`."""
    group = field_of(ob)
    layers: Held = {
        item.layer_id: lambda item=item: item.layer for item in group.strokes if item.layer_id
    }
    visible = [entry for entry in listed if not entry.muted]
    base, held = _base(group)
    held |= {entry.layer: layers[entry.layer] for entry in visible if entry.layer}
    fields = {
        "base": base,
        "entries": [_named(entry) for entry in visible],
        "solver": solver(group),
        **shown_as(group),
        "result_revision": result_revision,
    }
    return Request(fields, held=held, kind=JobKind.REPLAY)


def is_whole(group: NEURAL_SCULPT_PG_field) -> bool:
    """Whether the field is one file of weights, of which its strokes have no layers."""
    return bool(group.weights_id) or bool(group.weights)


def is_simple(group: NEURAL_SCULPT_PG_field) -> bool:
    """Whether one stroke can be applied to the field as it is. It cannot where the unmuted strokes
    lack layers, because the file is older than layers are."""
    if group.solver == NETWORK:
        return True
    return not is_whole(group) and all(item.muted or item.layer_id for item in group.strokes)


def solver(group: NEURAL_SCULPT_PG_field) -> str:
    """The field's solver, as the worker names it."""
    return group.solver.lower()


def _state(group: NEURAL_SCULPT_PG_field) -> tuple[dict[str, Any], Held]:
    if is_whole(group):
        name = group.weights_id or _digest(group.weights)
        return {"base": name, "layers": []}, {name: lambda: group.weights}
    base, held = _base(group)
    layers = []
    for item in group.strokes:
        if not item.muted and item.layer_id:
            layers.append([item.layer_id, item.strength])
            held[item.layer_id] = lambda item=item: item.layer
    return {"base": base, "layers": layers}, held


def _base(group: NEURAL_SCULPT_PG_field) -> tuple[str, Held]:
    name = group.base_id or _digest(group.base_weights)
    return name, {name: lambda: group.base_weights}


def _named(entry: Entry) -> dict[str, Any]:
    """An entry as REPLAY takes it."""
    return {
        "stroke": entry.to_json(),
        "layer": entry.layer or None,
        "context": entry.context or None,
        "strength": entry.strength,
    }


@lru_cache(maxsize=32)
def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
