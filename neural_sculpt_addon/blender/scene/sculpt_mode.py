# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt Mode is entered: the object of a field counts how often, for undo's sake.

Of an ordinary step of its history Blender reads only what differs from the ordinary step that it
was at. To enter Sculpt Mode is a step of another kind. So where an object is the same before Sculpt
Mode and after it, Blender (4.2 to 5.2) takes back that it was entered, but stays in Sculpt Mode.
The count makes the two differ.
"""

import bpy

from .properties import field_of, is_field


class _State:
    sculpted: int = 0
    """session_uid of the field that was in Sculpt Mode when something changed last; 0: none."""


def note() -> None:
    """Something has changed."""
    ob = bpy.context.active_object
    now = ob.session_uid if is_field(ob) and ob.mode == "SCULPT" else 0
    if ob is not None and now not in (0, _State.sculpted):
        field_of(ob).times_sculpted += 1
    _State.sculpted = now
