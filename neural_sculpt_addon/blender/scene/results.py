# SPDX-License-Identifier: GPL-3.0-or-later
"""Results of the worker as the scene takes them: the next state of a field, its mesh, its layers.

Nothing is changed here. The mesh of a result is in model space, which is the object's local space.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

from bpy.types import Object

from ...common.errors import SculptError
from ...worker.client import Message
from .mesh.proxy_mesh import Geometry
from .next_proxy import next_geometry
from .properties import field_of
from .stroke_list import Entry


@dataclass(frozen=True)
class ObjectState:
    """The values that a result writes on an object, without its layers.

    weights, weights_id: bytes of the whole field, and their id, where it has no layers
    """

    revision: str
    report: str
    geometry: Geometry
    weights: bytes = b""
    weights_id: str = ""


def edited(ob: Object, result: Message) -> ObjectState:
    """The state that a result leads to."""
    fields, group = result.fields, field_of(ob)
    report = json.dumps(fields["report"]) if "report" in fields else ""
    state = ObjectState(fields["revision"], report, next_geometry(ob, result, group.smooth))
    if fields.get("base", group.base_id) == group.base_id:
        return state
    return replace(state, weights=bytes_of(result, "field"), weights_id=fields["base"])


def computed(listed: Sequence[Entry], result: Message) -> tuple[list[Entry], dict[str, bytes]]:
    """The entries with the layers that a replay has computed, and the bytes of the new ones. A
    replay that changes the network's weights has no layers.
    """
    fields, heard = result.fields, sum(not entry.muted for entry in listed)
    if "layers" in fields and len(fields["layers"]) != heard:
        raise SculptError("The worker sent the layers of another history. Try again.")
    numbered = enumerate(fields.get("layers", ()))
    entries, layers = [], {}
    for entry in listed:
        number, found = (None, None) if entry.muted else next(numbered, (None, None))
        if found is None:
            entries.append(entry)
            continue
        entries.append(replace(entry, layer=found["id"], context=found["context"]))
        if (name := f"layer.{number}") in result.arrays:
            layers[found["id"]] = bytes_of(result, name)
        elif found["id"] != entry.layer:
            raise SculptError("The worker sent no layer for {}. Try again.", f"{entry.name:.100}")
    return entries, layers


def bytes_of(result: Message, name: str) -> bytes:
    """The bytes of one of its arrays."""
    return result.arrays[name].tobytes()
