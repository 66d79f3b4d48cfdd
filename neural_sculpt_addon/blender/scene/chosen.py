# SPDX-License-Identifier: GPL-3.0-or-later
"""The entry of a history that the artist has pointed at, in the list or on the surface.

It is shown on the surface until the history changes. An entry that the history made active by
itself, such as a new stroke, does not count.
"""

from typing import Any

from bpy.types import Context, Object


class _State:
    chosen: tuple[int, int] | None = None  # session_uid of the object, place in its history


def choose(group: Any, context: Context) -> None:
    """Note the entry that the artist has pointed at: the update of `active_stroke`."""
    ob = group.id_data
    _State.chosen = ob.session_uid, group.active_stroke


def forget() -> None:
    """Choose none, for the history has changed."""
    _State.chosen = None


def is_chosen(ob: Object, place: int) -> bool:
    """Whether the artist has pointed at the entry at that place of the object's history."""
    return _State.chosen == (ob.session_uid, place)
