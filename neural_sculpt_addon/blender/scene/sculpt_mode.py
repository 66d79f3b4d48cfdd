# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt Mode is entered: the object of a field counts how often, for undo's sake.

Undo reads only what differs between two ordinary steps of Blender's history, and entering Sculpt
Mode is a step of another kind. So undo to before it leaves an object in Sculpt Mode that is the
same in both ordinary steps (Blender 4.2 to 5.2). The count makes them differ.
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
