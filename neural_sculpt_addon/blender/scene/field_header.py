# SPDX-License-Identifier: GPL-3.0-or-later
"""What the head of a safetensors file says of a field: read once for each file, by its id."""

import json
from dataclasses import dataclass

from bpy.types import Object

from .properties import field_of

REMEMBERED = 64  # headers
LARGEST_HEADER = 256 << 10
"""Bytes of a header at most, as for the worker. Panels wait while one is read."""

_DAMAGE = (
    *(ValueError, KeyError, TypeError, IndexError, AttributeError),
    *(ArithmeticError, RecursionError),
)
_known: dict[str, "Header"] = {}


@dataclass(frozen=True)
class Header:
    """Sizes of a field.

    widths: units of the inner layers of its network; none when the file is damaged
    detail: bytes of its detail
    """

    widths: tuple[int, ...] = ()
    detail: int = 0


def header_of(ob: Object) -> Header:
    """The header of a field's base, or of the whole field where that is one file; no layers."""
    group = field_of(ob)
    whole = group.weights_id or group.base_id
    if not whole:  # an older file, of some 100 kB
        return _read(group.weights or group.base_weights)
    if whole not in _known:
        if len(_known) >= REMEMBERED:
            _known.clear()
        _known[whole] = _read(group.weights if group.weights_id else group.base_weights)
    return _known[whole]


def _read(data: bytes) -> Header:
    size = int.from_bytes(data[:8], "little")
    if size > LARGEST_HEADER:
        return Header()
    try:
        tensors = json.loads(data[8 : 8 + size])
        detail = tensors.get("detail", {"shape": [0]})["shape"][0]
        inner = sum(name.endswith(".bias") for name in tensors) - 1
        biases = (tensors[f"layers.{layer}.bias"]["shape"] for layer in range(inner))
        return Header(tuple(int(shape[0]) for shape in biases), int(detail))
    except _DAMAGE:
        return Header()
