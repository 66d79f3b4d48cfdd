# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged strings of a file: dropped before anything reads them.

A damaged file can hold text in the place of bytes: to read such a property ends Blender. Or it
holds bytes in the place of text, or text that is no UTF-8: to read that raises an error, in panels,
too. So when a file was loaded, or data-blocks came from one, the stored values are looked at. Those
of a wrong kind are taken out, and their properties have their defaults.
"""

import logging
from collections.abc import Iterator
from typing import Any

import bpy
from bpy.app.handlers import persistent
from bpy.types import ID

from .properties import GROUP

log = logging.getLogger(__name__)


@persistent
def look(*_: object) -> None:
    """Look at our properties of all data-blocks."""
    for owner in (*bpy.data.objects, *bpy.data.brushes, *bpy.data.scenes):
        if (stored := _stored(owner)) is not None:
            group: Any = owner.bl_rna.properties[GROUP]
            for name in _dropped(stored, group.fixed_type):
                log.warning("%s: its %s was damaged, and is empty now", owner.name, name)


def _dropped(stored: Any, group: Any) -> Iterator[str]:
    """Take what cannot be read out of the stored properties of a `group`; their names."""
    for prop in group.properties:
        name = prop.identifier
        if prop.type == "STRING" and name in stored:
            if not _is_sound(stored, name, bytes if prop.subtype == "BYTE_STRING" else str):
                del stored[name]
                yield name
        elif prop.type == "COLLECTION" and isinstance(listed := stored.get(name), list):
            for item in listed:
                yield from _dropped(item, prop.fixed_type)


def _is_sound(stored: Any, name: str, kind: type) -> bool:
    try:
        return isinstance(stored[name], kind)
    except UnicodeDecodeError:
        return False


def _stored(owner: ID) -> Any:
    """The stored properties of ours, as Blender keeps them; None where there are none."""
    if hasattr(owner, "bl_system_properties_get"):  # Blender 5.0 and later
        kept = owner.bl_system_properties_get()
        return None if kept is None else kept.get(GROUP)
    return owner.get(GROUP)


_HANDLERS = ("load_post", "blend_import_post")  # up to 4.2 appending tells nobody


def register() -> None:
    """Listen, ahead of all who read."""
    for name in _HANDLERS:
        if (handlers := getattr(bpy.app.handlers, name, None)) is not None:
            handlers.append(look)


def unregister() -> None:
    """Stop listening."""
    for name in _HANDLERS:
        if (handlers := getattr(bpy.app.handlers, name, None)) is not None:
            handlers.remove(look)
